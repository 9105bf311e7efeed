//! Polling for cancellation once every so many steps.

use super::token::{CancelToken, Cancelled};

/// Steps between two checks where a step takes nanoseconds: checks are too rare to cost time, and less than a millisecond apart.
const CHEAP_STEPS: usize = 1 << 14;

/// Checks a token for cancellation at the first step, then once every so many. From [`CancelToken::poll`] or
/// [`CancelToken::every`].
#[derive(Debug)]
pub struct Poll<'a> {
    token: &'a CancelToken,
    steps: usize,
    /// Steps until the next check.
    left: usize,
    progress: Option<Progress>,
}

#[derive(Debug)]
struct Progress {
    /// Steps at the last check.
    done: u64,
    /// Number of all steps.
    all: u64,
}

impl CancelToken {
    /// A poll for cancellation in a loop whose steps take nanoseconds: once every 2¹⁴ steps.
    pub fn poll(&self) -> Poll<'_> {
        self.every(CHEAP_STEPS)
    }

    /// A poll for cancellation once every `steps` steps.
    pub fn every(&self, steps: usize) -> Poll<'_> {
        Poll { token: self, steps: steps.max(1), left: 1, progress: None }
    }
}

impl Poll<'_> {
    /// This poll, which also reports the finished fraction of `all` steps at each check.
    #[must_use]
    pub fn reporting(self, all: u64) -> Self {
        Self { progress: Some(Progress { done: 0, all: all.max(1) }), ..self }
    }

    /// Counts a step and, if a check is due, checks for cancellation. Returns whether a check was due: the time to report progress of
    /// other units than steps.
    #[inline]
    pub fn step(&mut self) -> Result<bool, Cancelled> {
        self.left -= 1;
        if self.left == 0 { self.check() } else { Ok(false) }
    }

    #[cold]
    fn check(&mut self) -> Result<bool, Cancelled> {
        self.left = self.steps;
        self.token.check()?;
        if let Some(Progress { done, all }) = &mut self.progress {
            self.token.set_progress((*done as f64 / *all as f64) as f32);
            *done = done.saturating_add(self.steps as u64);
        }
        Ok(true)
    }
}

/// Iterators that poll for cancellation.
///
/// ```
/// use bvhscope_engine::cancel::PolledIterator as _;
/// use bvhscope_engine::{CancelToken, Cancelled};
///
/// fn sum(numbers: &[u64], token: &CancelToken) -> Result<u64, Cancelled> {
///     let mut sum = 0;
///     for number in numbers.iter().polled(token) {
///         sum += number?;
///     }
///     Ok(sum)
/// }
///
/// let token = CancelToken::new();
/// assert_eq!(sum(&[1, 2, 3], &token), Ok(6));
/// token.cancel();
/// assert_eq!(sum(&[1, 2, 3], &token), Err(Cancelled));
/// ```
pub trait PolledIterator: Iterator + Sized {
    /// The items, each of which takes nanoseconds, or [`Cancelled`] once the token is cancelled. It is checked before the first item
    /// and then once every 2¹⁴ items.
    #[inline]
    fn polled(self, token: &CancelToken) -> impl Iterator<Item = Result<Self::Item, Cancelled>> {
        self.polled_every(CHEAP_STEPS, token)
    }

    /// [`PolledIterator::polled`] with a check once every `items` items.
    #[inline]
    fn polled_every(self, items: usize, token: &CancelToken) -> impl Iterator<Item = Result<Self::Item, Cancelled>> {
        let mut poll = token.every(items);
        self.map(move |item| poll.step().map(|_| item))
    }
}

impl<I: Iterator> PolledIterator for I {}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::*;

    #[test]
    fn a_check_precedes_the_first_item_and_each_nth_after_it() {
        let checks = Arc::new(AtomicU64::new(0));
        let seen = Arc::clone(&checks);
        let token = CancelToken::watched(move |check| {
            seen.store(check, Ordering::Relaxed);
            check > 3
        });
        let items: Result<Vec<u32>, Cancelled> = (0..6).polled_every(3, &token).collect();
        assert_eq!((items, checks.load(Ordering::Relaxed)), (Ok(vec![0, 1, 2, 3, 4, 5]), 2));
        let items: Vec<Result<u32, Cancelled>> = (0..6).polled_every(3, &token).take(4).collect();
        assert_eq!(items, [Ok(0), Ok(1), Ok(2), Err(Cancelled)]);
    }
}
