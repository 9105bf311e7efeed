//! Selected, hidden and hovered parts of the tree and the picture.

use crate::overlay::Selection;

/// The triangle that was clicked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PickedTriangle {
    /// Index of the triangle in the scene.
    pub primitive: u32,
    /// Indices of the nodes from the root to its leaf.
    pub path: Vec<u32>,
}

/// The pixel under the pointer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoveredPixel {
    /// Column in the picture at full resolution.
    pub x_px: u32,
    /// Row in the picture at full resolution.
    pub y_px: u32,
    /// The triangle it shows; `None` on the background.
    pub primitive: Option<u32>,
    /// Distance along the primary ray; infinity on the background.
    pub distance: f32,
    /// The value its colour stands for, in shading modes that have one.
    pub value: Option<f32>,
}

/// What the user points at.
#[derive(Debug, Clone, Default)]
pub struct SelectionState {
    /// Nodes that the overlay highlights or omits.
    pub nodes: Selection,
    /// The selected triangle.
    pub picked: Option<PickedTriangle>,
    /// The pixel under the pointer.
    pub hover: Option<HoveredPixel>,
}
