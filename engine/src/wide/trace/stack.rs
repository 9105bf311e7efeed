//! What waits while rays go down a tree.

use arrayvec::ArrayVec;

use crate::wide::tree::Child;

/// Entries that a stack holds without touching the heap: enough for every tree but the degenerate ones.
const INLINE: usize = 128;

/// A child that waits for its turn.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Waiting {
    /// Distance at which it is entered.
    pub(crate) entry: f32,
    pub(crate) child: Child,
    /// The groups of a packet that enter it; nothing for a single ray.
    pub(crate) groups: u32,
}

/// A stack that need not be cleared before use.
#[derive(Debug, Default)]
pub(crate) struct Stack {
    inline: ArrayVec<Waiting, INLINE>,
    spilled: Vec<Waiting>,
}

impl Stack {
    #[inline(always)]
    pub(crate) fn push(&mut self, waiting: Waiting) {
        if self.inline.try_push(waiting).is_err() {
            self.spill(waiting);
        }
    }

    #[cold]
    fn spill(&mut self, waiting: Waiting) {
        self.spilled.push(waiting);
    }

    #[inline(always)]
    pub(crate) fn pop(&mut self) -> Option<Waiting> {
        if !self.spilled.is_empty() {
            return self.spilled.pop();
        }
        self.inline.pop()
    }

    /// Where a node's children begin: what [`Stack::sort_from`] takes.
    #[inline(always)]
    pub(crate) fn mark(&self) -> usize {
        self.inline.len()
    }

    /// Brings the last entry to its place among those since `mark`, the nearest last. Those that spilled stay as they are.
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
