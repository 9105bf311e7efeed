//! The latest request to a worker: which job is in flight, which follows it, and which is not requested again. Also the thread
//! pool that jobs run in.

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
struct InFlight<K> {
    /// The inputs of the product.
    key: K,
    /// Cancels the job and holds its progress.
    token: CancelToken,
    /// When it was requested.
    since: Instant,
}

/// A worker of which only the latest request is wanted: one job is in flight, a new one replaces it. `K` are the inputs by which
/// requests are told apart, `Q` is what the worker is given, and `R` its results.
pub(crate) struct Latest<K, Q, R> {
    worker: Worker<Q, R>,
    in_flight: Option<InFlight<K>>,
    /// The job to follow the one in flight.
    queued: Option<InFlight<K>>,
    /// Inputs that failed or were cancelled, so that they are not requested again at once.
    refused: Option<K>,
}

impl<K: PartialEq, Q: Send + 'static, R: Send + 'static> Latest<K, Q, R> {
    /// Nothing is requested yet.
    pub(crate) const fn new(worker: Worker<Q, R>) -> Self {
        Self { worker, in_flight: None, queued: None, refused: None }
    }

    /// Requests `job`, whose inputs are `key`, in place of those in flight and queued.
    pub(crate) fn request(&mut self, key: K, job: Q, now: Instant) {
        let token = self.worker.request(job);
        self.queued = None;
        self.in_flight = Some(InFlight { key, token, since: now });
    }

    /// Requests `job` to follow the first result of the one in flight.
    pub(crate) fn queue(&mut self, key: K, job: Q, now: Instant) {
        let token = self.worker.queue(job);
        self.queued = Some(InFlight { key, token, since: now });
    }

    /// Inputs of the job in flight.
    pub(crate) fn key(&self) -> Option<&K> {
        self.in_flight.as_ref().map(|job| &job.key)
    }

    /// Inputs of the newest job, which may still be queued.
    pub(crate) fn newest(&self) -> Option<&K> {
        self.queued.as_ref().map(|job| &job.key).or_else(|| self.key())
    }

    /// Takes the newest result of the job in flight, which stays so until [`Latest::finish`]. A job that failed is refused. Never
    /// blocks.
    pub(crate) fn poll(&mut self) -> Polled<R> {
        if self.in_flight.is_none() {
            return Polled::Running;
        }
        // In this order, because a job that ends between the two calls has left its result in the outbox.
        let busy = self.worker.is_busy();
        let panic = match self.worker.take() {
            None if busy => return Polled::Running,
            Some(Outcome::Done(result)) => return Polled::Result(result),
            None => None,
            Some(Outcome::Panicked(text)) => Some(text),
        };
        self.cancel();
        Polled::Failed(panic)
    }

    /// Notes that the final result of the inputs `done` has arrived. A queued job is now in flight, unless those were its inputs,
    /// because it ended between two polls.
    pub(crate) fn finish(&mut self, done: &K) {
        self.in_flight = self.queued.take().filter(|job| job.key != *done);
    }

    /// Cancels the jobs in flight and queued. Returns the inputs of the former.
    pub(crate) fn stop(&mut self) -> Option<K> {
        self.queued = None;
        let job = self.in_flight.take()?;
        self.worker.cancel();
        Some(job.key)
    }

    /// The same, and refuses those inputs. Returns whether anything was in flight.
    pub(crate) fn cancel(&mut self) -> bool {
        let stopped = self.stop();
        let was_busy = stopped.is_some();
        self.refused = stopped.or_else(|| self.refused.take());
        was_busy
    }

    /// Refuses inputs; `None` refuses none.
    pub(crate) fn refuse(&mut self, key: Option<K>) {
        self.refused = key;
    }

    /// The refused inputs.
    pub(crate) const fn refused(&self) -> Option<&K> {
        self.refused.as_ref()
    }

    /// A job is in flight.
    pub(crate) const fn is_busy(&self) -> bool {
        self.in_flight.is_some()
    }

    /// When the job in flight was requested.
    pub(crate) fn since(&self) -> Option<Instant> {
        self.in_flight.as_ref().map(|job| job.since)
    }

    /// The job in flight as the job strip shows it.
    pub(crate) fn status(&self, label: impl Into<String>) -> Option<JobStatus> {
        let InFlight { token, since, .. } = self.in_flight.as_ref()?;
        Some(JobStatus { label: label.into(), progress: token.progress(), since: *since, costs: token.costs() })
    }
}

/// State of a worker's job in flight.
pub(crate) enum Polled<R> {
    /// No result yet.
    Running,
    /// A result, perhaps one of several.
    Result(R),
    /// The job ended without a result; with the message of its panic, where it panicked.
    Failed(Option<String>),
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

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use std::time::Duration;

    use super::*;

    /// A worker that returns its request, or panics for 0.
    fn latest() -> Latest<u8, u8, u8> {
        let work = |request: u8, _: &CancelToken, _: &(dyn Fn(u8) + Sync)| {
            assert!(request > 0, "on purpose");
            Some(request)
        };
        Latest::new(Worker::new("test", || {}, work).unwrap())
    }

    fn wait(latest: &mut Latest<u8, u8, u8>) -> Polled<u8> {
        let give_up = Instant::now() + Duration::from_mins(1);
        loop {
            match latest.poll() {
                Polled::Running => assert!(latest.is_busy() && Instant::now() < give_up, "no result"),
                polled => return polled,
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn inputs_that_fail_or_are_cancelled_are_refused() {
        let mut latest = latest();
        assert!(!latest.cancel() && latest.refused().is_none());
        latest.request(0, 0, Instant::now());
        assert!(matches!(wait(&mut latest), Polled::Failed(Some(_))));
        assert_eq!((latest.is_busy(), latest.refused()), (false, Some(&0)));
        latest.request(1, 1, Instant::now());
        assert!(latest.cancel());
        assert_eq!((latest.is_busy(), latest.refused()), (false, Some(&1)));
        assert!(!latest.cancel());
        assert_eq!(latest.refused(), Some(&1), "nothing else was cancelled");
    }

    #[test]
    fn a_queued_job_follows_unless_it_is_done_already() {
        let mut latest = latest();
        latest.request(1, 1, Instant::now());
        latest.queue(2, 2, Instant::now());
        assert_eq!((latest.key(), latest.newest()), (Some(&1), Some(&2)));
        latest.finish(&1);
        assert_eq!(latest.key(), Some(&2));
        latest.queue(3, 3, Instant::now());
        latest.finish(&3);
        assert!(!latest.is_busy());
    }
}
