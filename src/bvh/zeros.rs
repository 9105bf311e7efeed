//! Large lists that are filled in no order.

use bytemuck::Zeroable;
use rayon::prelude::*;

use crate::cancel::{CancelToken, Cancelled};

/// Bytes between two looks at the token.
const BYTES_AT_ONCE: usize = 4 << 20;

/// So many zeros, written by the threads of the calling pool. Memory that was used before has to be cleared, which for a
/// large list takes one thread as long as a tenth of a build.
pub fn zeros<T: Zeroable + Clone + Send + Sync>(count: usize, token: &CancelToken) -> Result<Vec<T>, Cancelled> {
    let mut list = Vec::with_capacity(count);
    while list.len() < count {
        token.check()?;
        let more = (BYTES_AT_ONCE / size_of::<T>()).min(count - list.len());
        list.par_extend(rayon::iter::repeat_n(T::zeroed(), more));
    }
    Ok(list)
}
