//! What becomes of each node of the binary tree: which are leaves of the wide one, and how many of a wide node's eight lanes each
//! child gets.

#![allow(clippy::inline_always, reason = "called from SIMD kernels, which must not leave their instructions")]

use crate::wide::layout::WIDTH;

/// Choices in a list.
pub(crate) const LISTED: usize = 1 << LISTED_BITS;
const LISTED_BITS: u32 = 12;

/// What becomes of an interior node of the binary tree that is not part of a leaf, and what it takes to go on from there without a
/// look at the nodes below.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Choice {
    /// What becomes of its children.
    links: [Link; 2],
    /// Number of its first child.
    pub(crate) first_child: u32,
    /// Three bits for each number of lanes that it may take, two to eight: how many of them its left child gets, none where the
    /// node takes one lane as a whole. Above them [`COUNT_BITS`] for each child.
    lanes: u32,
}

/// Bits for each number of lanes.
pub(crate) const BITS: u32 = 3;
/// Where the children's numbers of primitives stand.
const COUNT_SHIFT: u32 = BITS * (WIDTH as u32 - 1);
/// Bits for a number of primitives.
const COUNT_BITS: u32 = 5;
/// Stands for the primitives of a leaf of the binary tree, so many that there is no room for their number.
const MANY: u32 = (1 << COUNT_BITS) - 1;

impl Choice {
    /// The choice for the node above `first_child`, with `lanes` from [`crate::wide::collapse::cost::weigh`], what becomes of both children, and
    /// how many primitives they have.
    #[inline(always)]
    pub(crate) fn new(first_child: u32, lanes: u32, links: [Link; 2], counts: [u32; 2]) -> Self {
        let [left, right] = counts.map(|count| count.min(MANY));
        Self { links, first_child, lanes: lanes | left << COUNT_SHIFT | right << (COUNT_SHIFT + COUNT_BITS) }
    }

    /// How many of `lanes`, one to eight, go to the left child; none where the node stays whole.
    #[inline(always)]
    pub(crate) fn left_of(self, lanes: u32) -> u32 {
        // For one lane, the zeros that come in.
        (self.lanes << BITS) >> (BITS * (lanes - 1)) & 7
    }

    /// Its children.
    #[inline(always)]
    pub(crate) fn children(self) -> [Branch; 2] {
        let count = |side: u32| self.lanes >> (COUNT_SHIFT + COUNT_BITS * side) & MANY;
        [0, 1].map(|side| Branch { node: self.first_child + side, link: self.links[side as usize], count: count(side) })
    }
}

/// What becomes of a node: a leaf, with the slot of its first primitive, or what a choice says, with the place of that.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Link(u32);

impl Link {
    const LEAF: u32 = 1 << 31;

    #[inline(always)]
    pub(crate) fn leaf(first: u32) -> Self {
        Self(first | Self::LEAF)
    }

    /// The choice at a place of a list.
    #[inline(always)]
    pub(crate) fn choice(list: usize, at: usize) -> Self {
        Self((list << LISTED_BITS | at) as u32)
    }

    #[inline(always)]
    pub(crate) fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// The slot of a leaf's first primitive.
    #[inline(always)]
    pub(crate) fn first(self) -> u32 {
        self.0 & !Self::LEAF
    }
}

/// A node of the binary tree and what becomes of it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Branch {
    pub(crate) node: u32,
    pub(crate) link: Link,
    /// Of a leaf, the number of primitives, if that is less than [`MANY`].
    count: u32,
}

impl Branch {
    pub(crate) fn new(node: u32, link: Link, count: u32) -> Self {
        Self { node, link, count: count.min(MANY) }
    }

    /// Number of primitives of the leaf that it becomes; `of_node` tells that of a leaf of the binary tree.
    #[inline(always)]
    pub(crate) fn primitives(self, of_node: impl Fn(u32) -> u32) -> u32 {
        if self.count < MANY { self.count } else { of_node(self.node) }
    }
}

/// The choices for all interior nodes that do not become part of a leaf, in lists of up to [`LISTED`].
pub(crate) struct Choices {
    pub(crate) lists: Vec<Vec<Choice>>,
    pub(crate) root: Branch,
}

impl Choices {
    /// The choice of a node that does not become a leaf.
    #[inline(always)]
    pub(crate) fn get(&self, link: Link) -> Choice {
        self.lists[(link.0 >> LISTED_BITS) as usize][link.0 as usize % LISTED]
    }

    /// Has it fetched.
    #[inline(always)]
    pub(crate) fn prefetch(&self, link: Link) {
        crate::kernel::prefetch::prefetch(&self.lists[(link.0 >> LISTED_BITS) as usize], link.0 as usize % LISTED);
    }
}
