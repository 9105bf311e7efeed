//! What of the window is open, its size and its focus.

use std::sync::Arc;

use crate::app::state::graphics::Graphics;
use crate::app::state::lesson::{LESSONS, Lesson, Reading};
use crate::app::state::path_field::PathField;
use crate::app::state::second_tree::TreeSide;
use crate::app::state::thumbnails::Thumbnails;
use crate::catalog::terms::Term;

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
        self.help.is_some() || self.about_open || self.start_page_open || self.messages_open
    }

    /// Closes every dialog but the command palette.
    pub fn close_dialogs(&mut self) {
        self.help = None;
        self.about_open = false;
        self.start_page_open = false;
        self.messages_open = false;
    }
}
