//! Runs one study: latest wins, cancelled when nothing needs its value any more or the tree changes.

use std::sync::Arc;
use std::time::Instant;

use super::in_flight::{InFlight, Polled, WorkerPool, poll, report_panic};
use crate::accel::Accel;
use crate::app::state::{AppState, JobStatus, Study};
use crate::worker::Worker;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// The tree and the parameters that a value is derived from.
type Inputs<K> = (Arc<Accel>, K);

/// A background study.
pub(crate) struct StudyPlan<K, V> {
    /// Name of its thread.
    pub(crate) name: &'static str,
    /// Label of its job: "Ranking nodes".
    pub(crate) label: &'static str,
    /// Starts at once instead of waiting until building and tracing rest.
    pub(crate) at_once: bool,
    /// Where its value is kept.
    pub(crate) study: fn(&mut AppState) -> &mut Study<K, V>,
    /// Inputs of the value that is needed now; `None` while nothing on the screen needs one. The flag is set while building and
    /// tracing rest.
    pub(crate) wanted: fn(&mut AppState, bool) -> Option<Inputs<K>>,
}

/// A study of any type.
pub(super) trait FollowsState {
    /// Takes a finished value, cancels the job where `stop` is set, and requests the wanted value where it is missing, once the
    /// other workers are `idle`.
    fn follow(&mut self, state: &mut AppState, idle: bool, stop: bool);

    /// The job in flight.
    fn job(&self) -> Option<JobStatus>;

    /// A value is being derived.
    fn is_busy(&self) -> bool;
}

/// The thread of a study.
pub(super) struct StudyRail<K, V> {
    plan: StudyPlan<K, V>,
    worker: Worker<Inputs<K>, V>,
    in_flight: Option<InFlight<Inputs<K>>>,
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
        let work = move |(accel, parameters): Inputs<K>, token: &CancelToken, _: &(dyn Fn(V) + Sync)| {
            pool.run(name, 0, || derive(&accel, &parameters, token)).ok()
        };
        Ok(Self { plan, worker: Worker::new(name, wake, work)?, in_flight: None })
    }

    fn take(&mut self, state: &mut AppState) {
        let Some(job) = &self.in_flight else { return };
        let (accel, parameters) = job.key.clone();
        match poll(&self.worker) {
            Polled::Running => return,
            Polled::Result(value) => (self.plan.study)(state).set(&accel, parameters, value),
            Polled::Failed(panic) => {
                // Not again with the same inputs: it would fail again.
                (self.plan.study)(state).cancel(&accel, parameters);
                if let Some(text) = panic {
                    report_panic(&mut state.messages, self.plan.label, &text);
                }
            }
        }
        self.in_flight = None;
    }

    fn stop(&mut self, state: &mut AppState) {
        if let Some(job) = self.in_flight.take() {
            self.worker.cancel();
            (self.plan.study)(state).cancel(&job.key.0, job.key.1);
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
        let wanted = wanted.filter(|(accel, parameters)| {
            study.get(accel, parameters).is_none() && !study.is_cancelled(accel, parameters)
        });
        let stale =
            self.in_flight.as_ref().is_some_and(|job| wanted.as_ref().is_none_or(|wanted| !same(&job.key, wanted)));
        if stale {
            self.worker.cancel();
            self.in_flight = None;
        }
        let may_start = idle || self.plan.at_once;
        if let Some(key) = wanted.filter(|_| may_start && self.in_flight.is_none()) {
            let token = self.worker.request(key.clone());
            self.in_flight = Some(InFlight { key, token, since: Instant::now() });
        }
    }

    fn job(&self) -> Option<JobStatus> {
        self.in_flight.as_ref().map(|job| job.status(self.plan.label.to_owned()))
    }

    fn is_busy(&self) -> bool {
        self.in_flight.is_some()
    }
}

fn same<K: PartialEq>(a: &Inputs<K>, b: &Inputs<K>) -> bool {
    Arc::ptr_eq(&a.0, &b.0) && a.1 == b.1
}
