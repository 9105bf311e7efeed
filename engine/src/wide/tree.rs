//! Layout of the wide tree.

use std::marker::PhantomData;

use bytemuck::Zeroable;
use fearless_simd::Simd;

use crate::geometry::{Aabb, Dop14, OrientedBox, Sphere};
use crate::kernel::prefetch;
use crate::wide::bounds::{CompactBounds, WideContainer};
use crate::wide::child::Child;
use crate::wide::layout::{COMPACT_TRIANGLES, VALUES, WIDTH};
use crate::wide::leaves::Leaves;

/// A node with up to eight children. `B` holds their containers, one per lane; unused lanes hold an empty container,
/// which no ray enters.
#[derive(Debug, Clone, Copy, PartialEq, Zeroable)]
#[repr(C, align(32))]
pub struct WideNode<B> {
    /// Containers of the children, one per lane.
    pub bounds: B,
    /// The children, one per lane, by rising estimate of hits per cost: rays that look for any hit visit the last one first.
    pub children: [Child; WIDTH],
}

/// A bounding volume hierarchy of wide nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct WideTree<C: WideContainer> {
    /// The root; `None` for a tree without primitives.
    pub root: Option<Child>,
    /// The nodes that hold containers as they are; parents precede their children.
    pub nodes: Vec<WideNode<C::Bounds>>,
    /// The nodes that hold them in less memory, see [`NodeForm::Compact`]; parents precede their children.
    pub compact_nodes: Vec<WideNode<C::Compact>>,
    /// The triangles of the leaves.
    pub leaves: Leaves,
}

/// A node in either form.
#[derive(Debug)]
pub enum NodeRef<'a, C: WideContainer> {
    /// With containers as they are.
    Full(&'a WideNode<C::Bounds>),
    /// With containers in less memory.
    Compact(&'a WideNode<C::Compact>),
}

impl<'a, C: WideContainer> NodeRef<'a, C> {
    /// The lanes for children, of which the used ones come first.
    #[inline(always)]
    pub(crate) fn lanes(self) -> &'a [Child; WIDTH] {
        match self {
            Self::Full(node) => &node.children,
            Self::Compact(node) => &node.children,
        }
    }

    /// The containers as rays are tested against them, and the children; `space` is where containers can be put.
    #[inline(always)]
    pub(crate) fn unpack<S: Simd>(
        self,
        simd: S,
        space: &'a mut Option<C::Bounds>,
    ) -> (&'a C::Bounds, &'a [Child; WIDTH]) {
        match self {
            Self::Full(node) => (&node.bounds, &node.children),
            Self::Compact(node) => (space.insert(node.bounds.unpack(simd)), &node.children),
        }
    }

    /// The container in a lane: that which was stored, or in a compact node one that encloses it.
    pub fn load(&self, lane: usize) -> C {
        match self {
            Self::Full(node) => C::load(&node.bounds, lane),
            Self::Compact(node) => node.bounds.load(lane),
        }
    }

    /// True if a lane may hold `container`; rounding can give false positives.
    pub fn holds(&self, lane: usize, container: &C) -> bool {
        match self {
            Self::Full(node) => C::load(&node.bounds, lane) == *container,
            Self::Compact(node) => node.bounds.holds(lane, container),
        }
    }

    /// [`NodeRef::load`], in a compact node no more than lies within the node's own container.
    pub fn load_within(&self, lane: usize, own: &C) -> C {
        match self {
            Self::Full(_) => self.load(lane),
            Self::Compact(_) => self.load(lane).intersection_bounds(own),
        }
    }
}

/// The memory that children refer to.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Addresses<C> {
    leaves: *const u8,
    /// Addresses of the first node or leaf, by the two highest bits of a [`Child`].
    first: [usize; 4],
    tree: PhantomData<C>,
}

impl<C: WideContainer> Addresses<C> {
    /// Size of a node, or of a triangle, and the bits of its index, by the two highest bits of a [`Child`].
    const SIZES: [(u32, u32); 4] = {
        let leaf = (size_of::<[f32; VALUES]>() as u32, Child::from_bits(u32::MAX).index() as u32);
        let index = Child::from_bits(u32::MAX >> 2).index() as u32;
        let compact = if C::HAS_COMPACT { size_of::<WideNode<C::Compact>>() } else { size_of::<WideNode<C::Bounds>>() };
        [(size_of::<WideNode<C::Bounds>>() as u32, index), (compact as u32, index), leaf, leaf]
    };

