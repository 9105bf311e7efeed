//! Stopping work that nobody waits for, and telling how far it is. Every long computation takes a [`CancelToken`] and
//! asks it at coarse check points.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};

/// Work was stopped because its token was cancelled. Not a failure: nobody wanted the result any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// Shared between the one who works and the one who may stop it. Clones refer to the same work.
#[derive(Debug, Clone)]
pub struct CancelToken {
    shared: Arc<Shared>,
    /// Where in the whole work the progress begins and how much of it there is: [`CancelToken::part`].
    from: f32,
    span: f32,
}

impl Default for CancelToken {
    fn default() -> Self {
        Self { shared: Arc::default(), from: 0.0, span: 1.0 }
    }
}

#[derive(Debug, Default)]
struct Shared {
    cancelled: AtomicBool,
    /// Progress in units of 1/10000.
    progress: AtomicU32,
    watch: Option<Watch>,
}

/// Sees every look at a token.
struct Watch {
    looks: AtomicU64,
    on_look: Box<dyn Fn(u64) -> bool + Send + Sync>,
}

impl std::fmt::Debug for Watch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Watch").field("looks", &self.looks).finish_non_exhaustive()
    }
}

impl CancelToken {
    /// A token that nobody has cancelled yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// A token whose every look calls `on_look` with its number, counted from 1, and that is cancelled once this returns
    /// `true`: for tests of what happens at, or between, check points.
    pub fn watched(on_look: impl Fn(u64) -> bool + Send + Sync + 'static) -> Self {
        let watch = Some(Watch { looks: AtomicU64::new(0), on_look: Box::new(on_look) });
        Self { shared: Arc::new(Shared { watch, ..Shared::default() }), ..Self::default() }
    }

    /// Asks the work to stop at its next check point.
    pub fn cancel(&self) {
        self.shared.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether the work should stop.
    pub fn is_cancelled(&self) -> bool {
        if let Some(watch) = &self.shared.watch
            && (watch.on_look)(watch.looks.fetch_add(1, Ordering::Relaxed) + 1)
        {
            self.cancel();
        }
        self.shared.cancelled.load(Ordering::Relaxed)
    }

    /// `Err(Cancelled)` once cancelled: for use with `?` at check points.
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }

    /// The same token for the `index`-th of `count` equal parts of the work: what is reported through it counts within
    /// that part, and cancelling either cancels both.
    #[must_use]
    pub fn part(&self, index: usize, count: usize) -> Self {
        let span = self.span / count.max(1) as f32;
        Self { shared: Arc::clone(&self.shared), from: self.from + span * index as f32, span }
    }

    /// Reports the finished share of the work, or of this token's part of it, 0 to 1.
    pub fn set_progress(&self, fraction: f32) {
        let whole = self.from + self.span * fraction.clamp(0.0, 1.0);
        let parts = (whole * 10_000.0).round() as u32;
        self.shared.progress.store(parts, Ordering::Relaxed);
    }

    /// The finished share of the whole work as last reported, 0 to 1.
    pub fn progress(&self) -> f32 {
        self.shared.progress.load(Ordering::Relaxed) as f32 / 10_000.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
