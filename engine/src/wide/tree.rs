//! The tree that pictures are traced with: up to eight children a node and four triangles a block, tested side by side. Made
//! from the binary tree, whose hits it gives exactly.

use bytemuck::{Pod, Zeroable};

use crate::geometry::{Aabb, Sphere};
use crate::kernel::prefetch;
use crate::wide::block::TriangleBlock;
use crate::wide::bounds::WideContainer;
use crate::wide::layout::WIDTH;

/// Where a child is: another node, or the first block of a leaf.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Child(pub(crate) u32);

impl Child {
    /// Marks leaves.
    pub(crate) const LEAF: u32 = 1 << 31;
    /// The first node.
    pub(crate) const ROOT: Self = Self(0);

    pub(crate) fn node(index: usize) -> Self {
        Self(index as u32)
    }

    pub(crate) fn leaf(first_block: usize) -> Self {
        Self(first_block as u32 | Self::LEAF)
    }

    /// Whether it is a leaf.
    #[inline(always)]
    pub fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// The index of the node or of the leaf's first block.
    #[inline(always)]
    pub fn index(self) -> usize {
        (self.0 & !Self::LEAF) as usize
    }
}

/// A node: the containers of its children, lane by lane, and where they are. Lanes without child hold a container that
/// nothing enters.
#[derive(Debug, Clone, Copy, PartialEq, Zeroable)]
#[repr(C, align(32))]
pub struct WideNode<B> {
    /// The children's containers.
    pub bounds: B,
    /// The children.
    pub children: [Child; WIDTH],
}

/// A hierarchy of wide nodes over triangle blocks.
#[derive(Debug, Clone, PartialEq)]
pub struct WideTree<C: WideContainer> {
    /// Where rays begin; `None` for a tree without primitives.
    pub root: Option<Child>,
    /// All nodes; a parent comes before its children.
    pub nodes: Vec<WideNode<C::Bounds>>,
    /// The triangles, leaf by leaf.
    pub blocks: Vec<TriangleBlock>,
}

impl<C: WideContainer> WideTree<C> {
    /// Has a child fetched, which need not exist.
    #[inline(always)]
    pub(crate) fn prefetch(&self, child: Child) {
        if child.is_leaf() {
            prefetch::prefetch(&self.blocks, child.index());
        } else {
            prefetch::prefetch(&self.nodes, child.index());
        }
    }

    /// [`WideTree::prefetch`] without a branch.
    #[inline(always)]
    pub(crate) fn prefetch_any(&self, child: Child) {
        let list = usize::from(child.is_leaf());
        let address = [self.nodes.as_ptr().cast::<u8>(), self.blocks.as_ptr().cast()][list];
        let size = [size_of::<WideNode<C::Bounds>>(), size_of::<TriangleBlock>()][list];
        prefetch::prefetch_four_lines(address.wrapping_add(child.index() * size), size);
    }

    /// Bytes of nodes.
    pub fn node_bytes(&self) -> usize {
        size_of_val(&self.nodes[..])
    }

    /// Bytes of triangles.
    pub fn block_bytes(&self) -> usize {
        size_of_val(&self.blocks[..])
    }
}

/// A wide tree of either container.
#[derive(Debug, Clone, PartialEq)]
pub enum AnyWideTree {
    /// Of boxes.
    Aabb(WideTree<Aabb>),
    /// Of spheres.
    Sphere(WideTree<Sphere>),
}

/// Runs the same code for either kind of wide tree: `with_wide_tree!(any, tree => expression)`.
#[macro_export]
macro_rules! with_wide_tree {
    ($any:expr, $tree:ident => $body:expr) => {
        match $any {
            $crate::wide::AnyWideTree::Aabb($tree) => $body,
            $crate::wide::AnyWideTree::Sphere($tree) => $body,
        }
    };
}

impl From<WideTree<Aabb>> for AnyWideTree {
    fn from(tree: WideTree<Aabb>) -> Self {
        Self::Aabb(tree)
    }
}

impl From<WideTree<Sphere>> for AnyWideTree {
    fn from(tree: WideTree<Sphere>) -> Self {
        Self::Sphere(tree)
    }
}

impl AnyWideTree {
    /// Bytes of nodes.
    pub fn node_bytes(&self) -> usize {
        with_wide_tree!(self, tree => tree.node_bytes())
    }

    /// Bytes of triangles.
    pub fn triangle_bytes(&self) -> usize {
        with_wide_tree!(self, tree => tree.block_bytes())
    }
}
