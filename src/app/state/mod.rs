//! What the window knows: plain values that panels read and edit. Nothing here starts work.

pub mod paper;
pub mod recent;
pub mod undo;

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::accel::Accel;
use crate::app::state::paper::{PaperPlan, PaperResult, RowFormat};
use crate::camera::Camera;
use crate::overlay::{NodeTable, OverlaySettings, Selection};
use crate::render::{Frame, RenderSettings};
use crate::scene::{Scene, SceneSource};
use bvhscope_engine::geometry::Aabb;
use bvhscope_engine::settings::BuildSettings;

/// What the user wants to see. Panels edit it; `reconcile` makes the rest follow.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Wanted {
    /// The model.
    pub source: SceneSource,
    /// How its tree is built.
    pub build: BuildSettings,
    /// Threads for building and tracing; 0 for all.
    pub threads: usize,
    /// From where it is seen.
    pub camera: Camera,
    /// What the picture shows.
    pub render: RenderSettings,
    /// Which containers lie over it.
    pub overlay: OverlaySettings,
}

/// What is on the screen. Tree and picture are swapped as a unit, so that image, lines and numbers never disagree.
#[derive(Clone)]
pub struct Presented {
    /// The tree, with its scene and report.
    pub accel: Arc<Accel>,
    /// Its nodes for the overlay.
    pub table: Arc<NodeTable>,
    /// A picture traced through exactly this tree.
    pub frame: Arc<Frame>,
    /// Unique for each picture.
    pub frame_id: u64,
    /// Container and primitive tests a primary ray, from the newest picture of this tree that counted them.
    pub tests_per_ray: Option<[f32; 2]>,
    /// The thread count that was asked for when the tree was built.
    pub threads: usize,
}

/// A running job, for the job strip.
#[derive(Debug, Clone, PartialEq)]
pub struct JobStatus {
    /// "Loading bunny.obj", "Building", "Tracing".
    pub label: String,
    /// Finished share, 0 to 1.
    pub progress: f32,
    /// When it was asked for.
    pub since: Instant,
}

/// What runs at the moment.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Jobs {
    /// A model is being read.
    pub load: Option<JobStatus>,
    /// A tree is being built.
    pub build: Option<JobStatus>,
    /// A picture is being traced.
    pub render: Option<JobStatus>,
    /// The paper panel measures.
    pub lab: Option<JobStatus>,
}

/// So many messages are kept to be read again.
const TOLD: usize = 200;

/// How serious a message is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Severity {
    /// Good to know; goes away by itself.
    Info,
    /// Something was skipped or limited.
    Warning,
    /// Something failed; stays until closed, can be copied.
    Error,
}

impl Severity {
    /// The word in front of the text.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Info => "Note",
            Self::Warning => "Warning",
            Self::Error => "Error",
        }
    }
}

/// Something that the user is told.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    /// How serious it is.
    pub severity: Severity,
    /// What happened, where, why and what to do.
    pub text: String,
    /// When it came up.
    pub since: Instant,
}

/// The pixel under the cursor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hover {
    /// Column in the wanted picture.
    pub x_px: u32,
    /// Row in the wanted picture.
    pub y_px: u32,
    /// The triangle under it.
    pub primitive: Option<u32>,
    /// Distance along the ray.
    pub distance: f32,
    /// The value that the colour stands for, in modes that have one.
    pub value: Option<f32>,
}

/// Which colours the window has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Theme {
    /// Light on dark.
    Dark,
    /// Dark on light.
    Light,
    /// As the desktop has it.
    System,
}

/// A side panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Scene, statistics, selection.
    Left,
    /// Tree, containers, picture.
    Right,
}

/// How the camera is moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Navigation {
    /// Around the target.
    Orbit,
    /// WASD, Q and E through the scene.
    Fly,
}

/// What is kept between runs beside [`Wanted`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Preferences {
    /// Colours of the window.
    pub theme: Theme,
    /// How the camera is moved.
    pub navigation: Navigation,
    /// The traced picture is shown under the containers (key N).
    pub show_geometry: bool,
    /// Containers are shown (key B).
    pub show_containers: bool,
    /// The left panel is open.
    pub left_open: bool,
    /// The right panel is open.
    pub right_open: bool,
    /// The paper panel is open.
    pub paper_open: bool,
    /// What it measures.
    pub paper: PaperPlan,
    /// Files opened lately, newest first.
    pub recent: Vec<PathBuf>,
    /// The line of help over the first scene has been seen.
    pub greeted: bool,
}

impl Default for Preferences {
    fn default() -> Self {
        Self {
            theme: Theme::Dark,
            navigation: Navigation::Orbit,
            show_geometry: true,
            show_containers: true,
            left_open: true,
            right_open: true,
            paper_open: false,
            paper: PaperPlan::default(),
            recent: Vec::new(),
            greeted: false,
        }
    }
}

/// Something that must be done outside of plain values; carried out by the app after the panels have been drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    /// Open this model.
    Open(SceneSource),
    /// Ask for a file with the desktop's dialog.
    OpenDialog,
    /// Read the present model again.
    Reload,
    /// Stop what runs (Esc, the ✕ of the job strip).
    CancelJobs,
    /// Measure what the paper panel describes.
    Measure,
    /// Stop measuring; the rows that are there stay.
    CancelMeasuring,
    /// Save the measured rows in the current folder; the message says where.
    SaveRows(RowFormat),
    /// Save the viewport as a PNG in the current folder (F12); the message says where.
    Screenshot,
    /// Copy this text.
    Copy(String),
    /// End the program.
    Quit,
}

