//! Large lists, filled in parallel in the calling thread's rayon pool, with a cancellation check before each chunk.

use bytemuck::Zeroable;
use rayon::prelude::*;

use crate::cancel::{CancelToken, Cancelled};

/// Number of items between two cancellation checks: some megabytes of the largest ones.
const CHUNK: usize = 1 << 16;

/// Items that a logged part of a loop is at most divided into: fewer would not pay.
const MIN_ITEMS_PER_PART: usize = 256;

/// Collects `item(index)` for each `index` below `count`, in order.
pub fn par_collect<T: Send>(
    count: usize,
    token: &CancelToken,
    item: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, Cancelled> {
    par_collect_in_chunks(count, CHUNK, token, item)
}

/// [`par_collect`] of items that take long, with a cancellation check before each `chunk` of them.
pub fn par_collect_in_chunks<T: Send>(
    count: usize,
    chunk: usize,
    token: &CancelToken,
    item: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, Cancelled> {
    let mut list = Vec::with_capacity(count);
    while list.len() < count {
        token.check()?;
        let first = list.len();
        let end = count.min(first + chunk);
        let fork = token.fork();
        let parts = (end - first).div_ceil(MIN_ITEMS_PER_PART);
        list.par_extend((first..end).into_par_iter().map_init(|| fork.part_of_loop(parts), |_, index| item(index)));
        fork.join();
    }
    Ok(list)
}

/// A list of `count` zeros, to be written in arbitrary order. Cleared in parallel: for a large list in memory that was used
/// before, one thread would take as long as a tenth of a build.
pub fn zeros<T: Zeroable + Send>(count: usize, token: &CancelToken) -> Result<Vec<T>, Cancelled> {
    par_collect(count, token, |_| T::zeroed())
}
