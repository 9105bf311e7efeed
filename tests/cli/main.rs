//! The commands, run as processes: flags, exit codes, output, files, signals.

#![allow(clippy::pedantic, reason = "tests and measurements may be plainer than the libraries")]
#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]

#[path = "../support/mod.rs"]
mod support;

#[cfg(all(target_os = "linux", feature = "gui"))]
mod bookmarks;
mod commands;
#[cfg(unix)]
mod interrupting;
#[cfg(unix)]
mod overwriting;
#[cfg(target_os = "linux")]
mod streams;
#[cfg(target_os = "linux")]
mod threads;
