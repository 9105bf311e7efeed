//! Measuring jobs: pure functions from scenes and settings to [`Measurement`] rows, with tables, plots and diagnosis of them.
//!
//! Knows no window, no wgpu and no files; the command line and the window show the same rows. Start at [`Job`], then read
//! [`measure()`].

mod measurement;
mod setup;
mod trial;

mod measure;

mod bench;
mod compare;
mod scaling;
mod sweep;

mod job;

#[cfg(test)]
mod sample;

pub mod paper;

pub mod diagnose;

pub mod plot;
pub mod report_table;
pub mod rows;

pub use bench::bench;
pub use compare::{compare, compared_setups};
pub use job::Job;
pub use measure::{LabError, measure};
pub use measurement::{Measurement, available_threads, millis, pool};
pub use scaling::scaling;
pub use setup::{Setup, Subject, TraceView};
pub use sweep::{SweepPlan, SweepPoint, sweep};
