//! Cancellation and progress. Every long computation takes a [`CancelToken`], polls it for cancellation at coarse intervals
//! ([`PolledIterator`] in a loop over a list, [`Poll`] in any other) and reports its progress through it.

mod poll;
mod token;

pub use poll::{Poll, PolledIterator};
pub use token::{CancelToken, Cancelled};
