//! Measurements for the view "Paper", on a worker of their own. A measurement starts once loading, building and tracing have
//! finished, because they would slow it down.

use std::sync::Arc;
use std::time::Instant;

use crate::app::state::paper::{Experiment, PaperResult};
use crate::app::state::{AppState, JobStatus, Severity};
use crate::app::studies::latest::{Latest, Polled};
use crate::console::note;
use crate::lab::{Job, LabError, Measurement, RowSink, Subject, TraceView};
use crate::scene::Scene;
use crate::worker::Worker;
use bvhscope_engine::cancel::CancelToken;

/// A measurement on one model.
struct MeasureJob {
    subject: Subject,
    job: Job,
    view: TraceView,
}

/// The rows measured so far.
struct Measured {
    rows: Vec<Measurement>,
    /// How the job ended, `None` while it runs; the error states why nothing more can be measured.
    end: Option<Result<(), String>>,
}

/// Delivers rows after each repetition.
struct Delivered<'a> {
    rows: Vec<Measurement>,
    deliver: &'a (dyn Fn(Measured) + Sync),
}

impl RowSink for Delivered<'_> {
    fn row(&mut self, row: Measurement) {
        self.rows.push(row);
        (self.deliver)(Measured { rows: self.rows.clone(), end: None });
    }

    fn preliminary(&mut self, rows: Vec<Measurement>) {
        (self.deliver)(Measured { rows: [&self.rows[..], &rows].concat(), end: None });
    }
}

/// A requested measurement that has not ended.
struct Current {
    experiment: Experiment,
    scene: Arc<Scene>,
    /// When it was requested.
    since: Instant,
    /// Number of rows measured so far.
    rows: usize,
    /// The job until it is started.
    waiting: Option<MeasureJob>,
}

/// Measures what the view "Paper" requests.
pub(crate) struct MeasureWorker {
    latest: Latest<(), MeasureJob, Measured>,
    current: Option<Current>,
}

impl MeasureWorker {
    /// Starts the worker; `wake` is called from its thread after each row.
    pub(crate) fn new(wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Self> {
        let worker = Worker::new(
            "measure",
            wake,
            |job: MeasureJob, token: &CancelToken, deliver: &(dyn Fn(Measured) + Sync)| {
                let mut rows = Delivered { rows: Vec::new(), deliver };
                let outcome = job.job.run(&job.subject, (0, 1), &job.view, token, &mut rows);
                let rows = rows.rows;
                let end = match outcome {
                    Ok(()) => Ok(()),
                    Err(LabError::Cancelled(_)) => return None,
                    Err(LabError::Refused(reason)) => Err(reason),
                };
                Some(Measured { rows, end: Some(end) })
            },
        )?;
        Ok(Self { latest: Latest::new(worker), current: None })
    }

    /// Requests what the panel's plan describes, on the loaded model. Replaces the current measurement.
    pub(crate) fn measure(&mut self, state: &mut AppState) {
        let Some(scene) = state.model.loaded.clone() else {
            state.messages.notify(Severity::Warning, "There is no model to measure yet");
            return;
        };
        self.stop();
        let plan = &state.preferences.paper;
        let job = MeasureJob {
            subject: Subject {
                model: scene.source.to_string(),
                scene: Arc::clone(&scene),
                trees: state.trees_from_files(&scene),
                rays: None,
                load: state.model.load_options.clone(),
                forms: Vec::new(),
            },
            job: plan.job(&state.wanted),
            view: plan.view(&scene, &state.wanted),
        };
        self.current =
            Some(Current { experiment: plan.experiment, scene, since: Instant::now(), rows: 0, waiting: Some(job) });
    }

    /// Cancels the current measurement; finished rows remain.
    pub(crate) fn cancel(&mut self, state: &mut AppState) {
        self.take_rows(state);
        if let Some(rows) = self.current.as_ref().map(|current| current.rows) {
            self.stop();
            let noun = if rows == 1 { "row stays" } else { "rows stay" };
            state.messages.notify(Severity::Info, format!("Measuring cancelled: {rows} {noun}"));
        }
        state.activity.measure = None;
    }

    /// Takes finished rows, and starts a waiting measurement once the other workers are `idle`.
    pub(crate) fn poll(&mut self, state: &mut AppState, idle: bool) {
        self.take_rows(state);
        if let Some(current) = &mut self.current {
            let same = state.model.loaded.as_ref().is_some_and(|scene| Arc::ptr_eq(scene, &current.scene));
            if !same {
                self.stop();
                state.messages.notify(Severity::Info, "Measuring stopped: another model was opened");
            } else if idle && let Some(job) = current.waiting.take() {
                self.latest.request((), job, Instant::now());
            }
        }
        state.activity.experiment = self.current.as_ref().map(|current| current.experiment);
        state.activity.measure = self.current.as_ref().map(|Current { scene, since, .. }| {
            let label = format!("Measuring {}", scene.source.label());
            // Costs of annealing are those of the tree that is built for the screen.
            let running = self.latest.status(label.clone()).map(|status| JobStatus { costs: Vec::new(), ..status });
            running.unwrap_or(JobStatus { label, progress: 0.0, since: *since, costs: Vec::new() })
        });
    }

    /// Whether a measurement runs or waits.
    pub(crate) fn is_busy(&self) -> bool {
        self.current.is_some()
    }

    fn stop(&mut self) {
        self.latest.stop();
        self.current = None;
    }

    fn take_rows(&mut self, state: &mut AppState) {
        let Some(current) = &mut self.current else { return };
        match self.latest.poll() {
            Polled::Running => {}
            Polled::Result(Measured { rows, end }) => {
                let finished = matches!(end, Some(Ok(())));
                let (experiment, scene) = (current.experiment, Arc::clone(&current.scene));
                current.rows = rows.len();
                // Those of an earlier measurement stay until there is something in their place.
                if !rows.is_empty() {
                    let result = PaperResult::new(experiment, scene, rows, finished);
                    state.activity.measured.insert(experiment, result);
                }
                if let Some(Err(reason)) = &end {
                    state.messages.notify(Severity::Warning, format!("This cannot be measured: {reason}"));
                }
                if end.is_some() {
                    self.latest.finish(&());
                    self.current = None;
                }
            }
            Polled::Failed(Some(text)) => {
                self.current = None;
                note(format_args!("error: measuring failed: {text}"));
                state
                    .messages
                    .notify(Severity::Error, format!("Measuring failed through a mistake in this program: {text}"));
            }
            Polled::Failed(None) => self.current = None,
        }
    }
}
