//! Work on a pool of threads, while the calling thread waits without holding the interpreter and watches for Ctrl-C.

use std::any::Any;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use bvhscope_engine::CancelToken;
use pyo3::{PyResult, Python};
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::{Failure, value_error};

/// Interval at which the waiting thread looks for signals.
const SIGNAL_INTERVAL: Duration = Duration::from_millis(20);

/// Most threads of a pool.
const MAX_THREADS: usize = 1024;

/// Pools by the number of threads that was asked for, of one process.
struct Pools {
    process: u32,
    pools: BTreeMap<usize, Arc<ThreadPool>>,
}

/// The pools of this process, each made when it is first needed.
static POOLS: Mutex<Pools> = Mutex::new(Pools { process: 0, pools: BTreeMap::new() });

/// The number of threads in the argument `threads`: 0 stands for all cores.
pub(crate) fn thread_count(threads: i64) -> PyResult<usize> {
    usize::try_from(threads)
        .ok()
        .filter(|&count| count <= MAX_THREADS)
        .ok_or_else(|| value_error("threads", format!("{threads}: give 0 for all cores, or up to {MAX_THREADS}")))
}

/// The pool of `threads` threads.
fn pool(threads: usize) -> PyResult<Arc<ThreadPool>> {
    let mut known = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if known.process != process {
        // A fork copies the pools but not their threads. Dropping such a pool would wait for locks that these held.
        std::mem::forget(std::mem::take(&mut known.pools));
        known.process = process;
    }
    if let Some(pool) = known.pools.get(&threads) {
        return Ok(Arc::clone(pool));
    }
    let builder = ThreadPoolBuilder::new().num_threads(threads).thread_name(|index| format!("bvhscope {index}"));
    let pool = builder.build().map_err(|error| value_error("threads", format!("{threads}: {error}: give fewer")))?;
    Ok(Arc::clone(known.pools.entry(threads).or_insert_with(|| Arc::new(pool))))
}

/// The result of `work`, done by a pool of `threads` threads, 0 for all cores. Other threads of Python run meanwhile.
///
/// Ctrl-C raises its exception at once and cancels the token; the pool drops what it was working on at its next check.
pub(crate) fn run<T: Send + 'static>(
    py: Python<'_>,
    threads: usize,
    work: impl FnOnce(&CancelToken) -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    let pool = pool(threads)?;
    let (sender, receiver) = sync_channel(1);
    let token = CancelToken::new();
    let of_worker = token.clone();
    pool.spawn(move || {
        // After Ctrl-C nobody waits for it.
        let _ = sender.send(guarded(|| work(&of_worker)));
    });
    py.detach(move || {
        loop {
            match receiver.recv_timeout(SIGNAL_INTERVAL) {
                Ok(result) => return Ok(result?),
                Err(RecvTimeoutError::Timeout) => watch_signals(&token)?,
                Err(RecvTimeoutError::Disconnected) => return Err(Failure::Bug("a thread ended".to_owned()).into()),
            }
        }
    })
}

/// Runs the handlers of signals that have arrived; what one raises cancels the work.
fn watch_signals(token: &CancelToken) -> PyResult<()> {
    Python::attach(|py| py.check_signals().inspect_err(|_| token.cancel()))
}

/// The result of short `work` on the calling thread: starting other threads would take longer.
pub(crate) fn run_here<T>(work: impl FnOnce(&CancelToken) -> Result<T, Failure>) -> PyResult<T> {
    Ok(guarded(|| work(&CancelToken::new()))?)
}

/// The result of `work`, or its panic as a failure.
fn guarded<T>(work: impl FnOnce() -> Result<T, Failure>) -> Result<T, Failure> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| Err(Failure::Bug(message(&*panic))))
}

/// The message of a panic.
fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("a panic").to_owned()
}
