//! What becomes of each node of the binary tree: which are leaves of the wide one, and how many of a wide node's eight lanes each
//! child gets.

#![allow(clippy::inline_always, reason = "called from SIMD kernels, which must not leave their instructions")]

use bytemuck::{Pod, Zeroable};

use super::WIDTH;
use crate::bvh::Node;

/// What becomes of an interior node of the binary tree, and what it takes to go on from there without a look at nodes, of which
/// four times as few fit a line of the cache.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Choice {
    /// Its children.
    pub(super) links: [Link; 2],
    /// Slot of the first primitive below.
    pub(super) first: u32,
    /// Three bits for each number of lanes that it may take, one to eight: how many of them its left child gets, none where the
    /// node takes one lane as a whole. Above them the number of primitives of the leaf that it becomes, if it becomes one.
    pub(super) lanes: u32,
}

/// Bits for each number of lanes.
pub(super) const BITS: u32 = 3;
/// Where the number of primitives stands.
pub(super) const COUNT_SHIFT: u32 = BITS * WIDTH as u32;

impl Choice {
    /// Slot of the first primitive, and how many there are: none unless the node becomes a leaf.
    #[inline(always)]
    pub(super) fn leaf(self) -> (u32, u32) {
        (self.first, self.lanes >> COUNT_SHIFT)
    }

    /// Stands for a choice while others are made: says where in a list it is.
    pub(super) fn listed(place: usize) -> Self {
        Self { first: place as u32, lanes: u32::MAX, ..Self::zeroed() }
    }

    /// Where it is in a list.
    pub(super) fn place(self) -> Option<usize> {
        (self.lanes == u32::MAX).then_some(self.first as usize)
    }

    /// How many of `lanes`, one to eight, go to the left child; none where the node stays whole.
    #[inline(always)]
    pub(super) fn left_of(self, lanes: u32) -> u32 {
        self.lanes >> (BITS * (lanes - 1)) & 7
    }
}

/// The first child of an interior node, or the first slot of a leaf.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
#[repr(transparent)]
pub(super) struct Link(u32);

impl Link {
    const LEAF: u32 = 1 << 31;

    #[inline(always)]
    pub(super) fn new<C>(node: &Node<C>) -> Self {
        Self(if node.is_leaf() { node.first | Self::LEAF } else { node.first })
    }

    #[inline(always)]
    pub(super) fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// The first child or slot.
    #[inline(always)]
    pub(super) fn first(self) -> u32 {
        self.0 & !Self::LEAF
    }

    /// Where the choice of an interior node stands: pairs of siblings follow the root.
    #[inline(always)]
    pub(super) fn pair(self) -> usize {
        pair_of(self.0)
    }
}

/// Where the choice of the parent of the siblings `first` and the next one stands.
#[inline(always)]
pub(super) fn pair_of(first: u32) -> usize {
    (first as usize).wrapping_sub(1) / 2
}
