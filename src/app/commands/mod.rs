//! Every action from one list: it makes the menu, the palette, the list of shortcuts and the keyboard.

mod keyboard;
mod perform;
mod report;
mod table;
mod walk;

use egui::{Key, KeyboardShortcut, Modifiers};

use crate::app::state::paper::{Experiment, RowFormat};
use crate::app::state::{AppState, Side, Theme};
use crate::render::Shading;
use bvhscope_engine::settings::{BuilderKind, Curve, Preset};
use bvhscope_engine::tree::ContainerKind;

pub use keyboard::handle_shortcuts;
pub use report::{command_line, statistics_text};
pub(crate) use table::{builder_description, shading_description};
pub use table::{entries, entries_for};

/// Something that the user can ask for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    /// Ask for a model file.
    Open,
    /// Open a file of the recent list, newest 0.
    OpenRecent(usize),
    /// Open a scene of [`crate::scene::BUILTIN_SCENES`].
    OpenBuiltin(usize),
    /// Read the model again.
    Reload,
    /// Save the viewport as a picture.
    Screenshot,
    /// Show samples and recent files.
    StartPage,
    /// Copy the command line that makes the same picture.
    CopyCommandLine,
    /// Copy all numbers as text.
    CopyStatistics,
    /// End the program.
    Quit,
    /// Look along an axis.
    View(ViewDirection),
    /// Perspective or orthographic.
    ToggleOrthographic,
    /// Y or z is up.
    ToggleUpAxis,
    /// Orbit or fly.
    ToggleFly,
    /// The default view.
    ResetView,
    /// Fill the view with the selected node, or with the model.
    FrameSelection,
    /// A step around the target.
    Orbit(OrbitStep),
    /// Nearer to the point under the pointer.
    ZoomIn,
    /// Away from the point under the pointer.
    ZoomOut,
    /// Containers on or off.
    ToggleContainers,
    /// The traced picture on or off.
    ToggleGeometry,
    /// The triangles' edges on or off.
    ToggleMeshEdges,
    /// Fit the range of the heat map to the picture.
    FitHeatRange,
    /// Choose what a pixel's colour means.
    Shade(Shading),
    /// Left panel on or off.
    ToggleLeftPanel,
    /// Right panel on or off.
    ToggleRightPanel,
    /// Colours of the window.
    Theme(Theme),
    /// Threshold and ε of a preset.
    Preset(Preset),
    /// Choose the algorithm.
    Builder(BuilderKind),
    /// Boxes or spheres.
    Container(ContainerKind),
    /// Threshold one up.
    RaiseThreshold,
    /// Threshold one down.
    LowerThreshold,
    /// The shown depths one down the tree.
    Deeper,
    /// The shown depths one up the tree.
    Shallower,
    /// Only leaves on or off.
    ToggleLeavesOnly,
    /// Ancestors on or off.
    ToggleParents,
    /// Walk to the parent.
    SelectParent,
    /// Walk to the first child.
    SelectChild,
    /// Walk to the second child.
    SelectSecondChild,
    /// Walk to the sibling.
    SelectSibling,
    /// Do not draw the selected node.
    HideSelected,
    /// Draw all nodes again.
    ShowAll,
    /// The paper panel on or off.
    TogglePaper,
    /// Measure one of the paper's tables or figures.
    Measure(Experiment),
    /// Save what was measured.
    SaveRows(RowFormat),
    /// All settings back to their defaults.
    ResetSettings,
    /// Stop the running job; else clear the selection.
    Cancel,
    /// Take back the last change of settings.
    Undo,
    /// Bring it back.
    Redo,
    /// Find any action by typing.
    Palette,
    /// List all keys.
    Shortcuts,
    /// List what the user was told.
    Messages,
}

/// Where a key turns the camera to, around the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum OrbitStep {
    /// To the model's left.
    Left,
    /// To its right.
    Right,
    /// Over its top.
    Up,
    /// Under it.
    Down,
}

/// The axes that the camera can look along, seen from the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ViewDirection {
    /// From the front.
    Front,
    /// From behind.
    Back,
    /// From the right.
    Right,
    /// From the left.
    Left,
    /// From above.
    Top,
    /// From below.
    Bottom,
}

/// Where an action stands in the menu and in lists.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Category {
    /// Models, pictures, text.
    File,
    /// Camera, picture, window.
    View,
    /// The tree and its nodes.
    Tree,
    /// Measuring.
    Lab,
    /// How to use the program.
    Help,
}

impl Category {
    /// All, in the order of the menu bar.
    pub const ALL: [Self; 5] = [Self::File, Self::View, Self::Tree, Self::Lab, Self::Help];

    /// The name in the menu bar.
    pub const fn label(self) -> &'static str {
        match self {
            Self::File => "File",
            Self::View => "View",
            Self::Tree => "Tree",
            Self::Lab => "Lab",
            Self::Help => "Help",
        }
    }
}

/// An action with everything that lists show of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// What it does.
    pub action: Action,
    /// Its name.
    pub label: String,
    /// What it does, in one sentence.
    pub description: String,
    /// Its menu.
    pub category: Category,
    /// Its keys; the first is shown in menus.
    pub shortcuts: Vec<KeyboardShortcut>,
    /// Its group within the menu; a line stands between groups.
    pub group: u8,
    /// Its keys belong to the viewport: elsewhere they move what has the focus.
    pub in_viewport: bool,
}

