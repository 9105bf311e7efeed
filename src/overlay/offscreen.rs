//! The same overlay without a window.

use super::DrawInput;

/// Why nothing could be drawn.
#[derive(Debug, thiserror::Error)]
pub enum OffscreenError {
    /// No Vulkan or GL driver; the text says what to install.
    #[error("{0}")]
    NoAdapter(String),
    /// The driver failed.
    #[error("drawing the overlay failed: {0}")]
    Device(String),
}

/// Draws picture and overlay into a new picture of the picture's size, sRGB bytes row by row.
pub fn draw_offscreen(_input: &DrawInput<'_>) -> Result<Vec<[u8; 4]>, OffscreenError> {
    todo!("overlay")
}
