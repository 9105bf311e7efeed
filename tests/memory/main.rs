//! Memory of the whole process. A program of its own, because its allocator counts for all threads; one test runs at a time.

#![allow(clippy::pedantic, reason = "tests and measurements may be plainer than the libraries")]
#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]

use std::sync::{Mutex, MutexGuard, PoisonError};

use peak_alloc::PeakAlloc;

#[path = "../support/mod.rs"]
mod support;

mod after_cancel;
#[cfg(target_os = "linux")]
mod peak;

#[global_allocator]
static COUNTED: PeakAlloc = PeakAlloc;

/// Keeps the other tests of this program from allocating.
fn alone() -> MutexGuard<'static, ()> {
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner)
}
