//! Running jobs, tracing speed and the results of measurements.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use crate::app::state::action::Request;
use crate::app::state::paper::{Experiment, PaperResult};

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
    /// SAH cost after each round of annealing, with the time since its beginning.
    pub costs: Vec<(Duration, f64)>,
}

impl JobStatus {
    /// Time that the rest is expected to take at the present pace; `None` before enough is done to tell.
    pub fn time_left(&self, now: Instant) -> Option<Duration> {
        let taken = now.saturating_duration_since(self.since);
        let is_known = taken >= Duration::from_secs(1) && (0.02..1.0).contains(&self.progress);
        is_known.then(|| taken.mul_f32((1.0 - self.progress) / self.progress))
    }
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
    /// The measurement of the view "Paper", running or waiting.
    pub measure: Option<JobStatus>,
    /// What the view "Paper" has measured, by experiment.
    pub measured: HashMap<Experiment, PaperResult>,
    /// The first running background study.
    pub study: Option<JobStatus>,
    /// The running studies are to be stopped.
    pub stop_study: bool,
    /// Effects to perform after this UI frame.
    pub requests: Vec<Request>,
    /// Median tracing speed of the last second in Mray/s.
    pub mrays_per_s: f64,
}

impl Activity {
    /// Whether any job runs or waits.
    pub const fn has_jobs(&self) -> bool {
        self.load.is_some()
            || self.build.is_some()
            || self.render.is_some()
            || self.measure.is_some()
            || self.study.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_follows_from_the_pace() {
        let since = Instant::now();
        let job = |progress| JobStatus { label: String::new(), progress, since, costs: Vec::new() };
        let after =
            |progress, secs| job(progress).time_left(since + Duration::from_secs(secs)).map(|left| left.as_secs());
        assert_eq!(after(0.25, 10), Some(30));
        assert_eq!([after(0.001, 10), after(0.5, 0), after(1.0, 10)], [None; 3], "too early or too late to tell");
    }
}
