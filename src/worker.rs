//! A worker thread that serves the newest request: a one-slot inbox, a one-slot outbox and a cancel token. Of the engine it
//! receives only the token.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use bvhscope_engine::cancel::CancelToken;

/// How a job ended.
#[derive(Debug)]
pub enum Outcome<T> {
    /// A result. Results of cancelled jobs are dropped.
    Done(T),
    /// The job panicked, with the panic's message. The worker goes on.
    Panicked(String),
}

struct Slots<Q, R> {
    inbox: Option<(Q, CancelToken)>,
    /// The token of the running job.
    running: Option<CancelToken>,
    /// The running job has delivered a result.
    delivered: bool,
    outbox: Option<Outcome<R>>,
    closed: bool,
}

struct Shared<Q, R> {
    slots: Mutex<Slots<Q, R>>,
    changed: Condvar,
}

impl<Q, R> Shared<Q, R> {
    /// Locks the slots. Poisoning is ignored, because nothing panics while they are inconsistent.
    fn lock(&self) -> MutexGuard<'_, Slots<Q, R>> {
        self.slots.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A named thread that turns the newest request of type `Q` into results of type `R`.
pub struct Worker<Q, R> {
    shared: Arc<Shared<Q, R>>,
    thread: Option<JoinHandle<()>>,
}

impl<Q: Send + 'static, R: Send + 'static> Worker<Q, R> {
    /// Starts the thread. `work` returns the final result, or `None` where it was cancelled or has none; earlier results it
    /// delivers through its third argument. `wake` is called from the thread after each result and at the end of each job.
    pub fn new(
        name: &str,
        wake: impl Fn() + Send + Sync + 'static,
        work: impl Fn(Q, &CancelToken, &(dyn Fn(R) + Sync)) -> Option<R> + Send + 'static,
    ) -> std::io::Result<Self> {
        let shared = Arc::new(Shared {
            slots: Mutex::new(Slots { inbox: None, running: None, delivered: false, outbox: None, closed: false }),
            changed: Condvar::new(),
        });
        let thread_shared = Arc::clone(&shared);
        let thread = std::thread::Builder::new().name(name.to_owned()).spawn(move || {
            while let Some((request, token)) = next_request(&thread_shared) {
                let deliver = |outcome: Outcome<R>| {
                    let mut slots = thread_shared.lock();
                    if !token.is_cancelled() {
                        slots.outbox = Some(outcome);
                        slots.delivered = true;
                        if slots.inbox.is_some() {
                            token.cancel();
                        }
                        drop(slots);
                        wake();
                    }
                };
                let run = AssertUnwindSafe(|| work(request, &token, &|result| deliver(Outcome::Done(result))));
                match catch_unwind(run) {
                    Ok(Some(result)) => deliver(Outcome::Done(result)),
                    Ok(None) => {}
                    Err(payload) => deliver(Outcome::Panicked(panic_message(payload.as_ref()))),
                }
                thread_shared.lock().running = None;
                // The thread that cancelled the job needs no notice of its end.
                if !token.is_cancelled() {
                    wake();
                }
            }
        })?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Submits `request`. The running job is cancelled, a waiting one replaced, and a result that was not taken dropped.
    pub fn request(&self, request: Q) -> CancelToken {
        let token = CancelToken::new();
        let mut slots = self.shared.lock();
        if let Some(running) = &slots.running {
            running.cancel();
        }
        slots.outbox = None;
        slots.inbox = Some((request, token.clone()));
        drop(slots);
        self.shared.changed.notify_all();
        token
    }

    /// Submits `request` to start once the running job has delivered a result; a waiting one is replaced. Where the running
    /// job has delivered one already, it is cancelled, because the rest of it only refines that result.
    pub fn queue(&self, request: Q) -> CancelToken {
        let token = CancelToken::new();
        let mut slots = self.shared.lock();
        if let Some(running) = slots.running.as_ref().filter(|_| slots.delivered) {
            running.cancel();
        }
        slots.inbox = Some((request, token.clone()));
        drop(slots);
        self.shared.changed.notify_all();
        token
    }

    /// Cancels the running job, and discards the waiting one and any result.
    pub fn cancel(&self) {
        let mut slots = self.shared.lock();
        if let Some(running) = &slots.running {
            running.cancel();
        }
        slots.inbox = None;
        slots.outbox = None;
    }

    /// Takes the newest result, if there is one. Never waits for the job.
    pub fn take(&self) -> Option<Outcome<R>> {
        self.shared.lock().outbox.take()
    }

    /// True if a job waits, or runs and is not cancelled.
    pub fn is_busy(&self) -> bool {
        let slots = self.shared.lock();
        slots.inbox.is_some() || slots.running.as_ref().is_some_and(|token| !token.is_cancelled())
    }
}

impl<Q, R> Drop for Worker<Q, R> {
    fn drop(&mut self) {
        let mut slots = self.shared.lock();
        slots.closed = true;
        slots.inbox = None;
        if let Some(running) = &slots.running {
            running.cancel();
        }
        drop(slots);
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            // Panics of jobs were caught and reported on the thread.
            let _ = thread.join();
        }
    }
}

/// Waits for a request and marks it as running; `None` once the worker is dropped.
fn next_request<Q, R>(shared: &Shared<Q, R>) -> Option<(Q, CancelToken)> {
    let mut slots = shared.lock();
    loop {
        if slots.closed {
            return None;
        }
        if let Some((request, token)) = slots.inbox.take() {
            slots.running = Some(token.clone());
            slots.delivered = false;
            return Some((request, token));
        }
        slots = shared.changed.wait(slots).unwrap_or_else(PoisonError::into_inner);
    }
}

/// The message of a panic.
fn panic_message(payload: &(dyn std::any::Any + Send)) -> String {
    payload
        .downcast_ref::<&str>()
        .map(|text| (*text).to_owned())
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "a worker panicked without a message".to_owned())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use std::sync::mpsc;
    use std::time::Duration;

