//! Measuring for the paper panel: a worker of its own, started when the picture is at rest, because whatever else runs
//! would be measured as well.

use std::sync::Arc;
use std::time::Instant;

use crate::app::state::paper::{Experiment, PaperResult};
use crate::app::state::{AppState, JobStatus, Severity};
use crate::lab::{Job, LabError, Measurement, Subject, TraceView};
use crate::scene::Scene;
use crate::worker::{Outcome, Worker};
use bvhscope_engine::cancel::CancelToken;

/// A job on one model.
struct Order {
    subject: Subject,
    job: Job,
    view: TraceView,
}

/// The rows so far.
struct News {
    rows: Vec<Measurement>,
    /// How the job ended; the text says why nothing more can be measured.
    end: Option<Result<(), String>>,
}

/// A job that was asked for and has not ended.
struct Running {
    experiment: Experiment,
    scene: Arc<Scene>,
    label: String,
    since: Instant,
    token: CancelToken,
    /// It waits here until the picture is at rest.
    order: Option<Order>,
}

/// The worker, and what is known of its job.
pub struct MeasureWorker {
    worker: Worker<Order, News>,
    running: Option<Running>,
}

impl MeasureWorker {
    /// Starts the worker; `wake` is called from its thread whenever there is news.
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Self> {
        let worker = Worker::new("lab", wake, |order: Order, token: &CancelToken, deliver: &(dyn Fn(News) + Sync)| {
            let mut rows: Vec<Measurement> = Vec::new();
            let outcome = order.job.run(&order.subject, (0, 1), &order.view, token, &mut |row| {
                rows.push(row);
                deliver(News { rows: rows.clone(), end: None });
            });
            let end = match outcome {
                Ok(()) => Ok(()),
                Err(LabError::Cancelled(_)) => return None,
                Err(LabError::Refused(why)) => Err(why),
            };
            Some(News { rows, end: Some(end) })
        })?;
        Ok(Self { worker, running: None })
    }

    /// Asks for what the panel's plan describes, on the model that is open.
    pub fn measure(&mut self, state: &mut AppState) {
        let Some(scene) = state.model.loaded.clone() else {
            state.messages.notify(Severity::Warning, "There is no model to measure yet");
            return;
        };
        self.stop();
        let plan = &state.preferences.paper;
        let order = Order {
            subject: Subject { model: scene.source.to_string(), scene: Arc::clone(&scene) },
            job: plan.job(&state.wanted),
            view: plan.view(&scene, &state.wanted),
        };
        state.activity.measured = None;
        self.running = Some(Running {
            experiment: plan.experiment,
            label: format!("Measuring {}", scene.source.label()),
            scene,
            since: Instant::now(),
            token: CancelToken::new(),
            order: Some(order),
        });
    }

    /// Stops measuring; the rows that are there stay.
    pub fn cancel(&mut self, state: &mut AppState) {
        self.take_news(state);
        if self.running.is_some() {
            self.stop();
            let rows = state.activity.measured.as_ref().map_or(0, |result| result.rows.len());
            let noun = if rows == 1 { "row stays" } else { "rows stay" };
            state.messages.notify(Severity::Info, format!("Measuring cancelled: {rows} {noun}"));
        }
        state.activity.measure = None;
    }

    /// Starts what waits, once `at_rest`, and takes what has arrived.
    pub fn poll(&mut self, state: &mut AppState, at_rest: bool) {
        self.take_news(state);
        if let Some(running) = &mut self.running {
            let same = state.model.loaded.as_ref().is_some_and(|scene| Arc::ptr_eq(scene, &running.scene));
            if !same {
                self.stop();
                state.messages.notify(Severity::Info, "Measuring stopped: another model was opened");
            } else if at_rest && let Some(order) = running.order.take() {
                running.token = self.worker.request(order);
                running.since = Instant::now();
            }
        }
        state.activity.measure = self.running.as_ref().map(|running| JobStatus {
            label: running.label.clone(),
            progress: running.token.progress(),
            since: running.since,
        });
    }

    /// Whether something is measured or waits for it.
    pub fn is_busy(&self) -> bool {
        self.running.is_some()
    }

    fn stop(&mut self) {
        self.worker.cancel();
        self.running = None;
    }

    fn take_news(&mut self, state: &mut AppState) {
        let Some(running) = self.running.as_ref().filter(|running| running.order.is_none()) else { return };
        // Asked in this order: a job that ends in between has left its news to be taken.
        let busy = self.worker.is_busy();
        match self.worker.take() {
            Some(Outcome::Done(News { rows, end })) => {
                let finished = matches!(end, Some(Ok(())));
                let (experiment, scene) = (running.experiment, Arc::clone(&running.scene));
                state.activity.measured = Some(PaperResult::new(experiment, scene, rows, finished));
                if let Some(Err(why)) = &end {
                    state.messages.notify(Severity::Warning, format!("This cannot be measured: {why}"));
                }
                if end.is_some() {
                    self.running = None;
                }
            }
            Some(Outcome::Panicked(text)) => {
                self.running = None;
                eprintln!("error: measuring failed: {text}");
                state
                    .messages
                    .notify(Severity::Error, format!("Measuring failed through a mistake in this program: {text}"));
            }
            None if !busy => self.running = None,
            None => {}
        }
    }
}
