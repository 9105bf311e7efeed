//! What workers share: jobs that are not finished yet, and the thread pool that they run in.

use std::cell::RefCell;
use std::sync::Arc;
use std::time::Instant;

use rayon::ThreadPool;

use crate::app::state::{JobStatus, MessageLog, Severity};
use crate::console::note;
use crate::threads::{count, pool_of_granted};
use crate::worker::{Outcome, Worker};
use bvhscope_engine::cancel::CancelToken;

/// A requested job whose final result has not arrived.
pub(crate) struct InFlight<K> {
    /// The inputs of the product.
    pub key: K,
    /// Cancels the job and holds its progress.
    pub token: CancelToken,
    /// When it was requested.
    pub since: Instant,
}

impl<K> InFlight<K> {
    /// The job as the job strip shows it.
    pub(crate) fn status(&self, label: String) -> JobStatus {
        JobStatus { label, progress: self.token.progress(), since: self.since, costs: self.token.costs() }
    }
}

/// What a worker with a job in flight has come to.
pub(crate) enum Polled<R> {
    /// No result yet.
    Running,
    /// A result, perhaps one of several.
    Result(R),
    /// The job ended without a result; with the message of its panic, where it panicked.
    Failed(Option<String>),
}

/// Takes the newest result of a worker that has a job in flight. Never blocks.
pub(crate) fn poll<Q: Send + 'static, R: Send + 'static>(worker: &Worker<Q, R>) -> Polled<R> {
    // In this order, because a job that ends between the two calls has left its result in the outbox.
    let busy = worker.is_busy();
    match worker.take() {
        None if busy => Polled::Running,
        None => Polled::Failed(None),
        Some(Outcome::Done(result)) => Polled::Result(result),
        Some(Outcome::Panicked(text)) => Polled::Failed(Some(text)),
    }
}

/// Reports a panic of the job described by `activity` ("Building").
pub(crate) fn report_panic(messages: &mut MessageLog, activity: &str, text: &str) {
    note(format_args!("error: {activity} failed: {text}"));
    messages.notify(
        Severity::Error,
        format!("{activity} failed through a mistake in this program: {text}. What was on the screen stays"),
    );
}

/// A rayon thread pool that is reused until another number of threads is requested.
#[derive(Default)]
pub(crate) struct WorkerPool {
    current: RefCell<Option<(usize, Arc<ThreadPool>)>>,
}

impl WorkerPool {
    /// Runs `work` in a pool of `threads` threads (0 for all), no more than there are cores and than the system grants. The
    /// threads are named after `name`.
    pub(crate) fn run<R: Send>(&self, name: &'static str, threads: usize, work: impl FnOnce() -> R + Send) -> R {
        let threads = count(threads);
        let mut current = self.current.borrow_mut();
        if current.as_ref().is_none_or(|(count, _)| *count != threads) {
            let (pool, note) = pool_of_granted(name, threads);
            if let Some(text) = note {
                log::warn!("{text}");
            }
            // A thread that has become a pool itself cannot join another one, so the previous pool stays in use.
            if let Some(pool) = pool {
                *current = Some((threads, Arc::new(pool)));
            }
        }
        let pool = current.as_ref().map(|(_, pool)| Arc::clone(pool));
        drop(current);
        match pool {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }
}
