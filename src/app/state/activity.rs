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
    /// Interval between two updates of the progress bars.
    pub const INTERVAL: Duration = Duration::from_millis(100);

    /// Delay of the next UI frame that shows the progress of a job requested at `since`. Short jobs show none, because drawing a UI frame
    /// takes time from them.
    pub fn next_update(since: Instant, now: Instant) -> Duration {
        PROGRESS_DELAY.saturating_sub(now.saturating_duration_since(since)).max(Self::INTERVAL)
    }

    /// Time that the rest is expected to take at the present pace; `None` before enough is done to tell.
    pub fn time_left(&self, now: Instant) -> Option<Duration> {
        let taken = now.saturating_duration_since(self.since);
        let is_known = taken >= Duration::from_secs(1) && (0.02..1.0).contains(&self.progress);
        is_known.then(|| taken.mul_f32((1.0 - self.progress) / self.progress))
    }
}

/// Jobs of the workers.
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
    /// The experiment that it measures.
    pub experiment: Option<Experiment>,
    /// Measurements of the view "Paper", by experiment.
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
    /// Something was skipped or limited; folds into the count of the status bar.
    Warning,
    /// Something failed; folds as well.
    Error,
}

impl Severity {
    /// Time for which a message is shown over the viewport.
    pub const fn shown_for(self) -> Duration {
        match self {
            Self::Info => Duration::from_secs(4),
            Self::Warning | Self::Error => Duration::from_secs(10),
        }
    }

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
    /// Event, place, reason and remedy.
    pub text: String,
    /// When it was posted.
    pub since: Instant,
}

impl Message {
    /// Time for which it remains over the viewport; zero when that is over.
    pub fn left(&self) -> Duration {
        self.severity.shown_for().saturating_sub(self.since.elapsed())
    }
}

/// All messages of this run.
#[derive(Debug, Default)]
pub struct MessageLog {
    /// Messages that have neither faded, folded nor been closed, oldest first.
    pub open: Vec<Message>,
    /// Numbers of warnings and errors that folded since the list of all messages was open.
    pub folded: [usize; 2],
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

    /// Takes down what was shown long enough. Notes vanish; warnings and errors are counted.
    pub fn fold(&mut self) {
        self.open.retain(|message| {
            let remains = !message.left().is_zero();
            match message.severity {
                Severity::Info => {}
                Severity::Warning => self.folded[0] += usize::from(!remains),
                Severity::Error => self.folded[1] += usize::from(!remains),
            }
            remains
        });
    }

    /// Takes down the errors, since what failed has succeeded.
    pub fn forget_errors(&mut self) {
        self.open.retain(|message| message.severity != Severity::Error);
        self.folded[1] = 0;
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

    #[test]
    fn the_first_progress_comes_late_and_the_next_regularly() {
        let since = Instant::now();
        let delay = |millis| JobStatus::next_update(since, since + Duration::from_millis(millis)).as_millis();
        assert_eq!([0, 250, 400, 5_000].map(delay), [400, 150, 100, 100]);
    }

    #[test]
    fn what_was_shown_long_enough_is_counted_unless_it_was_a_note() {
        let mut log = MessageLog::default();
        for severity in [Severity::Info, Severity::Warning, Severity::Error, Severity::Error] {
            log.notify(severity, "");
        }
        log.fold();
        assert_eq!((log.open.len(), log.folded), (4, [0, 0]), "all are new");
        let Some(before) = Instant::now().checked_sub(Duration::from_secs(11)) else { return };
        log.open[..3].iter_mut().for_each(|message| message.since = before);
        log.fold();
        assert_eq!((log.open.len(), log.folded, log.history.len()), (1, [1, 1], 4));
        log.forget_errors();
        assert_eq!((log.open.len(), log.folded), (0, [1, 0]), "the warning is not about what succeeded");
    }
}
