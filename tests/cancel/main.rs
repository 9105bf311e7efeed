//! Cancelling: every job stops at each poll of its token, and polls often enough whatever the size of its input.

#![allow(clippy::pedantic, reason = "tests and measurements may be plainer than the libraries")]
#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]

mod every_poll;
mod latency;
