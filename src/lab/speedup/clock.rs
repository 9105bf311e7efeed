//! The clock by which tasks are timed.

use std::time::Duration;

/// Time for which the calling thread was running: other programs that take its core do not count.
#[cfg(unix)]
pub fn thread_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    Duration::try_from(time).unwrap_or_default()
}

/// Time since the first call: this system has no clock of threads that is as fine.
#[cfg(not(unix))]
pub fn thread_time() -> Duration {
    static FIRST: std::sync::LazyLock<std::time::Instant> = std::sync::LazyLock::new(std::time::Instant::now);
    FIRST.elapsed()
}
