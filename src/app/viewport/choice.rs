//! Which containers are drawn: chosen again when tree, settings or hidden nodes change, and when the camera comes to
//! rest. Those that only one of two trees has are left out where the user wants to see what both have.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::accel::are_same;
use crate::accel::node_values::KnownVisits;
use crate::app::state::{AppState, Presented, Standing, TreeSide};
use crate::catalog::metrics::Source;
use crate::overlay::{ColorBy, ColorScale, NodeTable, OverlaySettings, Selection, Shown, Viewpoint};
use bvhscope_engine::tree::survival::Survival;

/// Time without a camera move after which the containers are chosen for the new view.
const REST_DELAY: Duration = Duration::from_millis(200);

/// The containers chosen last, and what they were chosen from.
#[derive(Default)]
pub(crate) struct Choice {
    last: Option<Chosen>,
}

struct Chosen {
    table: u64,
    standing: Option<Arc<Standing>>,
    settings: OverlaySettings,
    /// The visits that colours stand for.
    visits: Option<KnownVisits>,
    selection: Selection,
    viewpoint: Viewpoint,
    shown: Arc<Shown>,
    /// The viewpoint of the last UI frame, and since when it has been the same.
    seen: (Viewpoint, Instant),
}

impl Choice {
    /// The containers of a tree on the screen that are drawn, without those that `selection` hides: those of the chosen depths, or
    /// the clusters that are `standing`. Also returns the delay after which they are to be chosen again, if the camera has moved
    /// since and matters.
    pub(crate) fn update(
        &mut self,
        state: &AppState,
        presented: &Presented,
        standing: Option<&Arc<Standing>>,
        selection: &Selection,
    ) -> (Arc<Shown>, Option<Duration>) {
        let table = table_of(state, presented, standing.map(AsRef::as_ref));
        let settings = drawable(state, table);
        // Settings that change only the look of lines need no other choice.
        let compared = OverlaySettings { hidden_alpha: 0.0, line_width: 1.0, ..settings };
        let visits = table.visits().filter(|_| settings.color_by.source() == Source::Visits);
        let Selection { hidden, isolated, only, .. } = selection;
        let frame = &presented.frame;
        let (camera, section) = (frame.camera, frame.settings.section);
        let viewpoint = Viewpoint { camera, size_px: state.layout.viewport_px, section };
        let now = Instant::now();
        if let Some(last) = self.last.as_mut().filter(|last| {
            last.table == table.id
                && are_same(last.standing.as_ref(), standing)
                && (&last.settings, &last.visits) == (&compared, &visits)
                && (&last.selection.hidden, &last.selection.isolated, &last.selection.only) == (hidden, isolated, only)
        }) {
            if last.seen.0 != viewpoint {
                last.seen = (viewpoint, now);
            }
            // Few containers are chosen at once where the plane moves, many once it comes to rest.
            let few = !last.shown.depends_on_view;
            if last.viewpoint == viewpoint || (few && last.viewpoint.section == section) {
                return (Arc::clone(&last.shown), None);
            }
            let rested = now.duration_since(last.seen.1);
            if !few && rested < REST_DELAY {
                return (Arc::clone(&last.shown), Some(REST_DELAY.saturating_sub(rested)));
            }
        }
        let selection =
            Selection { hidden: hidden.clone(), isolated: *isolated, only: only.clone(), ..Selection::default() };
        let shown = match standing {
            Some(standing) => table.shown_of(&standing.nodes, standing.all, &settings, &selection, Some(&viewpoint)),
            None => table.shown(&settings, &selection, Some(&viewpoint)),
        };
        let shown = Arc::new(shown);
        log::debug!("chose {} of {} containers in {:.1?}", shown.nodes.len(), shown.wanted, now.elapsed());
        let seen = (viewpoint, now);
        self.last = Some(Chosen {
            table: table.id,
            standing: standing.cloned(),
            settings: compared,
            visits,
            selection,
            viewpoint,
            shown: Arc::clone(&shown),
            seen,
        });
        (shown, None)
    }
}

