//! Which containers are drawn: chosen again when tree, settings or hidden nodes change, and when the camera comes to rest.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::app::state::{AppState, Presented};
use crate::overlay::{OverlaySettings, Selection, Shown, Viewpoint};

/// Time without a camera move after which the containers are chosen for the new view.
const REST_DELAY: Duration = Duration::from_millis(200);

/// The containers chosen last, and what they were chosen from.
#[derive(Default)]
pub(crate) struct Choice {
    last: Option<Chosen>,
}

struct Chosen {
    table: u64,
    settings: OverlaySettings,
    selection: Selection,
    viewpoint: Viewpoint,
    shown: Arc<Shown>,
    /// The viewpoint of the last UI frame, and since when it has been the same.
    seen: (Viewpoint, Instant),
}

impl Choice {
    /// The containers of the presented tree that are drawn. Also returns the delay after which they are to be chosen again, if
    /// the camera has moved since and matters.
    pub(crate) fn update(&mut self, state: &AppState, presented: &Presented) -> (Arc<Shown>, Option<Duration>) {
        let settings = drawable(state, presented);
        // Settings that change only the look of lines need no other choice.
        let compared = OverlaySettings { hidden_alpha: 0.0, line_width: 1.0, ..settings };
        let Selection { hidden, isolated, .. } = &state.selection.nodes;
        let viewpoint = Viewpoint { camera: presented.frame.camera, size_px: state.layout.viewport_px };
        let now = Instant::now();
        let table = &presented.table;
        if let Some(last) = self.last.as_mut().filter(|last| {
            last.table == table.id
                && last.settings == compared
                && (&last.selection.hidden, &last.selection.isolated) == (hidden, isolated)
        }) {
            if last.seen.0 != viewpoint {
                last.seen = (viewpoint, now);
            }
            if !last.shown.depends_on_view || last.viewpoint == viewpoint {
                return (Arc::clone(&last.shown), None);
            }
            let rested = now.duration_since(last.seen.1);
            if rested < REST_DELAY {
                return (Arc::clone(&last.shown), Some(REST_DELAY.saturating_sub(rested)));
            }
        }
        let selection = Selection { hidden: hidden.clone(), isolated: *isolated, ..Selection::default() };
        let shown = Arc::new(table.shown(&settings, &selection, Some(&viewpoint)));
        log::debug!("chose {} of {} containers in {:.1?}", shown.nodes.len(), shown.wanted, now.elapsed());
        let seen = (viewpoint, now);
        self.last =
            Some(Chosen { table: table.id, settings: compared, selection, viewpoint, shown: Arc::clone(&shown), seen });
        (shown, None)
    }
}

/// The overlay settings as they are drawn now: restricted to what is known of the tree, with the budget of this adapter.
pub(crate) fn drawable(state: &AppState, presented: &Presented) -> OverlaySettings {
    let wanted = &state.wanted.overlay;
    let budget = wanted.budget.unwrap_or_else(|| state.graphics.automatic_budget());
    OverlaySettings { budget: Some(budget), ..presented.table.drawable(wanted) }
}
