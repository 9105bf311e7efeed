//! Containers of the kind that the tree is not made of: a pass over the whole tree, so made by a thread of their own once
//! somebody wants to see them.

use std::sync::Arc;

use super::state::AppState;
use crate::cancel::CancelToken;
use crate::overlay::NodeTable;
use crate::worker::Worker;

/// The thread that makes them.
pub(super) struct OtherContainers {
    worker: Worker<Arc<NodeTable>, ()>,
    /// The table that was last asked for.
    asked: Option<u64>,
}

impl OtherContainers {
    /// Starts the thread; `wake` is called from it when they are there.
    pub(super) fn new(wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Self> {
        let worker = Worker::new("containers", wake, |table: Arc<NodeTable>, token: &CancelToken, _| {
            table.complete(token).ok()
        })?;
        Ok(Self { worker, asked: None })
    }

    /// Asks for those of the tree on the screen where they are to be drawn.
    pub(super) fn follow(&mut self, state: &AppState) {
        let Some(presented) = state.presented.as_ref().filter(|_| state.preferences.show_containers) else { return };
        let (table, wanted) = (&presented.table, &state.wanted.overlay);
        if table.drawable(wanted) != *wanted && self.asked != Some(table.id) {
            self.asked = Some(table.id);
            self.worker.request(Arc::clone(table));
        }
    }

    /// Whether they are being made.
    pub(super) fn is_busy(&self) -> bool {
        self.worker.is_busy()
    }
}
