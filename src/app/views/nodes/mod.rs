//! The view "Nodes": the outline of the tree, and beside it the worst nodes.

mod outline;
mod ranking;

use egui::{Key, Rect, Ui, UiBuilder, pos2};

use crate::app::state::lab::{NodesState, RankingInputs};
use crate::app::state::{AppState, LabState};
use crate::app::studies::{Studies, StudyPlan};
use crate::app::views::{View, parts};
use crate::lab::node_ranking::rank_nodes;
use crate::lab::node_values::NodeValues;

/// Share of the width that the outline takes.
const OUTLINE_SHARE: f32 = 0.4;
/// Gap between outline and list in points.
const GAP: f32 = 24.0;

const PURPOSE: &str = "Which nodes make rays slow: the worst by regret, cost, overlap, empty space or measured visits";

/// The nodes that cost most.
pub(super) const VIEW: View = View {
    add_studies: add_ranking,
    needs_visits: |_| true,
    needs_regrets: |_| true,
    needs_counts: true,
    ..View::new(NodesState::VIEW, PURPOSE, Key::F9, show)
};

fn show(ui: &mut Ui, state: &mut AppState) {
    let Some(shown) = parts::presented(ui, state, "Open a model to see the nodes of its tree") else { return };
    let whole = ui.available_rect_before_wrap();
    let split = whole.left() + whole.width() * OUTLINE_SHARE;
    let left = Rect::from_min_max(whole.min, pos2(split - GAP * 0.5, whole.bottom()));
    let right = Rect::from_min_max(pos2(split + GAP * 0.5, whole.top()), whole.max);
    ui.painter().vline(split, whole.y_range(), ui.visuals().widgets.noninteractive.bg_stroke);
    ui.scope_builder(UiBuilder::new().max_rect(left), |ui| outline::show(ui, state, &shown));
    ui.scope_builder(UiBuilder::new().max_rect(right), |ui| ranking::show(ui, state, &shown));
    ui.advance_cursor_after_rect(whole);
}

/// Adds the study: the ranking of the nodes.
fn add_ranking(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan::new(
        "ranking",
        "Ranking nodes",
        |state| &mut state.lab.nodes.ranking,
        |state, _| state.inputs_of_view(NodesState::VIEW, LabState::ranking_inputs),
    );
    studies.add(plan, |accel, inputs: &RankingInputs, token| {
        let visits = inputs.visits.as_ref().map(|visits| &*visits.0);
        rank_nodes(&NodeValues { accel, visits }, &inputs.order, token)
    })
}
