//! Thread pool of a worker.

use std::cell::RefCell;
use std::sync::Arc;

use rayon::ThreadPool;

use crate::threads::{count, pool_of_granted};

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
