//! Decisions for the nodes of the binary tree: which become leaves of the wide tree, and how the eight lanes of a wide
//! node are distributed.

#![allow(clippy::inline_always, reason = "called from SIMD kernels, which must not leave their instructions")]

use crate::wide::layout::WIDTH;

/// Maximum number of decisions in a chunk.
pub(crate) const CHUNK_DECISIONS: usize = 1 << CHUNK_BITS;
const CHUNK_BITS: u32 = 12;

/// Decision for an interior node of the binary tree that is not part of a leaf. Refers to the decisions for its
/// children, so that the binary nodes need not be read.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Decision {
    /// Decisions for the children.
    children: [DecisionRef; 2],
    /// Index of the first child.
    pub(crate) first_child: u32,
    /// For each number of lanes that the node may take, two to eight, [`LANE_BITS`] bits: the number of lanes for its
    /// left child, 0 where the node takes a single lane. Above them [`COUNT_BITS`] bits for each child: its number of
    /// primitives. Above these [`COMPACT`].
    lanes: u32,
    /// [`hits_per_cost`](crate::wide::collapse::visit_order::hits_per_cost) of the children.
    hits_per_cost: [u16; 2],
}

/// Bit for a node that is compact where it becomes one of the wide tree.
const COMPACT: u32 = 1 << 31;
/// Bits for the left child's lanes.
pub(crate) const LANE_BITS: u32 = 3;
/// Position of the children's primitive counts.
const COUNT_SHIFT: u32 = LANE_BITS * (WIDTH as u32 - 1);
/// Bits for a primitive count.
const COUNT_BITS: u32 = 5;
/// Primitive count of a binary leaf with more primitives than [`COUNT_BITS`] bits can hold.
const COUNT_OVERFLOW: u32 = (1 << COUNT_BITS) - 1;

impl Decision {
    /// The decision for the parent of `first_child`, with the `lanes` of
    /// [`crate::wide::collapse::cost::collapse_cost`], the decisions for both children, their primitive counts and hits per cost, and
    /// whether it is compact.
    #[inline(always)]
    pub(crate) fn new(
        first_child: u32,
        lanes: u32,
        children: [DecisionRef; 2],
        counts: [u32; 2],
        hits_per_cost: [u16; 2],
        is_compact: bool,
    ) -> Self {
        let [left, right] = counts.map(|count| count.min(COUNT_OVERFLOW));
        let form = if is_compact { COMPACT } else { 0 };
        let lanes = lanes | left << COUNT_SHIFT | right << (COUNT_SHIFT + COUNT_BITS) | form;
        Self { children, first_child, lanes, hits_per_cost }
    }

    /// Whether the node is compact where it becomes one of the wide tree.
    #[inline(always)]
    pub(crate) fn is_compact(self) -> bool {
        self.lanes & COMPACT != 0
    }

    /// Number of lanes for the left child out of `lanes`, one to eight; 0 where the node takes a single lane.
    #[inline(always)]
    pub(crate) fn left_lanes(self, lanes: u32) -> u32 {
        // A single lane reads the zeros shifted in.
        (self.lanes << LANE_BITS) >> (LANE_BITS * (lanes - 1)) & 7
    }

    /// The children with their decisions.
    #[inline(always)]
    pub(crate) fn children(self) -> [DecidedNode; 2] {
        let count = |side: u32| self.lanes >> (COUNT_SHIFT + COUNT_BITS * side) & COUNT_OVERFLOW;
        [0, 1].map(|side| DecidedNode {
            node: self.first_child + side,
            decision: self.children[side as usize],
            count: count(side),
            hits_per_cost: self.hits_per_cost[side as usize],
        })
    }
}

/// Reference to the decision for a node: a leaf with the slot of its first primitive, or the index of a [`Decision`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct DecisionRef(u32);

impl DecisionRef {
    const LEAF: u32 = 1 << 31;

    #[inline(always)]
    pub(crate) fn leaf(first: u32) -> Self {
        Self(first | Self::LEAF)
    }

    /// Refers to decision `index` of a chunk.
    #[inline(always)]
    pub(crate) fn decision(chunk: usize, index: usize) -> Self {
        Self((chunk << CHUNK_BITS | index) as u32)
    }

    #[inline(always)]
    pub(crate) fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// Slot of the first primitive of a leaf.
    #[inline(always)]
    pub(crate) fn first(self) -> u32 {
        self.0 & !Self::LEAF
    }
}

/// A node of the binary tree with its decision.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct DecidedNode {
    pub(crate) node: u32,
    pub(crate) decision: DecisionRef,
    /// Number of primitives of a leaf, if less than [`COUNT_OVERFLOW`].
    count: u32,
    /// [`hits_per_cost`](crate::wide::collapse::visit_order::hits_per_cost); 0 for the root.
    pub(crate) hits_per_cost: u16,
}

impl DecidedNode {
    pub(crate) fn new(node: u32, decision: DecisionRef, count: u32) -> Self {
        Self { node, decision, count: count.min(COUNT_OVERFLOW), hits_per_cost: 0 }
    }

    /// Number of primitives of the leaf that the node becomes; `binary_count` looks up that of a binary leaf.
    #[inline(always)]
    pub(crate) fn primitives(self, binary_count: impl Fn(u32) -> u32) -> u32 {
        if self.count < COUNT_OVERFLOW { self.count } else { binary_count(self.node) }
    }
}

/// Decisions for all interior nodes that do not become part of a leaf, in chunks of up to [`CHUNK_DECISIONS`].
pub(crate) struct Decisions {
    pub(crate) chunks: Vec<Vec<Decision>>,
    pub(crate) root: DecidedNode,
}

impl Decisions {
    /// The decision for a node that does not become a leaf.
    #[inline(always)]
    pub(crate) fn get(&self, decision: DecisionRef) -> Decision {
        self.chunks[(decision.0 >> CHUNK_BITS) as usize][decision.0 as usize % CHUNK_DECISIONS]
    }

    /// Prefetches a decision.
    #[inline(always)]
    pub(crate) fn prefetch(&self, decision: DecisionRef) {
        crate::kernel::prefetch::prefetch(
            &self.chunks[(decision.0 >> CHUNK_BITS) as usize],
            decision.0 as usize % CHUNK_DECISIONS,
        );
    }
}
