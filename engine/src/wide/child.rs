//! References to the children of wide nodes.

use bytemuck::{Pod, Zeroable};

/// A range of triangles in leaf order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct LeafRange {
    /// Slot of the first.
    pub(crate) first: u32,
    pub(crate) count: u32,
}

/// Reference to a child: the index of a node, or the triangles of a leaf.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Child(pub(crate) u32);

impl Child {
    /// Bit that marks a leaf. Below it are [`Child::COUNT_BITS`] bits for its number of triangles less one, and the slot of the
    /// first.
    pub(crate) const LEAF: u32 = 1 << 31;
    /// Bit that marks a compact node.
    const COMPACT: u32 = 1 << 30;
    const COUNT_BITS: u32 = 4;
    const SLOT_BITS: u32 = 31 - Self::COUNT_BITS;
    /// Instead of a number of triangles: what follows is an index in [`Leaves::long`](crate::wide::leaves::Leaves).
    const LONG: u32 = (1 << Self::COUNT_BITS) - 1;
    /// The first node, which is not compact.
    pub(crate) const ROOT: Self = Self(0);

    /// A node in the list of full or in that of compact ones.
    pub(crate) fn node(index: usize, is_compact: bool) -> Self {
        Self(index as u32 | if is_compact { Self::COMPACT } else { 0 })
    }

    /// The node `count` places behind this one, which is a node too, in the same list.
    pub(crate) fn node_after(self, count: usize) -> Self {
        Self(self.0 + count as u32)
    }

    /// The leaf of the triangles in `range`; `None` where it has too many or they come too late in the list.
    #[inline(always)]
    pub(crate) fn leaf(range: LeafRange) -> Option<Self> {
        let LeafRange { first, count } = range;
        let fits = first >> Self::SLOT_BITS == 0 && (1..=Self::LONG).contains(&count);
        fits.then(|| Self(Self::LEAF | (count - 1) << Self::SLOT_BITS | first))
    }

    /// The leaf of [`Leaves::long`](crate::wide::leaves::Leaves) with the given index.
    pub(crate) fn long_leaf(index: usize) -> Self {
        Self(Self::LEAF | Self::LONG << Self::SLOT_BITS | index as u32)
    }

    /// The triangles of a leaf; `None` for one of [`Leaves::long`](crate::wide::leaves::Leaves).
    #[inline(always)]
    pub(crate) fn short_leaf(self) -> Option<LeafRange> {
        let count = self.0 >> Self::SLOT_BITS & Self::LONG;
        (count != Self::LONG).then(|| LeafRange { first: self.index() as u32, count: count + 1 })
    }

    /// The reference as one number, passed to a [`Probe`](crate::tree::traverse::Probe) for nodes and leaves.
    #[inline(always)]
    pub fn bits(self) -> u32 {
        self.0
    }

    /// The reference whose [`Child::bits`] these are.
    pub const fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    /// Whether the child is a leaf.
    #[inline(always)]
    pub fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// Whether the child is a node with compact containers.
    #[inline(always)]
    pub fn is_compact(self) -> bool {
        self.0 & (Self::LEAF | Self::COMPACT) == Self::COMPACT
    }

    /// Index of the node among those of its form, or the slot of the leaf's first triangle, or its index in
    /// [`Leaves::long`](crate::wide::leaves::Leaves).
    #[inline(always)]
    pub const fn index(self) -> usize {
        let is_leaf = self.0 >> 31;
        (self.0 & (u32::MAX >> (2 + (Self::COUNT_BITS - 1) * is_leaf))) as usize
    }
}