impl Entry {
    /// Its keys as text: `Ctrl+Shift+Z, Ctrl+Y`; empty where it has none.
    pub fn keys(&self) -> String {
        self.shortcuts.iter().map(shortcut_text).collect::<Vec<_>>().join(", ")
    }

    /// Its first key as text; empty where it has none.
    pub fn first_key(&self) -> String {
        self.shortcuts.first().map(shortcut_text).unwrap_or_default()
    }
}

/// A key with its modifiers, as menus print it.
pub fn shortcut_text(shortcut: &KeyboardShortcut) -> String {
    let Modifiers { alt, ctrl, shift, command, .. } = shortcut.modifiers;
    let mut text = String::new();
    for (held, name) in [(ctrl || command, "Ctrl+"), (alt, "Alt+"), (shift, "Shift+")] {
        if held {
            text.push_str(name);
        }
    }
    let key = match shortcut.logical_key {
        Key::Questionmark => "?",
        Key::OpenBracket => "[",
        Key::CloseBracket => "]",
        Key::ArrowUp => "Up",
        Key::ArrowDown => "Down",
        Key::ArrowLeft => "Left",
        Key::ArrowRight => "Right",
        Key::Escape => "Esc",
        Key::Plus => "+",
        Key::Equals => "=",
        Key::Minus => "-",
        Key::Period => ".",
        Key::Comma => ",",
        key => key.name(),
    };
    text + key
}

impl Action {
    /// Whether it can do anything now.
    pub fn is_enabled(self, state: &AppState) -> bool {
        let selected = state.selection.nodes.selected.is_some();
        match self {
            Self::SelectParent | Self::SelectChild | Self::SelectSecondChild | Self::SelectSibling => {
                walk::target(self, state).is_some()
            }
            // The threshold is AAC's.
            Self::RaiseThreshold | Self::LowerThreshold => state.wanted.build.builder == BuilderKind::Aac,
            Self::HideSelected => selected,
            Self::ShowAll => !state.selection.nodes.hidden.is_empty(),
            Self::FitHeatRange => state.model.presented.as_ref().is_some_and(|shown| !shown.frame.values.is_empty()),
            Self::FrameSelection | Self::ResetView | Self::Screenshot | Self::CopyStatistics => {
                state.model.presented.is_some()
            }
            Self::Undo => state.undo.can_undo(),
            Self::Redo => state.undo.can_redo(),
            Self::Cancel => state.activity.has_jobs() || selected,
            Self::Measure(_) => state.model.loaded.is_some(),
            Self::SaveRows(format) => state.activity.measured.as_ref().is_some_and(|result| match format {
                RowFormat::Csv | RowFormat::Json => !result.rows.is_empty(),
                RowFormat::Png | RowFormat::Svg => !result.panels.is_empty(),
            }),
            Self::OpenRecent(index) => index < state.preferences.recent.len(),
            Self::Builder(builder) => {
                let wanted = bvhscope_engine::settings::BuildSettings { builder, ..state.wanted.build };
                wanted.refusal(state.model.loaded.as_ref().map_or(0, |scene| scene.triangles.len())).is_none()
            }
            Self::Container(container) => {
                let wanted = bvhscope_engine::settings::BuildSettings { container, ..state.wanted.build };
                wanted.refusal(0).is_none()
            }
            _ => true,
        }
    }

    /// For choices and switches: whether it is on. `None` for everything else.
    pub fn is_on(self, state: &AppState) -> Option<bool> {
        let (wanted, preferences) = (&state.wanted, &state.preferences);
        Some(match self {
            Self::ToggleOrthographic => wanted.camera.projection == crate::camera::Projection::Orthographic,
            Self::ToggleFly => preferences.navigation == crate::app::state::Navigation::Fly,
            Self::ToggleContainers => preferences.show_containers,
            Self::ToggleGeometry => preferences.show_geometry,
            Self::ToggleMeshEdges => wanted.render.mesh_edges,
            Self::ToggleLeftPanel => state.shows_panel(Side::Left),
            Self::ToggleRightPanel => state.shows_panel(Side::Right),
            Self::TogglePaper => preferences.paper_open,
            Self::ToggleLeavesOnly => wanted.overlay.leaves_only,
            Self::ToggleParents => wanted.overlay.parents,
            Self::Shade(shading) => wanted.render.shading == shading,
            Self::Theme(theme) => preferences.theme == theme,
            Self::Builder(builder) => wanted.build.builder == builder,
            Self::Container(container) => wanted.build.container == container,
            Self::Preset(preset) => is_preset(state, preset),
            _ => return None,
        })
    }
}

/// Whether threshold, ε, curve and passes are those of `preset`.
pub fn is_preset(state: &AppState, preset: Preset) -> bool {
    let (threshold, epsilon) = preset.parameters();
    let build = &state.wanted.build;
    build.builder == BuilderKind::Aac
        && build.threshold == threshold
        && (build.epsilon - epsilon).abs() < 1e-4
        && build.curve == Curve::Morton
        && build.optimize == preset.passes()
}
