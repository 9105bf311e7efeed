//! The traversal stack of single rays and packets.

use arrayvec::ArrayVec;

use crate::wide::tree::Child;

/// Number of entries held without heap allocation: enough for all but degenerate trees.
const INLINE: usize = 128;

/// A child to visit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StackEntry {
    /// Distance of entry.
    pub(crate) entry: f32,
    pub(crate) child: Child,
    /// The groups of a packet that enter the child; unused for single rays.
    pub(crate) groups: u32,
}

/// A traversal stack whose first [`INLINE`] entries live in place, uninitialised until used.
#[derive(Debug, Default)]
pub(crate) struct Stack {
    inline: ArrayVec<StackEntry, INLINE>,
    spilled: Vec<StackEntry>,
}

impl Stack {
    #[inline(always)]
    pub(crate) fn push(&mut self, waiting: StackEntry) {
        if self.inline.try_push(waiting).is_err() {
            self.spill(waiting);
        }
    }

    #[cold]
    fn spill(&mut self, waiting: StackEntry) {
        self.spilled.push(waiting);
    }

    #[inline(always)]
    pub(crate) fn pop(&mut self) -> Option<StackEntry> {
        if !self.spilled.is_empty() {
            return self.spilled.pop();
        }
        self.inline.pop()
    }

    /// The last `count` entries, the top of the stack last.
    pub(crate) fn last(&self, count: usize) -> impl Iterator<Item = &StackEntry> {
        let skipped = self.inline.len() + self.spilled.len() - count;
        self.inline.iter().chain(&self.spilled).skip(skipped)
    }

    /// Position before the children of a node are pushed, for [`Stack::sort_last`].
    #[inline(always)]
    pub(crate) fn mark(&self) -> usize {
        self.inline.len()
    }

    /// Moves the last entry to its position among those pushed since `mark`, the nearest on top. Spilled entries are
    /// left unsorted.
    #[inline(always)]
    pub(crate) fn sort_last(&mut self, mark: usize) {
        let mut at = self.inline.len();
        if at <= mark + 1 {
            return;
        }
        at -= 1;
        while at > mark && self.inline[at - 1].entry < self.inline[at].entry {
            self.inline.swap(at - 1, at);
            at -= 1;
        }
    }
}
