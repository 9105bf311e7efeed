//! The program in a real X11 window under Xvfb.

#![allow(clippy::pedantic, reason = "tests and measurements may be plainer than the libraries")]
#![cfg(all(feature = "gui", target_os = "linux"))]
#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]

#[path = "../support/mod.rs"]
mod support;

mod desktop;
mod screen;

mod documents;
mod end_to_end;
mod exchange;
mod faults;
mod screenshots;
