//! A worker whose newest request wins: a named thread with a one-slot inbox and a one-slot outbox. Knows no engine type.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use crate::cancel::CancelToken;

/// How a job ended.
#[derive(Debug)]
pub enum Outcome<T> {
    /// It ran to its end; a cancelled job is dropped and never comes out.
    Done(T),
    /// It panicked: a bug, with the panic's message. The worker lives on.
    Panicked(String),
}

struct Slots<Q, R> {
    inbox: Option<(Q, CancelToken)>,
    running: Option<CancelToken>,
    outbox: Option<Outcome<R>>,
    closed: bool,
}

struct Shared<Q, R> {
    slots: Mutex<Slots<Q, R>>,
    changed: Condvar,
}

impl<Q, R> Shared<Q, R> {
    /// The slots; a panic elsewhere never makes them unusable, because nothing panics while they are half changed.
    fn lock(&self) -> MutexGuard<'_, Slots<Q, R>> {
        self.slots.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// One thread that works on the newest of the requests of type `Q` and gives results of type `R`.
pub struct Worker<Q, R> {
    shared: Arc<Shared<Q, R>>,
    thread: Option<JoinHandle<()>>,
}

impl<Q: Send + 'static, R: Send + 'static> Worker<Q, R> {
    /// Starts the thread. `work` returns `None` where it was cancelled; it may also send results on its way through the
    /// function that it is given. `wake` is called after each result, from the worker's thread.
    pub fn new(
        name: &str,
        wake: impl Fn() + Send + Sync + 'static,
        work: impl Fn(Q, &CancelToken, &(dyn Fn(R) + Sync)) -> Option<R> + Send + 'static,
    ) -> std::io::Result<Self> {
        let shared = Arc::new(Shared {
            slots: Mutex::new(Slots { inbox: None, running: None, outbox: None, closed: false }),
            changed: Condvar::new(),
        });
        let theirs = Arc::clone(&shared);
        let thread = std::thread::Builder::new().name(name.to_owned()).spawn(move || {
            while let Some((request, token)) = next_request(&theirs) {
                let deliver = |outcome: Outcome<R>| {
                    let mut slots = theirs.lock();
                    if !token.is_cancelled() {
                        slots.outbox = Some(outcome);
                        drop(slots);
                        wake();
                    }
                };
                let run = AssertUnwindSafe(|| work(request, &token, &|part| deliver(Outcome::Done(part))));
                match catch_unwind(run) {
                    Ok(Some(result)) => deliver(Outcome::Done(result)),
                    Ok(None) => {}
                    Err(payload) => deliver(Outcome::Panicked(panic_message(payload.as_ref()))),
                }
                theirs.lock().running = None;
                wake();
            }
        })?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Asks for `request`, cancelling what runs and replacing what waits. A result not yet taken is dropped.
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

    /// Stops what runs and forgets what waits.
    pub fn cancel(&self) {
        let mut slots = self.shared.lock();
        if let Some(running) = &slots.running {
            running.cancel();
        }
        slots.inbox = None;
        slots.outbox = None;
    }

    /// Takes the newest result, if there is one. Never blocks on the work.
    pub fn take(&self) -> Option<Outcome<R>> {
        self.shared.lock().outbox.take()
    }

    /// Whether something runs or waits.
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
            // The thread caught every panic of its work; nothing is left to report.
            let _ = thread.join();
        }
    }
}

fn next_request<Q, R>(shared: &Shared<Q, R>) -> Option<(Q, CancelToken)> {
    let mut slots = shared.lock();
    loop {
        if slots.closed {
            return None;
        }
        if let Some((request, token)) = slots.inbox.take() {
            slots.running = Some(token.clone());
            return Some((request, token));
        }
        slots = shared.changed.wait(slots).unwrap_or_else(PoisonError::into_inner);
    }
}

/// The text of a panic, where it has one.
fn panic_message(payload: &(dyn std::any::Any + Send)) -> String {
    payload
        .downcast_ref::<&str>()
        .map(|text| (*text).to_owned())
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "a worker failed without saying why".to_owned())
}
