//! The traversal stack of single rays and packets.

use arrayvec::ArrayVec;

use crate::wide::layout::WIDTH;

/// Number of entries that are held without heap allocation, beyond the children of one node: enough for all but degenerate
/// trees.
const INLINE: usize = 64;

/// A traversal stack that grows without limit. Its inline entries are not initialised until used.
#[derive(Debug)]
pub(crate) struct Stack<T> {
    /// The top of the stack.
    top: ArrayVec<T, { INLINE + WIDTH }>,
    /// The entries below, for which there was no space.
    bottom: Vec<T>,
}

impl<T: Copy> Stack<T> {
    /// An empty stack.
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self { top: ArrayVec::new(), bottom: Vec::new() }
    }

    /// Makes space for the children of a node. Returns the position of the first, for [`Stack::sort_last`].
    #[inline(always)]
    pub(crate) fn reserve(&mut self) -> usize {
        if self.is_full() {
            self.spill();
        }
        self.top.len()
    }

    /// Whether the inline entries may not suffice for the children of a node.
    #[inline(always)]
    pub(crate) fn is_full(&self) -> bool {
        self.top.len() > INLINE
    }

    #[cold]
    #[inline(never)]
    fn spill(&mut self) {
        self.bottom.extend_from_slice(&self.top);
        self.top.clear();
    }

    /// Pushes one of up to eight entries after [`Stack::reserve`].
    #[inline(always)]
    pub(crate) fn push(&mut self, entry: T) {
        self.top.push(entry);
    }

    #[inline(always)]
    pub(crate) fn pop(&mut self) -> Option<T> {
        self.top.pop().or_else(|| self.bottom.pop())
    }

    /// The entries since `mark`, which [`Stack::reserve`] returned, the top of the stack last.
    pub(crate) fn since(&self, mark: usize) -> &[T] {
        &self.top[mark..]
    }

    /// Moves the last entry to its position among those pushed since `mark`, so that none is `before` the one above it.
    #[inline(always)]
    pub(crate) fn sort_last(&mut self, mark: usize, before: impl Fn(T, T) -> bool) {
        let mut at = self.top.len().saturating_sub(1);
        while at > mark && before(self.top[at - 1], self.top[at]) {
            self.top.swap(at - 1, at);
            at -= 1;
        }
    }
}
