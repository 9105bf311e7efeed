//! Running jobs, tracing speed and the results of measurements.

use std::time::{Duration, Instant};

use crate::app::state::paper::PaperResult;

/// Delay after a job's request before its progress is shown.
pub const PROGRESS_DELAY: Duration = Duration::from_millis(400);

/// A running job, as the job strip shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct JobStatus {
    /// "Loading bunny.obj", "Building", "Tracing".
    pub label: String,
    /// Completed fraction, 0 to 1.
    pub progress: f32,
    /// When it was requested.
    pub since: Instant,
}

/// What the workers are doing.
#[derive(Debug, Clone, Default)]
pub struct Activity {
    /// The model being loaded.
    pub load: Option<JobStatus>,
    /// The tree being built.
    pub build: Option<JobStatus>,
    /// The picture being traced.
    pub render: Option<JobStatus>,
    /// The measurement of the paper panel, running or waiting.
    pub measure: Option<JobStatus>,
    /// What the paper panel has measured.
    pub measured: Option<PaperResult>,
    /// Median tracing speed of the last second in Mray/s.
    pub mrays_per_s: f64,
}

impl Activity {
    /// Whether any job runs or waits.
    pub const fn has_jobs(&self) -> bool {
        self.load.is_some() || self.build.is_some() || self.render.is_some() || self.measure.is_some()
    }
}
