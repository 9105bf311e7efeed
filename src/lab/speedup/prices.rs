//! The price of a fork on this machine, measured.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rayon::ThreadPool;

/// Forks timed together, of which one takes some ten nanoseconds.
const FORKS: u32 = 1 << 12;
/// Repetitions, of which the fastest counts.
const REPETITIONS: usize = 16;
/// Steals of each kind, of which the fastest counts, because other programs delay the others.
const STEALS: usize = 128;
/// Time within which another thread takes a task, or is kept from it by other programs.
const STEAL_LIMIT: Duration = Duration::from_millis(5);
/// Time after which the threads of a pool sleep surely.
const REST: Duration = Duration::from_millis(1);

/// Time in seconds of a fork of which no thread takes a part, in a `pool` of one thread.
pub fn fork_price(pool: &ThreadPool) -> f64 {
    let once = || {
        let start = Instant::now();
        for _ in 0..FORKS {
            rayon::join(|| std::hint::black_box(()), || std::hint::black_box(()));
        }
        start.elapsed().as_secs_f64() / f64::from(FORKS)
    };
    pool.install(|| (0..REPETITIONS).map(|_| once()).fold(f64::INFINITY, f64::min))
}

/// Times in seconds until another thread of `pool`, which has two, has begun a task: where it was idle for a moment, and where it
/// slept. `None` where other programs kept it from that.
pub fn steal_prices(pool: &ThreadPool) -> Option<[f64; 2]> {
    let fastest = |rest: Option<Duration>| {
        let latencies = (0..STEALS).filter_map(|_| {
            if let Some(rest) = rest {
                std::thread::sleep(rest);
            }
            pool.install(steal)
        });
        latencies.reduce(f64::min)
    };
    let prices = [fastest(None)?, fastest(Some(REST))?];
    Some([prices[0].min(prices[1]), prices[1]])
}

/// Time in seconds from a fork until another thread has begun its second task.
fn steal() -> Option<f64> {
    let is_taken = AtomicBool::new(false);
    let start = Instant::now();
    let wait = || {
        while !is_taken.load(Ordering::Acquire) && start.elapsed() < STEAL_LIMIT {
            std::hint::spin_loop();
        }
    };
    let take = || {
        is_taken.store(true, Ordering::Release);
        start.elapsed()
    };
    let ((), latency) = rayon::join(wait, take);
    (latency < STEAL_LIMIT).then_some(latency.as_secs_f64())
}
