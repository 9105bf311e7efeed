//! Commands on nodes: walking from the selected one, hiding, the worst nodes, and the place of a finding of the diagnosis.

use std::sync::Arc;

use super::camera;
use crate::app::state::action::{Action, RankingStep};
use crate::app::state::lab::NodesState;
use crate::app::state::{AppState, TreeSide};
use crate::app::viewport::{orbit, picking};
use crate::lab::diagnose::{Finding, Place};
use crate::scene::Scene;
use crate::visibility::TriangleSet;
use bvhscope_engine::geometry::Aabb;

/// Selects the node at the end of a step, in the tree that holds the selection. Nothing changes where there is none.
pub(super) fn select(state: &mut AppState, step: impl Fn(&AppState) -> Option<u32>) {
    if let Some(node) = step(state) {
        match state.selection.side {
            TreeSide::A => state.selection.nodes.selected = Some(node),
            TreeSide::B => state.selection.second.selected = Some(node),
        }
    }
}

/// Index of the parent of the selected node.
pub(super) fn parent(state: &AppState) -> Option<u32> {
    let (shown, node) = state.selected()?;
    shown.table.parent(node)
}

/// Index of the first child of the selected node; the root where none is selected. The child on the path to the picked triangle
/// comes first, so that walking up and down again ends where it started.
pub(super) fn first_child(state: &AppState) -> Option<u32> {
    let Some((shown, node)) = state.selected() else {
        return (!state.model.presented.as_ref()?.table.is_empty()).then_some(0);
    };
    let picked = state.selection.picked.as_ref().and_then(|picked| {
        let path = match state.selection.side {
            TreeSide::A => picked.path.clone(),
            TreeSide::B => shown.accel.path_to(picked.primitive),
        };
        let here = path.iter().position(|&step| step == node)?;
        path.get(here + 1).copied()
    });
    picked.or_else(|| shown.table.children(node).next())
}

/// Index of the second child of the selected node.
pub(super) fn second_child(state: &AppState) -> Option<u32> {
    let (shown, node) = state.selected()?;
    shown.table.children(node).nth(1)
}

/// Index of the sibling `step` places after the selected node, in a circle.
pub(super) fn sibling(state: &AppState, step: i32) -> Option<u32> {
    let (shown, node) = state.selected()?;
    shown.table.sibling(node, step)
}

/// Hides the subtree of the selected node, which is then no longer selected.
pub(super) fn hide_selected(state: &mut AppState) {
    state.selection.nodes.hidden.extend(state.selection.nodes.selected.take());
    state.selection.picked = None;
}

/// Hides all but the subtree of the selected node.
pub(super) fn isolate_selected(state: &mut AppState) {
    let nodes = &mut state.selection.nodes;
    nodes.isolated = nodes.selected;
    nodes.hidden.clear();
    nodes.only = None;
}

/// Selects and frames another of the worst nodes. Opens their list where nothing is ranked yet.
pub(super) fn step_ranking(state: &mut AppState, step: RankingStep) {
    let Some(accel) = state.model.presented.as_ref().map(|shown| &shown.accel) else { return };
    if state.lab.nodes.ranking.of_tree(accel).is_none() {
        state.preferences.dock.show(NodesState::VIEW);
        return;
    }
    let step = match step {
        RankingStep::Next => 1,
        RankingStep::Previous => -1,
    };
    if let Some(node) = state.lab.nodes.neighbour(accel, state.selection.nodes.selected, step) {
        state.select_node(node);
        camera::frame_selection(state);
    }
}

/// Selects the place of `finding`, hides the rest and frames it.
pub fn show_finding(state: &mut AppState, finding: &Finding) {
    match &finding.place {
        Place::Scene => {}
        Place::Node(node) => {
            state.select_node(*node);
            Action::IsolateSelected.perform(state);
            state.wanted.overlay.hide_triangles = true;
            Action::FrameSelection.perform(state);
        }
        Place::Triangles(triangles) => {
            let Some(scene) = state.model.presented.as_ref().map(|shown| shown.accel.scene.clone()) else { return };
            picking::pick(state, triangles.iter().next());
            state.selection.show_all();
            state.selection.nodes.only = Some(Arc::clone(triangles));
            state.wanted.overlay.hide_triangles = true;
            if let Some(bounds) = bounds_of(&scene, triangles) {
                orbit::frame_all(&mut state.wanted.camera, &bounds);
            }
        }
    }
}

/// The box around `triangles`; `None` where there are none.
fn bounds_of(scene: &Scene, triangles: &TriangleSet) -> Option<Aabb> {
    let boxes = triangles.iter().filter_map(|triangle| Some(scene.triangles.get(triangle as usize)?.bounds()));
    boxes.reduce(|all, next| all.union(&next))
}
