//! State of the window: plain values that panels read, commands change and workers follow. Starts no work and knows no egui.

mod wanted;

mod activity;
pub mod bookmarks;
pub mod comparison;
mod graphics;
mod heat_basis;
mod layout;
mod messages;
mod model;
mod path_field;
mod selection;

pub mod paper;
mod preferences;
pub mod recent;
mod request;
mod thumbnails;
mod undo;

pub use activity::{Activity, JobStatus, PROGRESS_DELAY};
pub use graphics::Graphics;
pub use heat_basis::HeatBasis;
pub use layout::{Help, HelpPage, Layout, Side};
pub use messages::{Message, MessageLog, Severity};
pub use model::{Model, Presented};
pub use path_field::{FolderEntry, Listing, PathField};
pub use preferences::{Navigation, Preferences, Theme};
pub use request::Request;
pub use selection::{HoveredPixel, PickedTriangle, SelectionState};
pub use thumbnails::{THUMBNAIL_SIZE, Thumbnail, Thumbnails};
pub use undo::UndoStack;
pub use wanted::Wanted;

/// State of the window.
pub struct AppState {
    /// What the user wants to see.
    pub wanted: Wanted,
    /// The loaded model and what is on the screen.
    pub model: Model,
    /// Running jobs and measured results.
    pub activity: Activity,
    /// Selected, hidden and hovered parts.
    pub selection: SelectionState,
    /// Messages to the user.
    pub messages: MessageLog,
    /// Open dialogs, size and focus of the window.
    pub layout: Layout,
    /// The graphics adapter.
    pub graphics: Graphics,
    /// Settings saved between runs, apart from `wanted`.
    pub preferences: Preferences,
    /// Earlier and later values of `wanted`.
    pub undo: UndoStack,
    /// Effects to perform after this UI frame.
    pub requests: Vec<Request>,
    /// Why nothing can be copied to other programs, where that is so.
    pub clipboard_fault: Option<String>,
    /// Small pictures of models, for the start page.
    pub thumbnails: Thumbnails,
    /// What the fixed range of the heat map was fitted to.
    pub heat_basis: Option<HeatBasis>,
}

impl AppState {
    /// The state before anything is loaded.
    pub fn new(wanted: Wanted, preferences: Preferences) -> Self {
        Self {
            wanted,
            model: Model::default(),
            activity: Activity::default(),
            selection: SelectionState::default(),
            messages: MessageLog::default(),
            layout: Layout::default(),
            graphics: Graphics::default(),
            preferences,
            undo: UndoStack::default(),
            requests: Vec::new(),
            clipboard_fault: None,
            thumbnails: Thumbnails::default(),
            heat_basis: None,
        }
    }

    /// Copies a text to the clipboard and posts the `note` that it was, unless that is empty; where there is no clipboard, posts
    /// that instead.
    pub fn copy(&mut self, text: String, note: &str) {
        match &self.clipboard_fault {
            None if note.is_empty() => {}
            None => self.messages.notify(Severity::Info, note),
            Some(reason) => {
                let text = format!("Nothing was copied, because there is no clipboard to copy to: {reason}");
                self.messages.notify(Severity::Warning, text);
            }
        }
        self.requests.push(Request::Copy(text));
    }

    /// Fits the heat map to every picture again, with a message, where its fixed range belongs to another model, shading or
    /// traversal; called once a UI frame.
    pub fn follow_heat_range(&mut self) {
        if heat_basis::follow(&mut self.heat_basis, &mut self.wanted) {
            let text =
                "The heat range is fitted to every picture again: the fixed one was for other counts (C fixes it)";
            self.messages.notify(Severity::Info, text);
        }
    }

    /// Tracing speed in Mray/s: of the picture at rest the median of its passes, otherwise that of the last second.
    pub fn mrays_per_s(&self) -> f64 {
        let at_rest =
            |shown: &Presented| shown.counted.as_ref().and_then(|counted| counted.mrays_per_s_of(&shown.frame));
        self.model.presented.as_ref().and_then(at_rest).unwrap_or(self.activity.mrays_per_s)
    }

    /// Restores the settings before the last change. Returns whether there were any.
    pub fn undo(&mut self) -> bool {
        self.undo.undo(&mut self.wanted)
    }

    /// Restores the settings that were last undone. Returns whether there were any.
    pub fn redo(&mut self) -> bool {
        self.undo.redo(&mut self.wanted)
    }

    /// First and last depth that are drawn of the presented tree; of a tree that is not there yet, the wanted ones.
    pub fn drawn_depths(&self) -> [u32; 2] {
        let overlay = &self.wanted.overlay;
        let of_tree = self.model.presented.as_ref().map(|shown| shown.table.drawn_depths(overlay));
        of_tree.or(overlay.depth).unwrap_or_default()
    }

    /// Whether boxes and whether spheres are drawn; neither while containers are off.
    pub fn drawn_kinds(&self) -> [bool; 2] {
        let tree = self.model.presented.as_ref().map(|shown| shown.table.container_kind());
        let kinds = self.wanted.overlay.kinds(tree.unwrap_or(self.wanted.build.container));
        if self.preferences.show_containers { kinds } else { [false; 2] }
    }

    /// Whether a side panel is visible: open, and not displaced by the other one in a narrow window.
    pub fn shows_panel(&self, side: Side) -> bool {
        let Preferences { left_open, right_open, .. } = self.preferences;
        let open = if side == Side::Left { left_open } else { right_open };
        open && (!(self.layout.narrow && left_open && right_open) || self.layout.front_side == side)
    }

    /// Opens or closes a side panel. In a narrow window opening one hides the other, and closing it closes both.
    pub fn toggle_panel(&mut self, side: Side) {
        let open = !self.shows_panel(side);
        let Preferences { left_open, right_open, .. } = &mut self.preferences;
        *(if side == Side::Left { &mut *left_open } else { &mut *right_open }) = open;
        if open {
            self.layout.front_side = side;
        } else if self.layout.narrow {
            (*left_open, *right_open) = (false, false);
        }
    }
}
