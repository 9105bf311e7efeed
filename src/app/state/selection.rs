//! Selected, hidden and hovered parts of the tree and the picture.

use std::sync::Arc;

use crate::accel::Accel;
use crate::app::state::second_tree::TreeSide;
use crate::app::state::state_line::SharedNodes;
use crate::overlay::Selection;
use crate::visibility::{NodeIdentity, TriangleSet};

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

/// The selected node and triangle.
#[derive(Debug, Clone, Default)]
pub struct Chosen {
    node: Option<u32>,
    picked: Option<PickedTriangle>,
    second: SecondNodes,
    side: TreeSide,
}

/// Nodes, triangle and pixel that the user points at.
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
    /// How many missing hidden nodes were last reported to the user.
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

    /// The part of it that undo restores.
    pub fn chosen(&self) -> Chosen {
        Chosen { node: self.nodes.selected, picked: self.picked.clone(), second: self.second, side: self.side }
    }

    /// Selects what was selected before in the same tree.
    pub fn choose(&mut self, chosen: Chosen) {
        let Chosen { node, picked, second, side } = chosen;
        (self.nodes.selected, self.picked, self.second, self.side) = (node, picked, second, side);
    }

    /// Shows all nodes.
    pub fn show_all(&mut self) {
        self.nodes.hidden.clear();
        self.nodes.isolated = None;
        self.nodes.only = None;
        self.hidden = HiddenNodes::default();
    }
}

/// The nodes that the user has hidden, and the isolated one. Those that the present tree lacks are kept, so that they are hidden
/// again in the next tree that has them.
#[derive(Debug, Clone, Default)]
pub struct HiddenNodes {
    hidden: Vec<HiddenNode>,
    isolated: Option<HiddenNode>,
    /// The triangles that are shown alone.
    only: Option<Arc<TriangleSet>>,
}

#[derive(Debug, Clone, Copy)]
struct HiddenNode {
    identity: NodeIdentity,
    /// Its index in the present tree, if that has it.
    node: Option<u32>,
}

impl HiddenNodes {
    /// Adopts what is hidden and isolated in `accel`, the tree of the last [`HiddenNodes::resolve`]. Where nodes were shown again,
    /// those that the tree lacks are forgotten.
    pub fn record(&mut self, accel: &Accel, nodes: &Selection) {
        let Selection { hidden, isolated, only, .. } = nodes;
        self.only.clone_from(only);
        let shown_again = |entry: &HiddenNode| entry.node.is_some_and(|node| !hidden.contains(&node));
        let isolated_before = self.isolated.and_then(|entry| entry.node);
        if self.hidden.iter().any(shown_again) || isolated_before != *isolated {
            self.hidden.retain(|entry| entry.node.is_some_and(|node| hidden.contains(&node)));
            self.isolated = None;
        }
        let find = |node: u32| Some(HiddenNode { identity: NodeIdentity::of(accel, node)?, node: Some(node) });
        if let Some(node) = isolated.filter(|&node| self.isolated.and_then(|entry| entry.node) != Some(node)) {
            self.isolated = find(node);
        }
        if self.hidden.iter().filter(|entry| entry.node.is_some()).count() < hidden.len() {
            let mut new: Vec<u32> = hidden.iter().copied().collect();
            new.retain(|&node| self.hidden.iter().all(|entry| entry.node != Some(node)));
            new.sort_unstable();
            self.hidden.extend(new.into_iter().filter_map(find));
        }
    }

    /// Hides and isolates in `nodes` those that `accel` has; all others are shown.
    pub fn resolve(&mut self, accel: &Accel, nodes: &mut Selection) {
        for entry in self.hidden.iter_mut().chain(&mut self.isolated) {
            entry.node = entry.identity.find(accel);
        }
        nodes.hidden = self.hidden.iter().filter_map(|entry| entry.node).collect();
        nodes.isolated = self.isolated.and_then(|entry| entry.node);
        nodes.only.clone_from(&self.only);
    }

    /// Number of nodes that the tree of the last [`HiddenNodes::resolve`] lacks.
    pub fn missing(&self) -> usize {
        self.hidden.iter().chain(&self.isolated).filter(|entry| entry.node.is_none()).count()
    }

    /// Whether nothing is hidden or isolated.
    pub const fn is_empty(&self) -> bool {
        self.hidden.is_empty() && self.isolated.is_none() && self.only.is_none()
    }
}

/// Equal where the same nodes are hidden, in whichever tree and order.
impl PartialEq for HiddenNodes {
    fn eq(&self, other: &Self) -> bool {
        let identity = |entry: &Option<HiddenNode>| entry.map(|entry| entry.identity);
        let holds = |entry: &HiddenNode| other.hidden.iter().any(|theirs| theirs.identity == entry.identity);
        self.hidden.len() == other.hidden.len()
            && identity(&self.isolated) == identity(&other.isolated)
            && self.only == other.only
            && self.hidden.iter().all(holds)
    }
}
