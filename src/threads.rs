//! How many threads the program works with, and rayon's pools of them.
//!
//! Every pool gets an explicit number of threads, never rayon's default: that is an environment variable, which may name
//! more than the machine can bear.

use std::sync::mpsc::{Sender, channel};

use rayon::{ThreadBuilder, ThreadPool, ThreadPoolBuilder};

/// Number of threads that run in parallel: the cores that this process may use, by its affinity and its control group's quota.
pub fn available_threads() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

/// The number of threads to work with if `requested` are wanted (0 for all): more than there are cores would only take
/// turns.
pub fn count(requested: usize) -> usize {
    let available = available_threads();
    if requested == 0 { available } else { requested.min(available) }
}

/// A pool of [`count`]`(requested)` threads; the error is a message for the user.
pub fn pool(requested: usize) -> Result<ThreadPool, String> {
    let count = count(requested);
    ThreadPoolBuilder::new()
        .num_threads(count)
        .thread_name(|index| format!("bvhscope-{index}"))
        .build()
        .map_err(|error| format!("{count} threads cannot be started ({error}): ask for fewer with --threads"))
}

/// As [`pool`], of threads named after `name`, or of as many as the system grants, in the end of the calling thread alone. Also
/// gives the reason why there are fewer. `None` where the calling thread cannot be alone, as it is in a pool already.
pub fn pool_of_granted(name: &'static str, requested: usize) -> (Option<ThreadPool>, Option<String>) {
    let (builder, threads, note) = granted(name, requested);
    (builder.spawn_handler(hand_over(threads)).build().ok(), note)
}

/// Starts rayon's global pool of [`count`]`(requested)` threads, or of as many as the system grants, in the end of the calling
/// thread alone. Returns why there are fewer. To be called once, before anything else of rayon.
pub fn start_global_pool(name: &'static str, requested: usize) -> Option<String> {
    let (builder, threads, note) = granted(name, requested);
    match builder.spawn_handler(hand_over(threads)).build_global() {
        Ok(()) => note,
        Err(error) => Some(format!("the thread pool cannot be started: {error}")),
    }
}

/// Threads that wait to become part of a pool. They are started before it, because rayon's global pool can be tried only once.
type WaitingThreads = Vec<Sender<ThreadBuilder>>;

fn granted(name: &'static str, requested: usize) -> (ThreadPoolBuilder, WaitingThreads, Option<String>) {
    let count = count(requested);
    let mut threads = WaitingThreads::new();
    let mut refusal = None;
    while threads.len() < count && refusal.is_none() {
        let (sender, receiver) = channel::<ThreadBuilder>();
        let wait = move || {
            if let Ok(thread) = receiver.recv() {
                thread.run();
            }
        };
        match std::thread::Builder::new().name(format!("{name} {}", threads.len())).spawn(wait) {
            Ok(_) => threads.push(sender),
            Err(error) => refusal = Some(error),
        }
    }
    let note = refusal.map(|error| {
        // The others are left to whoever needs one besides, as decoders of images.
        threads.truncate(threads.len().div_ceil(2));
        let with = if threads.is_empty() { "without".to_owned() } else { format!("with {}", threads.len()) };
        format!("{count} threads cannot be started ({error}); working {with}")
    });
    let builder = ThreadPoolBuilder::new().num_threads(threads.len().max(1));
    let builder = if threads.is_empty() { builder.use_current_thread() } else { builder };
    (builder, threads, note)
}

/// Makes each of `threads` run what rayon would start a thread for.
fn hand_over(threads: WaitingThreads) -> impl FnMut(ThreadBuilder) -> std::io::Result<()> {
    let mut threads = threads.into_iter();
    move |thread| {
        let waiting = threads.next().ok_or_else(|| std::io::Error::other("no thread is left"))?;
        waiting.send(thread).map_err(|_| std::io::Error::other("a thread has ended"))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn pools_have_no_more_threads_than_there_are_cores() {
        let available = available_threads();
        for (requested, expected) in [(0, available), (1, 1), (usize::MAX, available)] {
            assert_eq!(pool(requested).unwrap().current_num_threads(), expected);
            let (pool, note) = pool_of_granted("test", requested);
            assert_eq!((pool.unwrap().install(rayon::current_num_threads), note), (expected, None));
        }
    }
}
