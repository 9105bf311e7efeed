//! Selected, hidden and hovered parts of the tree and the picture.

use crate::app::state::hidden_nodes::HiddenNodes;
use crate::app::state::second_tree::TreeSide;
use crate::app::state::state_line::SharedNodes;
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

/// The nodes of the second tree that are lit up. Nodes of both trees with the same triangles are lit up together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SecondNodes {
    /// The hovered node.
    pub hovered: Option<u32>,
    /// The selected node.
    pub selected: Option<u32>,
    /// The node of the first tree that was selected with it; another one there has been chosen since.
    pub with: Option<u32>,
}

/// What the user points at.
#[derive(Debug, Clone, Default)]
pub struct SelectionState {
    /// Nodes that the overlay highlights or omits.
    pub nodes: Selection,
    /// The same of the second tree.
    pub second: SecondNodes,
    /// The tree in which the selected node was chosen: keys walk through this one.
    pub side: TreeSide,
    /// The node at which the pointer is in a view other than the picture, in this UI frame.
    pub pointed: Option<u32>,
    /// The same in the UI frame before.
    pub pointed_before: Option<u32>,
    /// The selected triangle.
    pub picked: Option<PickedTriangle>,
    /// The pixel under the pointer.
    pub hover: Option<HoveredPixel>,
    /// Selected and hidden nodes of a pasted state, applied when its tree is ready.
    pub pasted: Option<SharedNodes>,
    /// The hidden and isolated nodes of `nodes` for other trees of the same scene; up to date at the end of each UI frame.
    pub hidden: HiddenNodes,
    /// Number of hidden nodes of which the user was last told that the present tree lacks them.
    pub reported_missing: usize,
}

impl SelectionState {
    /// Lights `node` up in all views, because the pointer is at it in one of them.
    pub const fn point_at(&mut self, node: u32) {
        self.pointed = Some(node);
        self.nodes.hovered = Some(node);
    }

    /// Selects nothing.
    pub fn clear(&mut self) {
        (self.picked, self.nodes.selected) = (None, None);
        (self.second, self.side) = (SecondNodes::default(), TreeSide::A);
    }

    /// Whether anything is selected.
    pub const fn is_some(&self) -> bool {
        self.nodes.selected.is_some() || self.second.selected.is_some() || self.picked.is_some()
    }

    /// Shows all nodes.
    pub fn show_all(&mut self) {
        self.nodes.hidden.clear();
        self.nodes.isolated = None;
        self.nodes.only = None;
        self.hidden = HiddenNodes::default();
    }
}
