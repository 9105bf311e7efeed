//! The standard streams of a program that must not fail by them: each may be full, closed, slow or a pipe without a reader.
//!
//! Notes and log lines are queued and written as far as the stream takes them without waiting, so that a reader that is slow
//! never keeps the work waiting; [`finish`] waits for the rest. Knows nothing of what is printed.

mod input;
mod log;
mod output;
mod stream;
mod system;

pub use input::{open_input, standard_input};
pub use log::start_log;
pub use output::{Output, finish, is_error_ready, note, printable_json, printable_lines, stop_waiting};
