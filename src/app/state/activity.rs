//! Running jobs, tracing speed, the results of measurements, and messages to the user.

use std::collections::{HashMap, VecDeque};
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

/// Maximum number of messages in the history.
const MAX_HISTORY: usize = 200;

/// Severity of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Severity {
    /// Good to know; fades by itself.
    Info,
    /// Something was skipped or limited.
    Warning,
    /// Something failed; stays until closed.
    Error,
}

impl Severity {
    /// The word in front of the text.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Info => "Note",
            Self::Warning => "Warning",
            Self::Error => "Error",
        }
    }
}

/// A message to the user.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    /// How serious it is.
    pub severity: Severity,
    /// What happened, where, why, and what to do about it.
    pub text: String,
    /// When it was posted.
    pub since: Instant,
}

/// All messages of this run.
#[derive(Debug, Default)]
pub struct MessageLog {
    /// Messages that have neither faded nor been closed, oldest first.
    pub open: Vec<Message>,
    /// The newest messages, closed or not, oldest first.
    pub history: VecDeque<Message>,
}

impl MessageLog {
    /// Posts a message.
    pub fn notify(&mut self, severity: Severity, text: impl Into<String>) {
        let message = Message { severity, text: text.into(), since: Instant::now() };
        if self.history.len() == MAX_HISTORY {
            self.history.pop_front();
        }
        self.history.push_back(message.clone());
        self.open.push(message);
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
