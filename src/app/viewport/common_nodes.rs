//! Leaves out the containers that only one of two trees has, where the user wants to see what both have.

use std::sync::Arc;

use crate::app::state::{AppState, TreeSide};
use crate::overlay::Shown;
use bvhscope_engine::tree::survival::Survival;

/// The containers chosen last that both trees have, and what they were chosen from.
#[derive(Default)]
pub(super) struct CommonNodes {
    last: Option<Chosen>,
}

/// Containers, the nodes that both trees have, and which of the containers are among these.
struct Chosen {
    from: Arc<Shown>,
    by: Arc<[Survival; 2]>,
    common: Arc<Shown>,
}

impl CommonNodes {
    /// The containers of `shown`, which are of the tree `side`, that the other tree has too, where only these are wanted and known.
    pub(super) fn update(&mut self, state: &AppState, side: TreeSide, shown: Arc<Shown>) -> Arc<Shown> {
        let wanted = state.wanted.second.is_some_and(|second| second.only_common);
        let Some(survival) = state.survival().filter(|_| wanted) else {
            self.last = None;
            return shown;
        };
        if let Some(last) = &self.last
            && Arc::ptr_eq(&last.from, &shown)
            && Arc::ptr_eq(&last.by, survival)
        {
            return Arc::clone(&last.common);
        }
        let common = Arc::new(common(&shown, &survival[side as usize]));
        self.last = Some(Chosen { from: shown, by: Arc::clone(survival), common: Arc::clone(&common) });
        common
    }
}

/// The nodes of `shown` that survive.
fn common(shown: &Shown, survival: &Survival) -> Shown {
    let kept = |range: std::ops::Range<usize>| range.filter(|&place| survival.survives(shown.nodes[place]));
    let outlined: Vec<usize> = kept(0..shown.outlined).collect();
    let places: Vec<usize> = outlined.iter().copied().chain(kept(shown.outlined..shown.nodes.len())).collect();
    Shown {
        nodes: places.iter().map(|&place| shown.nodes[place]).collect(),
        depths: places.iter().map(|&place| shown.depths[place]).collect(),
        wanted: places.len(),
        outlined: outlined.len(),
        ..*shown
    }
}
