//! Layout of the wide tree.

use bytemuck::{Pod, Zeroable};

use crate::geometry::{Aabb, Sphere};
use crate::kernel::prefetch;
use crate::wide::block::TriangleBlock;
use crate::wide::bounds::WideContainer;
use crate::wide::layout::WIDTH;

/// Reference to a child: the index of a node, or of the first block of a leaf.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Child(pub(crate) u32);

impl Child {
    /// Bit that marks a leaf.
    pub(crate) const LEAF: u32 = 1 << 31;
    /// The first node.
    pub(crate) const ROOT: Self = Self(0);

    pub(crate) fn node(index: usize) -> Self {
        Self(index as u32)
    }

    pub(crate) fn leaf(first_block: usize) -> Self {
        Self(first_block as u32 | Self::LEAF)
    }

    /// The reference as one number, by which a [`Probe`](crate::tree::traverse::Probe) is told of nodes and leaves.
    #[inline(always)]
    pub fn bits(self) -> u32 {
        self.0
    }

    /// The reference whose [`Child::bits`] these are.
    pub fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    /// Whether the child is a leaf.
    #[inline(always)]
    pub fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// Index of the node, or of the first block of the leaf.
    #[inline(always)]
    pub fn index(self) -> usize {
        (self.0 & !Self::LEAF) as usize
    }
}

/// A node with up to eight children. `B` holds their containers, one per lane; unused lanes hold an empty container,
/// which no ray enters.
#[derive(Debug, Clone, Copy, PartialEq, Zeroable)]
#[repr(C, align(32))]
pub struct WideNode<B> {
    /// Containers of the children, one per lane.
    pub bounds: B,
    /// The children, one per lane.
    pub children: [Child; WIDTH],
}

/// A bounding volume hierarchy of wide nodes over triangle blocks.
#[derive(Debug, Clone, PartialEq)]
pub struct WideTree<C: WideContainer> {
    /// The root; `None` for a tree without primitives.
    pub root: Option<Child>,
    /// All nodes; parents precede their children.
    pub nodes: Vec<WideNode<C::Bounds>>,
    /// Triangle blocks, leaf by leaf.
    pub blocks: Vec<TriangleBlock>,
}

impl<C: WideContainer> WideTree<C> {
    /// Prefetches a child, which need not exist.
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

    /// The children of the node `index` with their containers; none for an index beyond the nodes.
    pub fn children_of(&self, index: usize) -> impl Iterator<Item = (Child, C)> {
        // Unused lanes come last and refer to the root, which is nobody's child.
        let used = |node: &WideNode<C::Bounds>| node.children.iter().take_while(|child| **child != Child::ROOT).count();
        let node = self.nodes.get(index);
        let lanes = 0..node.map_or(0, used);
        node.into_iter()
            .flat_map(move |node| lanes.clone().map(|lane| (node.children[lane], C::load(&node.bounds, lane))))
    }

    /// Size of the nodes in bytes.
    pub fn node_bytes(&self) -> usize {
        size_of_val(&self.nodes[..])
    }

    /// Size of the triangle blocks in bytes.
    pub fn block_bytes(&self) -> usize {
        size_of_val(&self.blocks[..])
    }
}

/// A wide tree with either kind of container.
#[derive(Debug, Clone, PartialEq)]
pub enum AnyWideTree {
    /// A tree of boxes.
    Aabb(WideTree<Aabb>),
    /// A tree of spheres.
    Sphere(WideTree<Sphere>),
}

/// Evaluates an expression for the wide tree of either kind: `with_wide_tree!(any, tree => expression)`.
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
    /// Size of the nodes in bytes.
    pub fn node_bytes(&self) -> usize {
        with_wide_tree!(self, tree => tree.node_bytes())
    }

    /// Size of the triangle blocks in bytes.
    pub fn triangle_bytes(&self) -> usize {
        with_wide_tree!(self, tree => tree.block_bytes())
    }
}
