//! Thread pool of a worker.

use std::cell::RefCell;
use std::sync::Arc;

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::lab::available_threads;

/// A rayon thread pool that is reused until another number of threads is requested.
#[derive(Default)]
pub(crate) struct WorkerPool {
    current: RefCell<Option<(usize, Arc<ThreadPool>)>>,
}

impl WorkerPool {
    /// Runs `work` in a pool of `threads` threads (0 for all), or of as many as the system grants. The threads are named
    /// after `name`.
    pub(crate) fn run<R: Send>(&self, name: &'static str, threads: usize, work: impl FnOnce() -> R + Send) -> R {
        let mut current = self.current.borrow_mut();
        if current.as_ref().is_none_or(|(count, _)| *count != threads) {
            let named = || ThreadPoolBuilder::new().thread_name(move |i| format!("{name} {i}"));
            let built = match named().num_threads(threads).build() {
                Ok(pool) => Some(pool),
                Err(error) => build_smaller_pool(named, threads, &error),
            };
            // A thread that has become a pool itself cannot join another one, so the previous pool stays in use.
            if let Some(pool) = built {
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

/// A pool of fewer threads than the `requested` ones, which the system refused; of the calling thread alone where it grants
/// none.
fn build_smaller_pool(
    named: impl Fn() -> ThreadPoolBuilder,
    requested: usize,
    refusal: &rayon::ThreadPoolBuildError,
) -> Option<ThreadPool> {
    let requested = if requested == 0 { available_threads() } else { requested };
    let halves = std::iter::successors(Some(requested / 2), |count| Some(count / 2)).take_while(|&count| count > 0);
    let pool = halves
        .map(|count| named().num_threads(count).build())
        .find_map(Result::ok)
        .or_else(|| named().num_threads(1).use_current_thread().build().ok());
    let threads = pool.as_ref().map_or(1, ThreadPool::current_num_threads);
    log::warn!("{requested} threads cannot be started ({refusal}); working with {threads}");
    pool
}
