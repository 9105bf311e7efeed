//! The view "Nodes": the outline of the tree, and beside it the worst nodes.

mod outline;
mod ranking;

use egui::{Key, Rect, Ui, UiBuilder, pos2};

use crate::app::state::AppState;
use crate::app::state::lab::{NodesState, RankingInputs};
use crate::app::studies::{Studies, StudyPlan};
use crate::app::views::View;
use crate::app::widgets::empty_view;
use crate::lab::node_ranking::rank_nodes;
use crate::lab::node_values::NodeValues;

/// Share of the width that the outline takes.
const OUTLINE_SHARE: f32 = 0.4;
/// Gap between outline and list in points.
const GAP: f32 = 24.0;

/// The nodes that cost most.
pub(super) struct NodesView;

impl View for NodesView {
    fn name(&self) -> &'static str {
        NodesState::VIEW
    }

    fn purpose(&self) -> &'static str {
        "Which nodes make rays slow: the worst by cost, overlap, empty space or measured visits"
    }

    fn key(&self) -> Key {
        Key::F9
    }

    fn ui(&self, ui: &mut Ui, state: &mut AppState) {
        show(ui, state);
    }

    fn add_studies(&self, studies: &mut Studies) -> std::io::Result<()> {
        add_ranking(studies)
    }

    fn needs_visits(&self, _state: &AppState) -> bool {
        true
    }

    fn needs_counts(&self) -> bool {
        true
    }
}

fn show(ui: &mut Ui, state: &mut AppState) {
    let Some(shown) = state.model.presented.clone() else {
        empty_view(ui, "Open a model to see the nodes of its tree");
        return;
    };
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
    let plan = StudyPlan {
        name: "ranking",
        label: "Ranking nodes",
        at_once: false,
        study: |state| &mut state.lab.nodes.ranking,
        wanted: |state, _| {
            let accel = state.tree_of_view(NodesState::VIEW)?;
            let inputs = state.lab.ranking_inputs(&accel)?;
            Some((accel, inputs))
        },
    };
    studies.add(plan, |accel, inputs: &RankingInputs, token| {
        let visits = inputs.visits.as_ref().map(|visits| &*visits.0);
        rank_nodes(&NodeValues { accel, visits }, &inputs.order, token)
    })
}