/// Everything that the window knows.
pub struct AppState {
    /// What the user wants.
    pub wanted: Wanted,
    /// What is on the screen; `None` until the first picture.
    pub presented: Option<Presented>,
    /// The newest loaded scene, perhaps not yet presented.
    pub scene: Option<Arc<Scene>>,
    /// What runs.
    pub jobs: Jobs,
    /// What the paper panel has measured.
    pub paper: Option<PaperResult>,
    /// Nodes that stand out.
    pub selection: Selection,
    /// The selected triangle and the path of nodes from the root to its leaf.
    pub picked: Option<(u32, Vec<u32>)>,
    /// What is under the cursor.
    pub hover: Option<Hover>,
    /// What the user was told and has not closed.
    pub messages: Vec<Message>,
    /// Everything that the user was told lately, oldest first.
    pub message_log: VecDeque<Message>,
    /// The list of what was told is open.
    pub messages_open: bool,
    /// Kept between runs.
    pub preferences: Preferences,
    /// To be carried out after this UI frame.
    pub requests: Vec<Request>,
    /// The command palette is open, with what was typed.
    pub palette: Option<String>,
    /// The list of shortcuts is open.
    pub shortcuts_open: bool,
    /// The start page with samples and recent files is open.
    pub start_page_open: bool,
    /// Earlier and later settings, for undo.
    pub undo: crate::app::state::undo::UndoStack,
    /// Containers drawn and wanted in the last frame.
    pub overlay_counts: (usize, usize),
    /// Median trace speed of the last second in Mray/s.
    pub mrays_per_s: f64,
    /// Name of the GPU adapter, and whether it is a software one.
    pub adapter: (String, bool),
    /// The window has no room for both side panels.
    pub narrow: bool,
    /// The side panel that is shown where there is room for one only.
    pub front: Side,
    /// Size of the viewport in pixels.
    pub viewport_px: [u32; 2],
    /// Pixels a point: the scale of the screen.
    pub pixels_per_point: f32,
    /// Models may read files outside of their folder.
    pub allow_outside: bool,
    /// The keys of the viewport go there.
    pub viewport_focused: bool,
    /// The graphics driver failed: picture and containers are no longer drawn by it.
    pub overlay_failed: bool,
    /// The file of the scene is no longer there.
    pub file_gone: bool,
    /// The up axis chosen by hand, and the model that it was chosen for.
    pub chosen_up: Option<(SceneSource, Vec3)>,
}

impl Wanted {
    /// The built-in teapot with default settings.
    pub fn new(source: SceneSource) -> Self {
        Self {
            source,
            build: BuildSettings::default(),
            threads: 0,
            camera: Camera::framing(&Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE }, Vec3::Y),
            render: RenderSettings::default(),
            overlay: OverlaySettings::default(),
        }
    }
}

impl AppState {
    /// A window in which nothing has been loaded yet.
    pub fn new(wanted: Wanted, preferences: Preferences) -> Self {
        Self {
            wanted,
            presented: None,
            scene: None,
            jobs: Jobs::default(),
            paper: None,
            selection: Selection::default(),
            picked: None,
            hover: None,
            messages: Vec::new(),
            message_log: VecDeque::new(),
            messages_open: false,
            preferences,
            requests: Vec::new(),
            palette: None,
            shortcuts_open: false,
            start_page_open: false,
            undo: crate::app::state::undo::UndoStack::default(),
            overlay_counts: (0, 0),
            mrays_per_s: 0.0,
            adapter: (String::new(), false),
            narrow: false,
            front: Side::Right,
            viewport_px: [0, 0],
            pixels_per_point: 1.0,
            allow_outside: false,
            viewport_focused: false,
            overlay_failed: false,
            file_gone: false,
            chosen_up: None,
        }
    }

    /// Goes back one step of settings.
    pub fn undo(&mut self) -> bool {
        self.undo.undo(&mut self.wanted)
    }

    /// Goes forward again.
    pub fn redo(&mut self) -> bool {
        self.undo.redo(&mut self.wanted)
    }

    /// Whether a side panel is seen: it is open, and there is room for it.
    pub fn shows_panel(&self, side: Side) -> bool {
        let Preferences { left_open, right_open, .. } = self.preferences;
        let open = if side == Side::Left { left_open } else { right_open };
        open && (!(self.narrow && left_open && right_open) || self.front == side)
    }

    /// Opens or closes a side panel. In a narrow window the other one gives way, and does not come back by itself.
    pub fn toggle_panel(&mut self, side: Side) {
        let open = !self.shows_panel(side);
        let Preferences { left_open, right_open, .. } = &mut self.preferences;
        *(if side == Side::Left { &mut *left_open } else { &mut *right_open }) = open;
        if open {
            self.front = side;
        } else if self.narrow {
            (*left_open, *right_open) = (false, false);
        }
    }

    /// The scene's up axis or the one chosen for it by hand; y where nothing is loaded.
    pub fn up(&self) -> Vec3 {
        let Some(presented) = &self.presented else { return Vec3::Y };
        match &self.chosen_up {
            Some((source, up)) if *source == presented.accel.scene.source => *up,
            _ => presented.accel.scene.up,
        }
    }

    /// The box around the presented scene.
    pub fn bounds(&self) -> Option<Aabb> {
        self.presented.as_ref().map(|presented| presented.accel.scene.bounds)
    }

    /// Tells the user something.
    pub fn notify(&mut self, severity: Severity, text: impl Into<String>) {
        let message = Message { severity, text: text.into(), since: Instant::now() };
        if self.message_log.len() == TOLD {
            self.message_log.pop_front();
        }
        self.message_log.push_back(message.clone());
        self.messages.push(message);
    }
}
