//! Layouts by their axes, and the bytes of their nodes.

use crate::wide::layout::VALUES;

/// Most children of a node.
pub const MAX_CHILDREN: u32 = 16;
/// Largest limit on the triangles of a leaf.
pub const MAX_LEAF: u32 = 32;
/// Bytes of a triangle in a leaf: three corners and an index.
pub const TRIANGLE_BYTES: usize = size_of::<[f32; VALUES]>();

/// Bytes of a reference to a child: the index of a node, or the range of a leaf.
const REFERENCE_BYTES: usize = 4;
/// Bytes that the boxes of a node share where they are quantised: the corner that they count from, the exponent of the step on each
/// axis, and the number of children.
const GRID_BYTES: usize = 3 * 4 + 3 + 1;
/// Planes of a box.
const PLANES: usize = 6;
/// Bytes that a processor reads at once, of which a node is a multiple: the width of the vectors of GPUs and of SSE.
const ALIGNMENT: usize = 16;

/// How the children of a node are chosen from the binary tree, and which of its nodes become leaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Collapse {
    /// Again and again the child of the largest surface area is replaced by its own two (Wald, Benthin, Boulos: *Getting Rid of Packets*,
    /// 2008). Leaves are joined where that lowers the surface area heuristic's cost of the binary tree.
    Greedy,
    /// The least cost by the surface area heuristic, by dynamic programming (Ylitie, Karras, Laine: *Efficient Incoherent Ray Traversal on
    /// GPUs Through Compressed Wide BVHs*, 2017, section 3).
    Optimal,
    /// The fewest bytes that a random line reads, by the same programme: the memory SAH as a cost (Haydel, Kensler, Brunvand, Yuksel:
    /// *Merged Nodes*, HPG 2026), without nodes that are shared.
    Memory,
    /// [`Collapse::Optimal`] with measured visits of the binary nodes in place of their areas.
    Visits,
}

impl Collapse {
    /// All, in the order of tables.
    pub const ALL: [Self; 4] = [Self::Greedy, Self::Optimal, Self::Memory, Self::Visits];

    /// The name on the command line and in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Greedy => "greedy",
            Self::Optimal => "optimal",
            Self::Memory => "memory",
            Self::Visits => "visits",
        }
    }
}

/// How the planes of the children's boxes are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Planes {
    /// As they are.
    F32,
    /// As multiples, of 16 bits, of a step on each axis from the lowest corner of the children, rounded outwards.
    Bits16,
    /// The same with 8 bits (Ylitie, Karras, Laine 2017, section 2.1).
    Bits8,
}

impl Planes {
    /// All, in the order of tables.
    pub const ALL: [Self; 3] = [Self::F32, Self::Bits16, Self::Bits8];

    /// The name on the command line and in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::Bits16 => "16",
            Self::Bits8 => "8",
        }
    }

    /// Bits of a quantised plane; `None` where planes are stored as they are.
    pub const fn bits(self) -> Option<u32> {
        match self {
            Self::F32 => None,
            Self::Bits16 => Some(16),
            Self::Bits8 => Some(8),
        }
    }
}

/// A layout of wide trees.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Layout {
    /// Most children of a node, 2 to [`MAX_CHILDREN`].
    pub children: u32,
    /// How they are chosen.
    pub collapse: Collapse,
    /// How their boxes are stored.
    pub planes: Planes,
    /// Most triangles of a leaf, 1 to [`MAX_LEAF`]. Leaves of the binary tree that have more stay as they are.
    pub leaf_size: u32,
}

impl Layout {
    /// Bytes of a node: the planes of all children that it has room for, what they share, and a reference to each, up to a multiple of 16.
    /// With eight children as of the engine's own nodes, 224 as they are and 96 of eight bits.
    pub const fn node_bytes(&self) -> usize {
        let children = self.children as usize;
        let boxes = match self.planes.bits() {
            None => children * PLANES * size_of::<f32>(),
            Some(bits) => GRID_BYTES + children * PLANES * bits as usize / 8,
        };
        (boxes + children * REFERENCE_BYTES).next_multiple_of(ALIGNMENT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Aabb;
    use crate::wide::{WideContainer, WideNode};

    #[test]
    fn nodes_take_planes_grid_and_references() {
        let bytes =
            |children, planes| Layout { children, collapse: Collapse::Optimal, planes, leaf_size: 4 }.node_bytes();
        assert_eq!([2, 4, 8, 16].map(|children| bytes(children, Planes::F32)), [64, 112, 224, 448]);
        assert_eq!([2, 4, 8, 16].map(|children| bytes(children, Planes::Bits16)), [48, 80, 144, 272]);
        assert_eq!([2, 4, 8, 16].map(|children| bytes(children, Planes::Bits8)), [48, 64, 96, 176]);
        assert_eq!(bytes(8, Planes::F32), size_of::<WideNode<<Aabb as WideContainer>::Bounds>>());
        assert_eq!(bytes(8, Planes::Bits8), size_of::<WideNode<<Aabb as WideContainer>::Compact>>());
    }
}
