//! Background studies: values derived from the presented tree, each on a thread of its own. [`Studies`] is the only list of them;
//! jobs, stopping, following the tree and being busy are derived from it.

pub(crate) mod latest;

mod rail;

pub(crate) mod shared;

use std::sync::Arc;
use std::time::Instant;

pub(crate) use self::rail::StudyPlan;

use self::rail::{FollowsState, StudyRail};
use crate::accel::Accel;
use crate::app::state::AppState;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// All background studies.
pub(crate) struct Studies {
    wake: Arc<dyn Fn() + Send + Sync>,
    rails: Vec<Box<dyn FollowsState>>,
}

impl Studies {
    /// No studies yet; `wake` is called from their threads after each result.
    pub(crate) fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self { wake: Arc::new(wake), rails: Vec::new() }
    }

    /// Starts the thread of a study, which derives values by `derive` in a rayon pool.
    pub(crate) fn add<K, V>(
        &mut self,
        plan: StudyPlan<K, V>,
        derive: impl Fn(&Arc<Accel>, &K, &CancelToken) -> Result<V, Cancelled> + Send + Sync + 'static,
    ) -> std::io::Result<()>
    where
        K: Clone + PartialEq + Send + Sync + 'static,
        V: Send + 'static,
    {
        let wake = Arc::clone(&self.wake);
        self.rails.push(Box::new(StudyRail::new(plan, move || wake(), derive)?));
        Ok(())
    }

    /// Takes finished values and requests missing ones once the other workers are `idle`.
    pub(crate) fn follow(&mut self, state: &mut AppState, idle: bool) {
        let stop = std::mem::take(&mut state.activity.stop_study);
        for rail in &mut self.rails {
            rail.follow(state, idle, stop);
        }
        state.model.follow_playing(!self.is_busy());
        state.activity.study = self.rails.iter().find_map(|rail| rail.job());
    }

    /// A value is being derived.
    pub(crate) fn is_busy(&self) -> bool {
        self.rails.iter().any(|rail| rail.is_busy())
    }

    /// When the oldest job was requested whose progress is drawn.
    pub(crate) fn drawn_since(&self) -> Option<Instant> {
        self.rails.iter().filter_map(|rail| rail.drawn_since()).min()
    }
}
