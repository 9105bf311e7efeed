//! Nodes as the shaders read them.

use super::{NodeTable, Selection};

/// A node as the shaders read it, one instance of 64 bytes; `Node` in `line.wgsl` has the same layout.
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
    /// Bit 0: leaf. Bits 8 to 10: [`Role`].
    pub flags: u32,
    /// Surface area over the root's, 0 to 1, of the container that the tree is made of.
    pub area_share: f32,
    /// Overlap with the sibling as a share of its own area, 0 to 1.
    pub overlap: f32,
}

/// Why a node is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Role {
    /// The settings chose it.
    Shown = 0,
    /// It is the selected one.
    Selected = 1,
    /// It is the selected one's first child.
    FirstChild = 2,
    /// It is the selected one's second child.
    SecondChild = 3,
    /// The pointer is over it.
    Hovered = 4,
}

impl OverlayNode {
    /// Why it is drawn.
    pub fn role(&self) -> u32 {
        self.flags >> 8 & 7
    }
}

/// The nodes that stand out, drawn over all others, also where depth or budget leave them out: the selected one's children,
/// itself, the hovered one.
pub fn highlighted(table: &NodeTable, selection: &Selection) -> Vec<(u32, Role)> {
    let exists = |node: &u32| (*node as usize) < table.len();
    let mut marked = Vec::new();
    if let Some(node) = selection.selected.filter(exists) {
        if let Some([first, second]) = table.children(node) {
            marked.push((first, Role::FirstChild));
            marked.push((second, Role::SecondChild));
        }
        marked.push((node, Role::Selected));
    }
    if let Some(node) = selection.hovered.filter(exists)
        && selection.selected != Some(node)
    {
        marked.push((node, Role::Hovered));
    }
    marked
}
