//! Nodes into what the overlay draws: pure, no GPU.

use std::collections::HashSet;
use std::ops::Range;

use super::OverlaySettings;
use crate::accel::Accel;

/// A node as the shader reads it. 64 bytes, in depth order; the WGSL struct has the same layout.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct OverlayNode {
    /// Corner of the box with the smallest coordinates.
    pub box_min: [f32; 3],
    /// Depth in the tree, root 0.
    pub depth: u32,
    /// Corner of the box with the largest coordinates.
    pub box_max: [f32; 3],
    /// Primitives below.
    pub primitives: u32,
    /// Middle of the sphere.
    pub sphere_center: [f32; 3],
    /// Radius of the sphere.
    pub sphere_radius: f32,
    /// Index of the node in the tree.
    pub node: u32,
    /// Bit 0: leaf.
    pub flags: u32,
    /// Surface area over the root's, 0 to 1, of the container that the tree is made of.
    pub area_share: f32,
    /// Overlap with the sibling as a share of its own area, 0 to 1.
    pub overlap: f32,
}

/// Every node of one tree, in depth order, uploaded once.
#[derive(Debug)]
pub struct NodeTable {
    /// All nodes: the root, then depth 1, and so on; within a depth the largest first, so that a budget takes a prefix.
    pub nodes: Vec<OverlayNode>,
    /// For each depth its run in `nodes`.
    pub depth_ranges: Vec<Range<u32>>,
    /// For each node of the tree its position in `nodes`.
    pub position_of: Vec<u32>,
    /// For each node of the tree its parent; the root's is itself.
    pub parents: Vec<u32>,
    /// For each node of the tree its first child (the other follows it); `u32::MAX` for a leaf.
    pub first_children: Vec<u32>,
    /// Unique for each table, to tell whether it has been uploaded.
    pub id: u64,
}

/// Nodes that stand out.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Selection {
    /// The selected node of the tree, drawn thick and warm with its children in two tints.
    pub selected: Option<u32>,
    /// The hovered node, drawn white.
    pub hovered: Option<u32>,
    /// Nodes that are not drawn.
    pub hidden: HashSet<u32>,
}

/// What is drawn of a table: positions in [`NodeTable::nodes`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shown {
    /// Positions, at most `budget` of them.
    pub positions: Vec<u32>,
    /// How many the chosen depths and filters hold; more than `positions` where the budget cut them.
    pub wanted: usize,
}

impl NodeTable {
    /// Lists the nodes of `accel` with both containers: the tree's own, and the other kind fitted around the same
    /// triangles (boxes exactly; spheres merged bottom-up).
    pub fn new(_accel: &Accel) -> Self {
        todo!("overlay")
    }

    /// What `settings` choose, with hidden nodes left out. The selected and hovered node are not part of it: they are
    /// drawn on their own.
    pub fn shown(&self, _settings: &OverlaySettings, _selection: &Selection) -> Shown {
        todo!("overlay")
    }
}
