//! Layout of the wide tree.

use bytemuck::Zeroable;

use crate::kernel::prefetch;
use crate::wide::bounds::{NodeBounds, SphereLanes};
use crate::wide::box_lanes::BoxLanes;
use crate::wide::child::Child;
use crate::wide::compact::CompactBoxes;
use crate::wide::layout::{VALUES, WIDTH};
use crate::wide::leaves::Leaves;

/// A node with up to eight children. `B` holds their containers, one per lane; unused lanes hold an empty container,
/// which no ray enters.
#[derive(Debug, Clone, Copy, PartialEq, Zeroable)]
#[repr(C, align(32))]
pub struct WideNode<B> {
    /// Containers of the children, one per lane.
    pub bounds: B,
    /// The children, one per lane: nodes by ascending surface area, then leaves likewise, so that the last one is the likeliest to be
    /// hit at the least cost.
    pub children: [Child; WIDTH],
}

/// A bounding volume hierarchy of wide nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct WideTree<B: NodeBounds> {
    /// The root; `None` for a tree without primitives.
    pub root: Option<Child>,
    /// All nodes; parents precede their children.
    pub nodes: Vec<WideNode<B>>,
    /// The triangles of the leaves.
    pub leaves: Leaves,
}

impl<B: NodeBounds> WideTree<B> {
    /// Prefetches a child, which need not exist.
    #[inline(always)]
    pub(crate) fn prefetch(&self, child: Child) {
        if child.is_leaf() {
            self.leaves.prefetch(child);
        } else {
            prefetch::prefetch(&self.nodes, child.index());
        }
    }

    /// [`WideTree::prefetch`] without a branch.
    #[inline(always)]
    pub(crate) fn prefetch_any(&self, child: Child) {
        let list = usize::from(child.is_leaf());
        let address = [self.nodes.as_ptr().cast::<u8>(), self.leaves.values.as_ptr().cast()][list];
        let size = [size_of::<WideNode<B>>(), size_of::<[f32; VALUES]>()][list];
        // A block of 160 bytes, which begins anywhere in a line, lies in three or four.
        let bytes = size_of::<WideNode<B>>().max(160);
        prefetch::prefetch_four_lines(address.wrapping_add(child.index() * size), bytes);
    }

    /// The children of the node `index`; none for an index beyond the nodes.
    pub fn children_of(&self, index: usize) -> impl Iterator<Item = Child> {
        // Unused lanes come last and refer to the root, which is nobody's child.
        let lanes = self.nodes.get(index).map_or(&[][..], |node| &node.children);
        lanes.iter().copied().take_while(|child| *child != Child::ROOT)
    }

    /// Size of the nodes in bytes.
    pub fn node_bytes(&self) -> usize {
        size_of_val(&self.nodes[..])
    }

    /// Size of the leaves in bytes.
    pub fn leaf_bytes(&self) -> usize {
        self.leaves.bytes()
    }
}

/// A wide tree with either kind of container.
#[derive(Debug, Clone, PartialEq)]
pub enum AnyWideTree {
    /// A tree of boxes.
    Aabb(WideTree<BoxLanes>),
    /// A tree of boxes with compact nodes.
    Compact(WideTree<CompactBoxes>),
    /// A tree of spheres.
    Sphere(WideTree<SphereLanes>),
}

/// How the nodes of a wide tree of boxes store them. Hits are the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NodeForm {
    /// As they are: less work for each ray.
    Full,
    /// With planes of eight bits, rounded outwards: less memory. Slower where rays begin near faces of large boxes, as in San Miguel.
    Compact,
}

/// Evaluates an expression for the wide tree of either kind: `with_wide_tree!(any, tree => expression)`.
#[macro_export]
macro_rules! with_wide_tree {
    ($any:expr, $tree:ident => $body:expr) => {
        match $any {
            $crate::wide::AnyWideTree::Aabb($tree) => $body,
            $crate::wide::AnyWideTree::Compact($tree) => $body,
            $crate::wide::AnyWideTree::Sphere($tree) => $body,
        }
    };
}

impl AnyWideTree {
    /// Size of the nodes in bytes.
    pub fn node_bytes(&self) -> usize {
        with_wide_tree!(self, tree => tree.node_bytes())
    }

    /// Size of the leaves in bytes.
    pub fn leaf_bytes(&self) -> usize {
        with_wide_tree!(self, tree => tree.leaf_bytes())
    }
}