/// The overlay settings as they are drawn now: restricted to what is known of the tree, with the budget of this adapter.
pub(crate) fn drawable(state: &AppState, table: &NodeTable) -> OverlaySettings {
    table.set_visits(state.model.derived.known_visits(table.accel()));
    let mut settings = table.drawable(&state.overlay_of(table));
    // The clusters of a tree before its passes are not those of the second tree.
    let standing = state.layout.graphics.standing.as_ref().and_then(|standing| standing.table());
    let is_before = standing.is_some_and(|standing| standing.id == table.id);
    if settings.color_by == ColorBy::Survival
        && (state.compared().is_none() || is_before && state.wanted.second.is_some())
    {
        settings.color_by = ColorBy::DEPTH;
    }
    OverlaySettings { budget: Some(budget(state)), ..settings }
}

/// Maximum number of containers that this adapter draws.
pub(crate) fn budget(state: &AppState) -> u32 {
    state.wanted.overlay.budget.unwrap_or_else(|| state.layout.graphics.automatic_budget())
}

/// The table of the tree whose containers are drawn: the presented one, or that of the merges or of the layout on show.
pub(crate) fn drawn_table<'a>(state: &'a AppState, presented: &'a Presented) -> &'a Arc<NodeTable> {
    table_of(state, presented, state.layout.graphics.standing.as_deref())
}

/// [`drawn_table`], where these clusters are on show.
fn table_of<'a>(state: &'a AppState, presented: &'a Presented, standing: Option<&'a Standing>) -> &'a Arc<NodeTable> {
    match standing {
        Some(standing) => standing.table().unwrap_or(&presented.table),
        None => state.model.layout_of(&presented.accel).unwrap_or(&presented.table),
    }
}

/// The selection that the overlay shows: while merges are on show, the one just made, whose children are lit up too.
pub(crate) fn drawn_selection(state: &AppState) -> Selection {
    let Some(standing) = &state.layout.graphics.standing else { return state.selection.nodes.clone() };
    // Nodes that were hidden or pointed at are those of the presented tree.
    let own = if standing.table().is_some() { Selection::default() } else { state.selection.nodes.clone() };
    Selection { selected: standing.made.or(own.selected), ..own }
}

/// The containers chosen last beside those of another tree, and what they were chosen from.
#[derive(Default)]
pub(super) struct CommonNodes {
    last: Option<CommonChoice>,
}

/// Containers, the nodes that both trees have, and the containers with what is said of them.
struct CommonChoice {
    from: Arc<Shown>,
    by: Arc<[Survival; 2]>,
    /// Only those that both have; marked.
    how: [bool; 2],
    common: Arc<Shown>,
}

impl CommonNodes {
    /// The containers of `shown`, which are of the tree `side`: only those that the other tree has too, and marked as such, where it is
    /// wanted and known. `all` keeps all of them.
    pub(super) fn update(&mut self, state: &AppState, side: TreeSide, shown: Arc<Shown>, all: bool) -> Arc<Shown> {
        let only_common = !all && state.draws_only_common();
        let how = [only_common, shown.colors == ColorScale::Survival];
        let Some(survival) = state.compared().filter(|_| how.contains(&true)) else {
            self.last = None;
            return shown;
        };
        if let Some(last) = &self.last
            && Arc::ptr_eq(&last.from, &shown)
            && Arc::ptr_eq(&last.by, survival)
            && last.how == how
        {
            return Arc::clone(&last.common);
        }
        let of_side = &survival[side as usize];
        let mut chosen = if only_common { common(&shown, of_side) } else { (*shown).clone() };
        if how[1] {
            let places = chosen.nodes.iter().map(|&node| if of_side.survives(node) { 0.0 } else { 1.0 }).collect();
            chosen = chosen.with_colors(places, ColorScale::Survival);
        }
        let common = Arc::new(chosen);
        self.last = Some(CommonChoice { from: shown, by: Arc::clone(survival), how, common: Arc::clone(&common) });
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
        places: places.iter().map(|&place| shown.places[place]).collect(),
        wanted: places.len(),
        outlined: outlined.len(),
        ..*shown
    }
}
