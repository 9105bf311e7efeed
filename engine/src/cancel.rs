//! Cancellation and progress. Every long computation takes a [`CancelToken`], polls it for cancellation at coarse intervals and
//! reports its progress through it.

use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use crate::task_log::{Strand, TaskLog};

/// Steps between two cancellation checks where a step reads or writes a few values.
pub const LIGHT_STEPS: usize = 1 << 16;
/// Steps between two cancellation checks where a step computes with a node, a triangle or a pair.
pub const MEDIUM_STEPS: usize = 1 << 14;
/// Steps between two cancellation checks where a step works on many values or allocates.
pub const HEAVY_STEPS: usize = 1 << 12;

/// Error of a computation whose token was cancelled. Not a failure: the result is no longer wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// Cancels a computation and reads its progress from another thread. Clones refer to the same computation.
///
/// ```
/// use bvhscope_engine::{CancelToken, Cancelled};
///
/// let token = CancelToken::new();
/// let worker = token.clone();
/// worker.set_progress(0.5);
/// assert!(worker.check().is_ok() && token.progress() == 0.5);
/// token.cancel();
/// assert_eq!(worker.check(), Err(Cancelled));
/// ```
#[derive(Debug, Clone)]
pub struct CancelToken {
    shared: Arc<Shared>,
    /// Progress of the whole work when this part of it starts, see [`CancelToken::part`].
    start: f32,
    /// Fraction of the whole work that this part is.
    span: f32,
    /// The piece of work that is logged, where a log is wanted.
    strand: Option<Arc<Strand>>,
}

impl Default for CancelToken {
    fn default() -> Self {
        Self { shared: Arc::default(), start: 0.0, span: 1.0, strand: None }
    }
}

#[derive(Debug, Default)]
struct Shared {
    cancelled: AtomicBool,
    /// Progress in units of 1/10000.
    progress: AtomicU32,
    costs: Mutex<Vec<(Duration, f64)>>,
    watch: Option<Watch>,
}

/// Callback for each cancellation check.
struct Watch {
    /// Number of checks so far.
    checks: AtomicU64,
    on_check: Box<dyn Fn(u64) -> bool + Send + Sync>,
}

impl std::fmt::Debug for Watch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Watch").field("checks", &self.checks).finish_non_exhaustive()
    }
}

impl CancelToken {
    /// A token that is not cancelled.
    pub fn new() -> Self {
        Self::default()
    }

    /// A token that calls `on_check` at each cancellation check with the number of checks so far, this one included, and is
    /// cancelled once the callback returns `true`. For tests of what happens at and between checks.
    pub fn watched(on_check: impl Fn(u64) -> bool + Send + Sync + 'static) -> Self {
        let watch = Some(Watch { checks: AtomicU64::new(0), on_check: Box::new(on_check) });
        Self { shared: Arc::new(Shared { watch, ..Shared::default() }), ..Self::default() }
    }

    /// A token of a computation whose tasks are logged in `log`.
    pub fn logging(log: &Arc<TaskLog>) -> Self {
        Self::new().logged(log)
    }

    /// This token for a computation whose tasks are logged in `log`.
    #[must_use]
    pub fn logged(&self, log: &Arc<TaskLog>) -> Self {
        self.on_strand(&Arc::new(Strand::new(log)))
    }

    /// This token for a task whose pieces are logged by `strand`.
    pub(crate) fn on_strand(&self, strand: &Arc<Strand>) -> Self {
        Self { strand: Some(Arc::clone(strand)), ..self.clone() }
    }

    /// The log of this token's task, if it is logged.
    pub(crate) fn strand(&self) -> Option<&Arc<Strand>> {
        self.strand.as_ref()
    }

    /// Requests that the computation stops at its next cancellation check.
    pub fn cancel(&self) {
        self.shared.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether the computation should stop: a cancellation check.
    pub fn is_cancelled(&self) -> bool {
        if let Some(watch) = &self.shared.watch
            && (watch.on_check)(watch.checks.fetch_add(1, Ordering::Relaxed) + 1)
        {
            self.cancel();
        }
        self.shared.cancelled.load(Ordering::Relaxed)
    }

    /// Polls for cancellation: `Err(Cancelled)` once the token is cancelled, for use with `?`.
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }

