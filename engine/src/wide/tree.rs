//! Layout of the wide tree.

use bytemuck::{Pod, Zeroable};

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::kernel::prefetch;
use crate::tree::AnyTree;
use crate::tree::binarize::binarize;
use crate::wide::bounds::{BoxLanes, NodeBounds, SphereLanes};
use crate::wide::collapse::collapse;
use crate::wide::compact::CompactBoxes;
use crate::wide::layout::WIDTH;
use crate::wide::leaves::{LeafRange, Leaves, VALUES};

/// Reference to a child: the index of a node, or the triangles of a leaf.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Child(pub(crate) u32);

impl Child {
    /// Bit that marks a leaf. Below it are [`Child::COUNT_BITS`] bits for its number of triangles less one, and the slot of the
    /// first.
    pub(crate) const LEAF: u32 = 1 << 31;
    const COUNT_BITS: u32 = 4;
    const SLOT_BITS: u32 = 31 - Self::COUNT_BITS;
    /// Instead of a number of triangles: what follows is an index in [`Leaves::long`].
    const LONG: u32 = (1 << Self::COUNT_BITS) - 1;
    /// The first node.
    pub(crate) const ROOT: Self = Self(0);

    pub(crate) fn node(index: usize) -> Self {
        Self(index as u32)
    }

    /// The leaf of the triangles in `range`; `None` where it has too many or they come too late in the list.
    #[inline(always)]
    pub(crate) fn leaf(range: LeafRange) -> Option<Self> {
        let LeafRange { first, count } = range;
        let fits = first >> Self::SLOT_BITS == 0 && (1..=Self::LONG).contains(&count);
        fits.then(|| Self(Self::LEAF | (count - 1) << Self::SLOT_BITS | first))
    }

    /// The leaf of [`Leaves::long`] with the given index.
    pub(crate) fn long_leaf(index: usize) -> Self {
        Self(Self::LEAF | Self::LONG << Self::SLOT_BITS | index as u32)
    }

    /// The triangles of a leaf; `None` for one of [`Leaves::long`].
    #[inline(always)]
    pub(crate) fn short_leaf(self) -> Option<LeafRange> {
        let count = self.0 >> Self::SLOT_BITS & Self::LONG;
        (count != Self::LONG).then(|| LeafRange { first: self.index() as u32, count: count + 1 })
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

    /// Index of the node, or the slot of the leaf's first triangle, or its index in [`Leaves::long`].
    #[inline(always)]
    pub fn index(self) -> usize {
        let is_leaf = self.0 >> 31;
        (self.0 & (u32::MAX >> (1 + Self::COUNT_BITS * is_leaf))) as usize
    }
}

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
    /// With planes of eight bits, rounded outwards: less memory.
    Compact,
}

impl NodeForm {
    /// Where trees no longer fit any cache, rays wait for memory.
    const COMPACT_FROM: usize = 2_000_000;

    /// The form with which rays are faster in a scene of so many triangles.
    pub fn for_triangles(count: usize) -> Self {
        if count < Self::COMPACT_FROM { Self::Full } else { Self::Compact }
    }
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
    /// The wide tree of a `tree` over `triangles`, see [`collapse`]; spheres have one form only. A tree that is not binary is made so
    /// before, see [`binarize`]: the wide tree has the same leaves or larger ones, but its own nodes above them.
    pub fn new(tree: &AnyTree, triangles: &[Triangle], form: NodeForm, token: &CancelToken) -> Result<Self, Cancelled> {
        Ok(match (tree, form) {
            (AnyTree::Aabb(tree), NodeForm::Full) => Self::Aabb(collapse(&*binarize(tree, token)?, triangles, token)?),
            (AnyTree::Aabb(tree), NodeForm::Compact) => {
                Self::Compact(collapse(&*binarize(tree, token)?, triangles, token)?)
            }
            (AnyTree::Sphere(tree), _) => Self::Sphere(collapse(&*binarize(tree, token)?, triangles, token)?),
        })
    }

    /// Size of the nodes in bytes.
    pub fn node_bytes(&self) -> usize {
        with_wide_tree!(self, tree => tree.node_bytes())
    }

    /// Size of the leaves in bytes.
    pub fn leaf_bytes(&self) -> usize {
        with_wide_tree!(self, tree => tree.leaf_bytes())
    }
}
