//! What takes a pass over the whole tree and is not always wanted, so made by a thread of its own once somebody wants to see
//! it: containers of the kind that the tree is not made of, the list of the deepest nodes, what lies below a node.

use std::sync::Arc;

use crate::app::state::AppState;
use crate::app::work::jobs::Pool;
use crate::overlay::{NodeTable, OverlaySettings};
use crate::worker::Worker;
use bvhscope_engine::cancel::CancelToken;

/// What is made for a table: what is to be drawn, or what lies below its nodes.
struct Job {
    table: Arc<NodeTable>,
    drawn: Option<OverlaySettings>,
}

/// The thread that makes it.
pub(crate) struct DerivedWorker {
    worker: Worker<Job, ()>,
    /// What was last asked for: of which table, and what was to be drawn.
    asked: Option<(u64, Option<OverlaySettings>)>,
}

impl DerivedWorker {
    /// Starts the thread; `wake` is called from it when they are there.
    pub(crate) fn new(wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Self> {
        let pool = Pool::default();
        let worker = Worker::new("containers", wake, move |job: Job, token: &CancelToken, _| {
            let Job { table, drawn } = job;
            let make = || match &drawn {
                Some(settings) => table.prepare(settings, token),
                None => table.study(token),
            };
            pool.run("containers", 0, make).ok()
        })?;
        Ok(Self { worker, asked: None })
    }

    /// Asks for what is missing of the tree on the screen: what is to be drawn at once, what lies below the selected node
    /// where the tree's builder, which reads that as its last, was called off: it has `idle` cores then.
    pub(crate) fn follow(&mut self, state: &AppState, idle: bool) {
        let Some(presented) = state.model.presented.as_ref().filter(|_| !self.worker.is_busy()) else { return };
        let (table, wanted) = (&presented.table, state.wanted.overlay);
        let drawn = (state.preferences.show_containers && table.drawable(&wanted) != wanted).then_some(wanted);
        let selected = state.selection.nodes.selected.filter(|&node| idle && (node as usize) < table.len());
        let is_unknown = selected.is_some_and(|node| table.known_primitives(node).is_none());
        let asked = Some((table.id, drawn));
        if (drawn.is_some() || is_unknown) && self.asked != asked {
            self.asked = asked;
            self.worker.request(Job { table: Arc::clone(table), drawn });
        }
    }

    /// Whether they are being made.
    pub(crate) fn is_busy(&self) -> bool {
        self.worker.is_busy()
    }
}