    /// Polls for cancellation at each `distance`-th step of a loop, of which `step` counts the steps from 0: `Err(Cancelled)` if the
    /// token is cancelled then, `Ok` at the steps between. `distance` is above 0.
    #[inline(always)]
    pub fn check_every(&self, distance: usize, step: usize) -> Result<(), Cancelled> {
        if step.is_multiple_of(distance) { self.check() } else { Ok(()) }
    }

    /// A token for the `index`-th of `count` equal parts of the computation: progress reported through it is progress within that
    /// part, and cancelling either token cancels both.
    #[must_use]
    pub fn part(&self, index: usize, count: usize) -> Self {
        let share = 1.0 / count.max(1) as f32;
        self.share(share * index as f32, share)
    }

    /// A token for the part of the computation that begins at the fraction `start` and is the fraction `share` of it, as
    /// [`CancelToken::part`].
    #[must_use]
    pub fn share(&self, start: f32, share: f32) -> Self {
        Self { start: self.start + self.span * start, span: self.span * share, ..self.clone() }
    }

    /// Reports the finished fraction, 0 to 1, of the computation or of this token's part of it.
    pub fn set_progress(&self, fraction: f32) {
        let whole = self.start + self.span * fraction.clamp(0.0, 1.0);
        let progress = (whole * 10_000.0).round() as u32;
        self.shared.progress.store(progress, Ordering::Relaxed);
    }

    /// Finished fraction, 0 to 1, of the whole computation as last reported.
    pub fn progress(&self) -> f32 {
        self.shared.progress.load(Ordering::Relaxed) as f32 / 10_000.0
    }

    /// Reports the cost of the result so far, of which less is better, with the time since the beginning.
    pub fn report_cost(&self, point: (Duration, f64)) {
        self.shared.costs.lock().unwrap_or_else(PoisonError::into_inner).push(point);
    }

    /// The costs reported so far; empty for a computation that does not improve its result step by step.
    pub fn costs(&self) -> Vec<(Duration, f64)> {
        self.shared.costs.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Progress of a computation whose tasks end on many threads, in any order. It never goes back: of two threads that report one after
/// the other what an atomic sum told them, the one with less may come last, and a finished computation seems to stand still.
#[derive(Debug)]
pub struct TaskProgress {
    finished: Mutex<u64>,
    all: u64,
}

impl TaskProgress {
    /// No step of `all`.
    pub fn new(all: u64) -> Self {
        Self { finished: Mutex::new(0), all }
    }

    /// Adds `steps` that have been finished, and reports through `token` how many of all have.
    pub fn add(&self, steps: u64, token: &CancelToken) {
        let mut finished = self.finished.lock().unwrap_or_else(PoisonError::into_inner);
        *finished += steps;
        token.set_progress((*finished as f64 / self.all.max(1) as f64) as f32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tasks_that_end_at_once_end_at_1() {
        const THREADS: u64 = 4;
        for _ in 0..2_000 {
            let (token, progress) = (CancelToken::new(), TaskProgress::new(THREADS));
            let start = std::sync::Barrier::new(THREADS as usize);
            std::thread::scope(|scope| {
                for _ in 0..THREADS {
                    scope.spawn(|| {
                        start.wait();
                        progress.add(1, &token);
                    });
                }
            });
            assert!(token.progress() >= 1.0);
        }
    }

    #[test]
    fn parts_of_parts_fill_the_whole() {
        let whole = CancelToken::new();
        let part = whole.part(1, 4).part(1, 2);
        part.set_progress(0.0);
        assert!((whole.progress() - 0.375).abs() < 1e-3);
        part.set_progress(1.0);
        assert!((whole.progress() - 0.5).abs() < 1e-3);
        whole.part(3, 4).part(1, 2).set_progress(1.0);
        assert!(whole.progress() >= 1.0);
        part.cancel();
        assert!(whole.is_cancelled());
    }
}
