//! Derives what an open view of the laboratory lacks: latest wins, cancelled when the view closes or the tree changes.

use std::sync::Arc;
use std::time::Instant;

use crate::accel::Accel;
use crate::app::shell::in_flight::{InFlight, Polled, poll, report_panic};
use crate::app::shell::pool::WorkerPool;
use crate::app::state::{MessageLog, Study};
use crate::worker::Worker;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// The inputs of a job.
type Inputs<K> = (Arc<Accel>, K);

/// A thread that derives values of one view.
pub(crate) struct StudyRail<K, V> {
    /// What it does, as messages name it: "Ranking nodes".
    label: &'static str,
    worker: Worker<Inputs<K>, V>,
    in_flight: Option<InFlight<Inputs<K>>>,
}

impl<K, V> StudyRail<K, V>
where
    K: Clone + PartialEq + Send + Sync + 'static,
    V: Send + 'static,
{
    /// Starts the thread `name`, which derives values by `derive` in a rayon pool; `wake` is called from it after each result.
    pub(crate) fn new(
        name: &'static str,
        label: &'static str,
        wake: impl Fn() + Send + Sync + 'static,
        derive: impl Fn(&Arc<Accel>, &K, &CancelToken) -> Result<V, Cancelled> + Send + Sync + 'static,
    ) -> std::io::Result<Self> {
        let pool = WorkerPool::default();
        let work = move |(accel, parameters): Inputs<K>, token: &CancelToken, _: &(dyn Fn(V) + Sync)| {
            pool.run(name, 0, || derive(&accel, &parameters, token)).ok()
        };
        Ok(Self { label, worker: Worker::new(name, wake, work)?, in_flight: None })
    }

    /// Takes a finished value into `study`, and requests the one for `wanted` where it is missing, once the other workers are
    /// `idle`. `None` wants nothing: its view is closed.
    pub(crate) fn follow(
        &mut self,
        study: &mut Study<K, V>,
        wanted: Option<Inputs<K>>,
        idle: bool,
        messages: &mut MessageLog,
    ) {
        study.forget_gone();
        self.take(study, messages);
        if study.take_stop()
            && let Some(job) = self.in_flight.take()
        {
            self.worker.cancel();
            study.cancel(&job.key.0, job.key.1);
        }
        let wanted = wanted.filter(|(accel, parameters)| {
            study.get(accel, parameters).is_none() && !study.is_cancelled(accel, parameters)
        });
        let stale =
            self.in_flight.as_ref().is_some_and(|job| wanted.as_ref().is_none_or(|wanted| !same(&job.key, wanted)));
        if stale {
            self.worker.cancel();
            self.in_flight = None;
        }
        if let Some(key) = wanted.filter(|_| idle && self.in_flight.is_none()) {
            let token = self.worker.request(key.clone());
            self.in_flight = Some(InFlight { key, token, since: Instant::now() });
        }
        study.job = self.in_flight.as_ref().map(|job| job.status(self.label.to_owned()));
    }

    fn take(&mut self, study: &mut Study<K, V>, messages: &mut MessageLog) {
        let Some(job) = &self.in_flight else { return };
        let (accel, parameters) = job.key.clone();
        match poll(&self.worker) {
            Polled::Running => return,
            Polled::Result(value) => study.set(&accel, parameters, value),
            Polled::Failed(panic) => {
                // Not again with the same inputs: it would fail again.
                study.cancel(&accel, parameters);
                if let Some(text) = panic {
                    report_panic(messages, self.label, &text);
                }
            }
        }
        self.in_flight = None;
    }

    /// Whether a value is being derived.
    pub(crate) fn is_busy(&self) -> bool {
        self.in_flight.is_some()
    }
}

fn same<K: PartialEq>(a: &Inputs<K>, b: &Inputs<K>) -> bool {
    Arc::ptr_eq(&a.0, &b.0) && a.1 == b.1
}
