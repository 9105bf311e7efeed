//! What of the window is open, its size and its focus.

/// A side panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Scene, statistics, selection.
    Left,
    /// Tree, containers, picture.
    Right,
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
    /// The list of shortcuts is open.
    pub shortcuts_open: bool,
    /// The start page with samples and recent files is open.
    pub start_page_open: bool,
    /// The message history is open.
    pub messages_open: bool,
    /// Width and height of the viewport in pixels.
    pub viewport_px: [u32; 2],
    /// Pixels per point: the scale of the screen.
    pub pixels_per_point: f32,
    /// The viewport has the keyboard focus.
    pub viewport_focused: bool,
}

impl Default for Layout {
    fn default() -> Self {
        Self {
            narrow: false,
            front_side: Side::Right,
            palette: None,
            shortcuts_open: false,
            start_page_open: false,
            messages_open: false,
            viewport_px: [0, 0],
            pixels_per_point: 1.0,
            viewport_focused: false,
        }
    }
}
