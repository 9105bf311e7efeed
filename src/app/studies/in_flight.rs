//! Jobs that a worker has not finished yet.

use std::time::Instant;

use crate::app::state::{JobStatus, MessageLog, Severity};
use crate::console::note;
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
