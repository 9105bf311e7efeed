//! The trees that packets go through. Those of 14-DOPs count as trees of boxes: along a diagonal the directions of a packet often have
//! both signs, for which there is no interval.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::Simd;

use crate::geometry::{Aabb, Dop14};
use crate::wide::bounds::WideContainer;
use crate::wide::box_lanes::BoxLanes;
use crate::wide::child::Child;
use crate::wide::layout::WIDTH;
use crate::wide::leaves::Leaves;
use crate::wide::trace::beam::BeamContainer;
use crate::wide::tree::WideTree;

/// Containers and children of a node.
type Lanes<'a, C> = (&'a <C as WideContainer>::Bounds, &'a [Child; WIDTH]);

/// A wide tree with containers of type `C` for packets.
pub(crate) trait PacketTree<'a, C: BeamContainer>: Copy {
    /// The root; `None` for a tree without primitives.
    fn root(self) -> Option<Child>;
    /// The triangles of the leaves.
    fn leaves(self) -> &'a Leaves;
    /// Containers and children of a node; `space` is where containers can be put.
    fn unpack<'s, S: Simd>(self, simd: S, node: Child, space: &'s mut Option<C::Bounds>) -> Lanes<'s, C>
    where
        'a: 's;
    /// Prefetches a child.
    fn prefetch(self, child: Child);
}

impl<'a, C: BeamContainer> PacketTree<'a, C> for &'a WideTree<C> {
    #[inline(always)]
    fn root(self) -> Option<Child> {
        self.root
    }

    #[inline(always)]
    fn leaves(self) -> &'a Leaves {
        &self.leaves
    }

    #[inline(always)]
    fn unpack<'s, S: Simd>(self, simd: S, node: Child, space: &'s mut Option<C::Bounds>) -> Lanes<'s, C>
    where
        'a: 's,
    {
        self.node(node).unpack(simd, space)
    }

    #[inline(always)]
    fn prefetch(self, child: Child) {
        WideTree::prefetch(self, child);
    }
}

/// A tree with boxes: one type for both kinds, so that packets are compiled once for them.
#[derive(Clone, Copy)]
pub(crate) enum BoxTree<'a> {
    Aabb(&'a WideTree<Aabb>),
    Dop14(&'a WideTree<Dop14>),
}

impl<'a> PacketTree<'a, Aabb> for BoxTree<'a> {
    #[inline(always)]
    fn root(self) -> Option<Child> {
        match self {
            Self::Aabb(tree) => tree.root,
            Self::Dop14(tree) => tree.root,
        }
    }

    #[inline(always)]
    fn leaves(self) -> &'a Leaves {
        match self {
            Self::Aabb(tree) => &tree.leaves,
            Self::Dop14(tree) => &tree.leaves,
        }
    }

    #[inline(always)]
    fn unpack<'s, S: Simd>(self, simd: S, node: Child, space: &'s mut Option<BoxLanes>) -> Lanes<'s, Aabb>
    where
        'a: 's,
    {
        match self {
            Self::Aabb(tree) => tree.node(node).unpack(simd, space),
            Self::Dop14(tree) => {
                let node = &tree.nodes[node.index()];
                (&node.bounds.boxes, &node.children)
            }
        }
    }

    #[inline(always)]
    fn prefetch(self, child: Child) {
        match self {
            Self::Aabb(tree) => tree.prefetch(child),
            Self::Dop14(tree) => tree.prefetch(child),
        }
    }
}
