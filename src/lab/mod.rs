//! The measuring jobs: pure functions from scenes and settings to rows, each row handed out as soon as it is there. No
//! window, no files: the command line and the window's panels show the same rows.

mod measurement;

pub use measurement::{Measurement, millis, pool};