    /// Prefetches a child, which need not exist.
    #[inline(always)]
    pub(crate) fn prefetch(&self, child: Child) {
        let kind = child.bits() as usize >> 30;
        let (size, index) = Self::SIZES[kind];
        let address = self.first[kind].wrapping_add((child.bits() & index) as usize * size as usize);
        // A block takes 160 bytes.
        let bytes = size_of::<WideNode<C::Bounds>>().max(160);
        prefetch::prefetch_lines(self.leaves.with_addr(address), bytes);
    }
}

impl<C: WideContainer> WideTree<C> {
    /// The node that `child`, which must not be a leaf, refers to.
    ///
    /// # Panics
    ///
    /// If the tree has no such node.
    #[inline(always)]
    pub fn node(&self, child: Child) -> NodeRef<'_, C> {
        if C::HAS_COMPACT && child.is_compact() {
            NodeRef::Compact(&self.compact_nodes[child.index()])
        } else {
            NodeRef::Full(&self.nodes[child.index()])
        }
    }

    /// References to all nodes.
    pub fn all_nodes(&self) -> impl Iterator<Item = Child> + use<C> {
        let compact = (0..self.compact_nodes.len()).map(|index| Child::node(index, true));
        (0..self.nodes.len()).map(|index| Child::node(index, false)).chain(compact)
    }

    /// Prefetches a child, which need not exist.
    #[inline(always)]
    pub(crate) fn prefetch(&self, child: Child) {
        if child.is_leaf() {
            self.leaves.prefetch(child);
        } else if C::HAS_COMPACT && child.is_compact() {
            prefetch::prefetch(&self.compact_nodes, child.index());
        } else {
            prefetch::prefetch(&self.nodes, child.index());
        }
    }

    /// For [`WideTree::prefetch`] of many children without a branch on their kind.
    #[inline(always)]
    pub(crate) fn addresses(&self) -> Addresses<C> {
        let leaves: *const u8 = self.leaves.values.as_ptr().cast();
        let [full, compact] = [self.nodes.as_ptr().addr(), self.compact_nodes.as_ptr().addr()];
        let compact = if C::HAS_COMPACT { compact } else { full };
        Addresses { leaves, first: [full, compact, leaves.addr(), leaves.addr()], tree: PhantomData }
    }

    /// The children of the node `child`; none where it is a leaf.
    pub fn children_of(&self, child: Child) -> impl Iterator<Item = Child> {
        // Unused lanes come last and refer to the root, which is nobody's child.
        let lanes = if child.is_leaf() { &[][..] } else { self.node(child).lanes() };
        lanes.iter().copied().take_while(|child| *child != Child::ROOT)
    }

    /// Size of the nodes in bytes.
    pub fn node_bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.compact_nodes[..])
    }

    /// Size of the leaves in bytes.
    pub fn leaf_bytes(&self) -> usize {
        self.leaves.bytes()
    }
}

/// A wide tree with any kind of container.
#[derive(Debug, Clone, PartialEq)]
pub enum AnyWideTree {
    /// A tree of boxes.
    Aabb(WideTree<Aabb>),
    /// A tree of spheres.
    Sphere(WideTree<Sphere>),
    /// A tree of polytopes.
    Dop14(WideTree<Dop14>),
    /// A tree of oriented boxes.
    Oriented(WideTree<OrientedBox>),
}

/// How the nodes of a wide tree of boxes store them. Hits are the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NodeForm {
    /// As they are.
    Full,
    /// The many small nodes at the bottom with planes of eight bits, rounded outwards: a seventh less memory for the whole tree. In a
    /// large box such steps are long, and many rays pass it: nodes above [`COMPACT_AREA`](super::layout::COMPACT_AREA) are full.
    Compact,
}

impl NodeForm {
    /// The form that is chosen for a number of triangles, see [`COMPACT_TRIANGLES`].
    pub fn for_triangles(count: usize) -> Self {
        if count < COMPACT_TRIANGLES { Self::Full } else { Self::Compact }
    }
}

/// Evaluates an expression for the wide tree of any kind: `with_wide_tree!(any, tree => expression)`.
#[macro_export]
macro_rules! with_wide_tree {
    ($any:expr, $tree:ident => $body:expr) => {
        match $any {
            $crate::wide::AnyWideTree::Aabb($tree) => $body,
            $crate::wide::AnyWideTree::Sphere($tree) => $body,
            $crate::wide::AnyWideTree::Dop14($tree) => $body,
            $crate::wide::AnyWideTree::Oriented($tree) => $body,
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
