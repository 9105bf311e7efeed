//! Open parts of the window, its size and its focus; the dock; the graphics adapter.

use std::sync::Arc;

use serde::{Deserialize, Deserializer, Serialize};

use crate::app::state::lesson::{LESSONS, Lesson, Reading};
use crate::app::state::paper::PaperPlan;
use crate::app::state::picture_cut::Standing;
use crate::app::state::second_tree::TreeSide;
use crate::app::state::start_page::{PathField, Thumbnails};
use crate::catalog::terms::Term;
use crate::overlay::{OverlaySettings, Shown};

/// A side panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Scene, statistics, selection.
    Left,
    /// Tree, containers, picture.
    Right,
}

/// A page of the help dialog.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HelpPage {
    /// Keys and mouse gestures.
    Shortcuts,
    /// The words of the window.
    Glossary,
}

/// The help dialog.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Help {
    /// The page that is shown.
    pub page: HelpPage,
    /// Only what contains this text is listed.
    pub filter: String,
    /// The term that is marked in the glossary.
    pub term: Option<&'static Term>,
}

/// Open dialogs, panels and the viewport's size. Nothing here outlives the run.
#[derive(Debug, Clone)]
pub struct Layout {
    /// The window is too narrow for both side panels.
    pub narrow: bool,
    /// The side panel that a narrow window shows where both are open.
    pub front_side: Side,
    /// The text typed into the command palette; `None` while it is closed.
    pub palette: Option<String>,
    /// The number of a node or triangle that is typed, and why there is none such; `None` while the field is closed.
    pub go_to: Option<(String, String)>,
    /// The help dialog; `None` while it is closed.
    pub help: Option<Help>,
    /// The card of the tour that is shown, from 0.
    pub tour: Option<usize>,
    /// The dialog about the program is open.
    pub about_open: bool,
    /// The start page with samples and recent files is open.
    pub start_page_open: bool,
    /// The tree whose settings the panel shows while there are two.
    pub edited_tree: TreeSide,
    /// The path that is typed on the start page.
    pub path_field: PathField,
    /// The message history is open.
    pub messages_open: bool,
    /// Where the menu of the selected node is open, in points of the window.
    pub node_menu: Option<[f32; 2]>,
    /// Width and height of the viewport in pixels.
    pub viewport_px: [u32; 2],
    /// Pixels per point: the scale of the screen.
    pub pixels_per_point: f32,
    /// The viewport has the keyboard focus.
    pub viewport_focused: bool,
    /// The graphics adapter.
    pub graphics: Graphics,
    /// Why nothing can be copied to other programs, where that is so.
    pub clipboard_fault: Option<String>,
    /// Small pictures of models, for the start page.
    pub thumbnails: Thumbnails,
    /// The lessons that can be read, built-in ones first.
    pub lessons: Vec<Arc<Lesson>>,
    /// The lesson that is being read.
    pub lesson: Option<Reading>,
}

impl Default for Layout {
    fn default() -> Self {
        Self {
            narrow: false,
            front_side: Side::Right,
            palette: None,
            go_to: None,
            help: None,
            tour: None,
            about_open: false,
            start_page_open: false,
            edited_tree: TreeSide::A,
            path_field: PathField::default(),
            messages_open: false,
            node_menu: None,
            viewport_px: [0, 0],
            pixels_per_point: 1.0,
            viewport_focused: false,
            graphics: Graphics::default(),
            clipboard_fault: None,
            thumbnails: Thumbnails::default(),
            lessons: LESSONS.into_iter().filter_map(|text| Lesson::parse(text).ok()).map(Arc::new).collect(),
            lesson: None,
        }
    }
}

impl Layout {
    /// Width of the viewport over its height; 1 before it is laid out.
    pub fn aspect(&self) -> f32 {
        let [width, height] = self.viewport_px.map(|side| side as f32);
        if width > 0.0 && height > 0.0 { width / height } else { 1.0 }
    }

    /// Opens the field for a number, or closes it.
    pub fn toggle_go_to(&mut self) {
        self.go_to = if self.go_to.is_some() { None } else { Some(Default::default()) };
    }

    /// Opens a page of the help dialog, or closes the dialog where it shows that page.
    pub fn toggle_help(&mut self, page: HelpPage) {
        let open = self.help.as_ref().is_some_and(|help| help.page == page);
        self.help = (!open).then(|| Help { page, filter: String::new(), term: None });
    }

    /// Opens the glossary at a term.
    pub fn explain(&mut self, term: &'static Term) {
        self.help = Some(Help { page: HelpPage::Glossary, filter: String::new(), term: Some(term) });
    }

    /// Whether a dialog other than the command palette is open.
    pub const fn has_dialog(&self) -> bool {
        self.help.is_some() || self.go_to.is_some() || self.about_open || self.start_page_open || self.messages_open
    }

    /// Closes every dialog but the command palette.
    pub fn close_dialogs(&mut self) {
        self.help = None;
        self.go_to = None;
        self.about_open = false;
        self.start_page_open = false;
        self.messages_open = false;
    }
}

/// The dock, as saved between runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Dock {
    /// Name of the open view; `None` while the dock is closed.
    pub open: Option<String>,
    /// Height in points that the user gave it.
    pub height: f32,
}

impl Default for Dock {
    fn default() -> Self {
        Self { open: None, height: 288.0 }
    }
}

impl Dock {
    /// Opens a view, or closes the dock where it shows that view.
    pub fn toggle(&mut self, view: &str) {
        self.open = (!self.shows(view)).then(|| view.to_owned());
    }

    /// Opens a view.
    pub fn show(&mut self, view: &str) {
        self.open = Some(view.to_owned());
    }

    /// Whether a view is open.
    pub fn shows(&self, view: &str) -> bool {
        self.open.as_deref() == Some(view)
    }
}

/// Reads a saved dock. Version 0.1 saved whether its paper panel was open.
pub(super) fn dock_from_saved<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Dock, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Saved {
        PaperOpen(bool),
        Dock(Dock),
    }
    Ok(match Saved::deserialize(deserializer)? {
        Saved::PaperOpen(open) => Dock { open: open.then(|| PaperPlan::VIEW.to_owned()), ..Dock::default() },
        Saved::Dock(dock) => dock,
    })
}

/// The graphics adapter and its state.
#[derive(Debug, Clone, Default)]
pub struct Graphics {
    /// Name of the adapter; empty where there is none.
    pub adapter_name: String,
    /// Graphics interface through which the adapter is used: "Vulkan", "OpenGL".
    pub backend: String,
    /// The adapter renders in software.
    pub is_software: bool,
    /// The driver reported an error, so the overlay's pipeline is no longer used.
    pub failed: bool,
    /// The containers that the last UI frame drew; `None` while they are off and before the first picture.
    pub shown: Option<Arc<Shown>>,
    /// The containers of the second tree that are drawn; `None` while they are off or that tree is out of view.
    pub second_shown: Option<Arc<Shown>>,
    /// The clusters that are drawn in place of the chosen depths; `None` where the depths are.
    pub standing: Option<Arc<Standing>>,
}

impl Graphics {
    /// Number of containers that are drawn, and number that the settings select.
    pub fn overlay_counts(&self) -> (usize, usize) {
        self.shown.as_ref().map_or((0, 0), |shown| (shown.nodes.len(), shown.wanted))
    }

    /// Number of containers that the adapter draws where no limit is set.
    pub const fn automatic_budget(&self) -> u32 {
        if self.is_software { OverlaySettings::SOFTWARE_BUDGET } else { OverlaySettings::BUDGET }
    }
}
