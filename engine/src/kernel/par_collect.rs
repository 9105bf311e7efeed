//! Large lists, made by the threads of the calling pool part by part, with a look at the token before each part.

use bytemuck::Zeroable;
use rayon::prelude::*;

use crate::cancel::{CancelToken, Cancelled};

/// Items between two looks at the token: some megabytes of the largest ones.
const AT_ONCE: usize = 1 << 16;

/// `of(k)` for each `k` below `count`, in order.
pub fn par_collect<T: Send>(
    count: usize,
    token: &CancelToken,
    of: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, Cancelled> {
    let mut list = Vec::with_capacity(count);
    while list.len() < count {
        token.check()?;
        let first = list.len();
        let end = count.min(first + AT_ONCE);
        list.par_extend((first..end).into_par_iter().map(&of));
    }
    Ok(list)
}

/// So many zeros, for what is filled in no order. Memory that was used before has to be cleared, which for a large list takes
/// one thread as long as a tenth of a build.
pub fn zeros<T: Zeroable + Send>(count: usize, token: &CancelToken) -> Result<Vec<T>, Cancelled> {
    par_collect(count, token, |_| T::zeroed())
}
