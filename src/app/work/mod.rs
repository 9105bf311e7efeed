//! What follows the settings: workers that load, build, render and measure, and what takes their results.

pub(crate) mod wake_signal;

pub(crate) mod file_watch;
pub(crate) mod frame_pacing;
pub(crate) mod jobs;
pub mod reconcile;
pub(crate) mod results;

pub(crate) mod derived_worker;
pub(crate) mod measure_worker;

pub(crate) mod requests;
