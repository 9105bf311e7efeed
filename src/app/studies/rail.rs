//! Runs one study: latest wins, cancelled when nothing needs its value any more or the tree changes.

use std::sync::Arc;
use std::time::Instant;

use super::latest::{Latest, Polled, WorkerPool, report_panic};
use crate::accel::Accel;
use crate::app::state::{AppState, JobStatus, Study};
use crate::worker::Worker;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// The tree and the parameters that a value is derived from, compared as requests.
#[derive(Clone)]
struct Inputs<K>(Arc<Accel>, K);

impl<K: PartialEq> PartialEq for Inputs<K> {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0) && self.1 == other.1
    }
}

/// A tree and parameters.
type OfTree<K> = (Arc<Accel>, K);

/// A background study.
pub(crate) struct StudyPlan<K, V> {
    /// Name of its thread.
    pub(crate) name: &'static str,
    /// Label of its job: "Ranking nodes".
    pub(crate) label: &'static str,
    /// Starts at once instead of waiting until building and tracing rest.
    pub(crate) at_once: bool,
    /// No UI frames are drawn for its progress alone: they would disturb what it times.
    pub(crate) is_quiet: bool,
    /// Where its value is kept.
    pub(crate) study: fn(&mut AppState) -> &mut Study<K, V>,
    /// Inputs of the value that is needed now; `None` while nothing on the screen needs one. The flag is set while building and
    /// tracing rest.
    pub(crate) wanted: fn(&mut AppState, bool) -> Option<OfTree<K>>,
}

impl<K, V> StudyPlan<K, V> {
    /// A study that waits until building and tracing rest.
    pub(crate) const fn new(
        name: &'static str,
        label: &'static str,
        study: fn(&mut AppState) -> &mut Study<K, V>,
        wanted: fn(&mut AppState, bool) -> Option<OfTree<K>>,
    ) -> Self {
        Self { name, label, at_once: false, is_quiet: false, study, wanted }
    }
}

/// A study of any type.
pub(super) trait FollowsState {
    /// Takes a finished value, cancels the job where `stop` is set, and requests the wanted value where it is missing, once the
    /// other workers are `idle`.
    fn follow(&mut self, state: &mut AppState, idle: bool, stop: bool);

    /// The job in flight.
    fn job(&self) -> Option<JobStatus>;

    /// When the job in flight was requested, if its progress is drawn.
    fn drawn_since(&self) -> Option<Instant>;

    /// A value is being derived.
    fn is_busy(&self) -> bool;
}

/// The thread of a study.
pub(super) struct StudyRail<K, V> {
    plan: StudyPlan<K, V>,
    latest: Latest<Inputs<K>, Inputs<K>, V>,
}

impl<K, V> StudyRail<K, V>
where
    K: Clone + PartialEq + Send + Sync + 'static,
    V: Send + 'static,
{
    /// Starts the thread; `wake` is called from it after each result.
    pub(super) fn new(
        plan: StudyPlan<K, V>,
        wake: impl Fn() + Send + Sync + 'static,
        derive: impl Fn(&Arc<Accel>, &K, &CancelToken) -> Result<V, Cancelled> + Send + Sync + 'static,
    ) -> std::io::Result<Self> {
        let (pool, name) = (WorkerPool::default(), plan.name);
        let work = move |Inputs(accel, parameters): Inputs<K>, token: &CancelToken, _: &(dyn Fn(V) + Sync)| {
            pool.run(name, 0, || derive(&accel, &parameters, token)).ok()
        };
        Ok(Self { plan, latest: Latest::new(Worker::new(name, wake, work)?) })
    }

    fn take(&mut self, state: &mut AppState) {
        let Some(inputs) = self.latest.key().cloned() else { return };
        match self.latest.poll() {
            Polled::Running => {}
            Polled::Result(value) => {
                self.latest.finish(&inputs);
                (self.plan.study)(state).set(&inputs.0, inputs.1, value);
            }
            Polled::Failed(panic) => {
                // Not again with the same inputs: it would fail again.
                (self.plan.study)(state).cancel(&inputs.0, inputs.1);
                if let Some(text) = panic {
                    report_panic(&mut state.messages, self.plan.label, &text);
                }
            }
        }
    }

    fn stop(&mut self, state: &mut AppState) {
        if let Some(Inputs(accel, parameters)) = self.latest.stop() {
            (self.plan.study)(state).cancel(&accel, parameters);
        }
    }
}

impl<K, V> FollowsState for StudyRail<K, V>
where
    K: Clone + PartialEq + Send + Sync + 'static,
    V: Send + 'static,
{
    fn follow(&mut self, state: &mut AppState, idle: bool, stop: bool) {
        (self.plan.study)(state).forget_gone();
        self.take(state);
        if stop {
            self.stop(state);
        }
        let wanted = (self.plan.wanted)(state, idle);
        let study = (self.plan.study)(state);
        let wanted = wanted.map(|(accel, parameters)| Inputs(accel, parameters)).filter(|Inputs(accel, parameters)| {
            study.get(accel, parameters).is_none() && !study.is_cancelled(accel, parameters)
        });
        if self.latest.key() != wanted.as_ref() {
            self.latest.stop();
        }
        let may_start = idle || self.plan.at_once;
        if let Some(inputs) = wanted.filter(|_| may_start && !self.latest.is_busy()) {
            self.latest.request(inputs.clone(), inputs, Instant::now());
        }
    }

    fn job(&self) -> Option<JobStatus> {
        self.latest.status(self.plan.label)
    }

    fn drawn_since(&self) -> Option<Instant> {
        self.latest.since().filter(|_| !self.plan.is_quiet)
    }

    fn is_busy(&self) -> bool {
        self.latest.is_busy()
    }
}