    use super::*;

    /// Waits up to half a minute for a result, which is enough on a loaded machine.
    fn wait<Q: Send + 'static, R: Send + 'static>(worker: &Worker<Q, R>) -> Outcome<R> {
        for _ in 0..30_000 {
            if let Some(outcome) = worker.take() {
                return outcome;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        unreachable!("the worker never answered");
    }

    #[test]
    fn newest_of_two_hundred_requests_is_served() {
        let (started, is_started) = mpsc::channel();
        let (all_requested, go_on) = mpsc::channel::<()>();
        let worker = Worker::new(
            "test",
            || {},
            move |request: usize, token: &CancelToken, _: &(dyn Fn(usize) + Sync)| {
                started.send((request, token.clone())).unwrap();
                if request == 0 {
                    // Goes on although it is cancelled, as a job between two polls does.
                    go_on.recv().unwrap();
                }
                Some(request)
            },
        )
        .unwrap();
        worker.request(0);
        let (first, token) = is_started.recv().unwrap();
        assert!(first == 0 && !token.is_cancelled());
        for request in 1..200 {
            worker.request(request);
            assert!(token.is_cancelled(), "the running job is cancelled by request {request}");
        }
        assert!(is_started.try_recv().is_err(), "nothing else runs before the first job has ended");
        all_requested.send(()).unwrap();
        assert!(matches!(wait(&worker), Outcome::Done(199)), "the result of the cancelled job is dropped");
        assert!(worker.take().is_none());
        drop(worker);
        let started: Vec<usize> = is_started.iter().map(|(request, _)| request).collect();
        assert_eq!(started, [199], "each request replaces the one that waits");
    }

    #[test]
    fn result_of_a_cancelled_job_is_dropped() {
        let (started, is_started) = mpsc::channel();
        let worker = Worker::new(
            "test",
            || {},
            move |wait_for_cancel: bool, token: &CancelToken, _: &(dyn Fn(u8) + Sync)| {
                started.send(()).unwrap();
                while wait_for_cancel && !token.is_cancelled() {
                    std::thread::yield_now();
                }
                Some(7)
            },
        )
        .unwrap();
        worker.request(true);
        is_started.recv().unwrap();
        assert!(worker.is_busy());
        worker.cancel();
        assert!(!worker.is_busy());
        worker.request(false);
        assert!(matches!(wait(&worker), Outcome::Done(7)));
        assert!(worker.take().is_none(), "the cancelled job's result was dropped");
    }

    #[test]
    fn a_panic_is_reported_and_the_worker_goes_on() {
        let worker = Worker::new(
            "test",
            || {},
            |fails: bool, _: &CancelToken, _: &(dyn Fn(u8) + Sync)| {
                assert!(!fails, "on purpose");
                Some(1)
            },
        )
        .unwrap();
        worker.request(true);
        let Outcome::Panicked(text) = wait(&worker) else { unreachable!("the job panics") };
        assert!(text.contains("on purpose"), "{text}");
        worker.request(false);
        assert!(matches!(wait(&worker), Outcome::Done(1)));
    }

    #[test]
    fn queued_request_starts_after_the_first_result() {
        let (started, is_started) = mpsc::channel();
        let (taken, go_on) = mpsc::channel::<()>();
        let worker = Worker::new(
            "test",
            || {},
            move |request: u8, token: &CancelToken, deliver: &(dyn Fn(u8) + Sync)| {
                started.send(()).unwrap();
                go_on.recv().unwrap();
                deliver(request);
                // Refines the delivered result until cancelled.
                while request < 3 && !token.is_cancelled() {
                    std::thread::yield_now();
                }
                None
            },
        )
        .unwrap();
        worker.request(0);
        is_started.recv().unwrap();
        worker.queue(1);
        worker.queue(2);
        taken.send(()).unwrap();
        assert!(matches!(wait(&worker), Outcome::Done(0)), "the running job is not cancelled before its first result");
        assert!(worker.is_busy());
        taken.send(()).unwrap();
        assert!(matches!(wait(&worker), Outcome::Done(2)), "the newest queued request comes next");
        // The last job refines its result until this request cancels it.
        worker.queue(3);
        taken.send(()).unwrap();
        assert!(matches!(wait(&worker), Outcome::Done(3)));
    }

    #[test]
    fn dropping_a_running_worker_cancels_it() {
        let (started, is_started) = mpsc::channel();
        let (ended, is_ended) = mpsc::channel();
        let worker = Worker::new(
            "test",
            || {},
            move |(): (), token: &CancelToken, _: &(dyn Fn(()) + Sync)| {
                started.send(()).unwrap();
                while !token.is_cancelled() {
                    std::thread::yield_now();
                }
                ended.send(()).unwrap();
                None
            },
        )
        .unwrap();
        worker.request(());
        is_started.recv().unwrap();
        drop(worker);
        assert!(is_ended.try_recv().is_ok(), "drop waits until the job has stopped");
    }

    #[test]
    fn intermediate_results_arrive_before_the_last() {
        let (taken, go_on) = mpsc::channel::<()>();
        let worker = Worker::new(
            "test",
            || {},
            move |(): (), _: &CancelToken, deliver: &(dyn Fn(u8) + Sync)| {
                deliver(1);
                go_on.recv().unwrap();
                Some(2)
            },
        )
        .unwrap();
        worker.request(());
        assert!(matches!(wait(&worker), Outcome::Done(1)));
        taken.send(()).unwrap();
        assert!(matches!(wait(&worker), Outcome::Done(2)));
    }
}
