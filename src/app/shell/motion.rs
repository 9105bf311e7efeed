//! Whether the settings are changing: a slider is dragged or the camera moves.

use std::time::{Duration, Instant};

use crate::app::state::{AppState, Wanted};
use crate::render::cluster_cut::ClusterCut;

/// Time without a change after which the settings are at rest and the picture is refined.
pub(crate) const REST_DELAY: Duration = Duration::from_millis(160);

/// Watches the settings that decide the picture.
#[derive(Default)]
pub(crate) struct Motion {
    last: Option<Wanted>,
    /// The cut that was shown in cluster colours.
    clusters: Option<ClusterCut>,
    changed_at: Option<Instant>,
    disabled: bool,
}

impl Motion {
    /// Sets whether changes are ignored, so that nothing ever counts as moving.
    pub(crate) const fn set_disabled(&mut self, disabled: bool) {
        self.disabled = disabled;
    }

    /// Compares the settings with those of the last UI frame. Returns whether they are changing.
    pub(crate) fn observe(&mut self, state: &AppState, now: Instant) -> bool {
        let wanted = &state.wanted;
        let clusters = state.cluster_cut(state.model.presented.as_ref().map(|shown| &shown.accel));
        let same = self.last.as_ref().is_some_and(|last| {
            let second = |wanted: &Wanted| wanted.second.map(|second| second.build);
            last.camera == wanted.camera
                && last.build == wanted.build
                && last.tree_files == wanted.tree_files
                && second(last) == second(wanted)
                && last.render == wanted.render
                && self.clusters == clusters
        });
        if !same {
            if self.last.is_some() {
                self.changed_at = Some(now);
            }
            (self.last, self.clusters) = (Some(wanted.clone()), clusters);
        }
        self.is_moving(now)
    }

    /// Whether a setting has changed within [`REST_DELAY`].
    pub(crate) fn is_moving(&self, now: Instant) -> bool {
        !self.disabled && self.changed_at.is_some_and(|then| now.duration_since(then) < REST_DELAY)
    }
}
