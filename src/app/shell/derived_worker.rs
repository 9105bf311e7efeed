//! Data derived from the whole tree that is not always needed, computed on demand on a thread of its own: containers of the
//! kind that the tree is not built of, lists of deep nodes, primitive counts of subtrees.

use std::sync::Arc;

use crate::app::state::AppState;
use crate::app::studies::latest::WorkerPool;
use crate::app::views;
use crate::catalog::metrics::Source;
use crate::overlay::{ColorBy, NodeTable, OverlaySettings};
use crate::worker::Worker;
use bvhscope_engine::cancel::CancelToken;

/// A request to complete a table.
struct Job {
    table: Arc<NodeTable>,
    /// Computes what these settings draw; `None` computes the primitive counts.
    overlay: Option<OverlaySettings>,
}

/// Completes the overlay table of the presented tree.
pub(crate) struct DerivedWorker {
    worker: Worker<Job, ()>,
    /// Identifier of the table and overlay settings of the last request.
    requested: Option<(u64, Option<OverlaySettings>)>,
}

impl DerivedWorker {
    /// Starts the thread; `wake` is called from it after each result.
    pub(crate) fn new(wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Self> {
        let pool = WorkerPool::default();
        let worker = Worker::new("containers", wake, move |job: Job, token: &CancelToken, _| {
            let Job { table, overlay } = job;
            let complete = || match &overlay {
                Some(settings) => table.prepare(settings, token),
                None => table.study(token),
            };
            pool.run("containers", 0, complete).ok()
        })?;
        Ok(Self { worker, requested: None })
    }

    /// Requests what the presented tree lacks. What is to be drawn is requested at once; the primitive counts of the selected
    /// node and of the nodes that the dock lists only while the other workers are `idle`, because the build worker computes them
    /// too unless it is cancelled.
    pub(crate) fn request_missing(&mut self, state: &AppState, idle: bool) {
        let Some(presented) = state.model.presented.as_ref().filter(|_| !self.worker.is_busy()) else { return };
        let table = state.model.layout_of(&presented.accel).unwrap_or(&presented.table);
        let mut wanted = state.wanted.overlay;
        if !matches!(wanted.color_by.source(), Source::Tree | Source::Counts) {
            // Studies of their own find regrets and visits, which takes longer; growth is known or is not.
            wanted.color_by = ColorBy::DEPTH;
        }
        let overlay = (state.preferences.show_containers && table.lacks(&wanted)).then_some(wanted);
        let listed = idle && views::needs(state).counts;
        let lacking = state.selected().filter(|(shown, node)| idle && shown.table.known_primitives(*node).is_none());
        let table = match lacking {
            // Of one of two trees.
            Some((shown, _)) if overlay.is_none() => &shown.table,
            _ => table,
        };
        let lacks_count = lacking.is_some() || listed && presented.accel.known_ancestry().is_none();
        let request = Some((table.id, overlay));
        if (overlay.is_some() || lacks_count) && self.requested != request {
            self.requested = request;
            self.worker.request(Job { table: Arc::clone(table), overlay });
        }
    }

    /// Whether a request is being worked on.
    pub(crate) fn is_busy(&self) -> bool {
        self.worker.is_busy()
    }
}
