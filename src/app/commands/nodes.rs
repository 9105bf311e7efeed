//! Commands on nodes: walking from the selected one, hiding, the worst nodes, and the place of a finding of the diagnosis.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::camera;
use crate::app::format;
use crate::app::state::action::{Action, RankingStep};
use crate::app::state::{AppState, CompareView, TreeSide, ViewState as _};
use crate::app::viewport::picking;
use crate::app::views::copies::CopiesView;
use crate::app::views::nodes::NodesView;
use crate::lab::diagnose::{Finding, Place};
use crate::scene::{CopyRanges, Scene};
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

/// Selects and frames the node or triangle that `text` names by its number: "12", "node 12", "triangle 7", "t7". The error is the reason why there
/// is none.
pub fn go_to(state: &mut AppState, text: &str) -> Result<(), String> {
    let in_second = state.selection.side == TreeSide::B || state.shown_view() == CompareView::B;
    let side = if in_second { TreeSide::B } else { TreeSide::A };
    let Some(shown) = state.shown_tree(side) else { return Err("There is no tree yet".to_owned()) };
    let (nodes, triangles) = (shown.table.len(), shown.accel.scene.triangles.len());
    let ranges = format!("{}, {}", range("nodes", nodes), range("triangles", triangles));
    let (is_triangle, number) = place_of(text).ok_or_else(|| format!("Type a number: {ranges}"))?;
    let count = if is_triangle { triangles } else { nodes };
    let Some(index) = number.filter(|&number| number < count as u64).map(|number| number as u32) else {
        return Err(format!("Out of range: {ranges}"));
    };
    match (is_triangle, side) {
        (true, TreeSide::A) => picking::pick(state, Some(index)),
        (true, TreeSide::B) => picking::pick_in_second(state, Some(index)),
        (false, TreeSide::A) => state.select_node(index),
        (false, TreeSide::B) => (state.selection.second.selected, state.selection.side) = (Some(index), side),
    }
    if !state.selection.is_some() {
        return Err(format!("Triangle {index} is in no leaf of this tree"));
    }
    camera::frame_selection(state);
    Ok(())
}

/// "nodes 0 to 4,510".
fn range(name: &str, count: usize) -> String {
    if count == 0 { format!("no {name}") } else { format!("{name} 0 to {}", format::count(count as u64 - 1)) }
}

/// `true` where `text` names a triangle, `false` where it names a node, with its number, `None` where that is too large; `None` where
/// it names neither.
fn place_of(text: &str) -> Option<(bool, Option<u64>)> {
    let text = text.trim().to_lowercase();
    let split = text.find(|character: char| character.is_ascii_digit())?;
    let (name, number) = text.split_at(split);
    let is_triangle = match name.trim_end_matches(['#', ' ']) {
        "" | "n" | "node" | "leaf" => false,
        "t" | "tri" | "triangle" => true,
        _ => return None,
    };
    // Numbers are written with separators in the window.
    let digits: String = number.chars().filter(|character| !matches!(character, ',' | ' ' | '_' | '\'')).collect();
    digits.bytes().all(|digit| digit.is_ascii_digit()).then(|| (is_triangle, digits.parse().ok()))
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

/// Unfolds the copies below the selected node, or folds them where all of them are unfolded.
pub(super) fn toggle_unfolded(state: &mut AppState) {
    let Some((shown, node)) = state.selected() else { return };
    let scene = &shown.accel.scene;
    let below = shown.table.triangles_below(node);
    let copies: BTreeSet<u32> = below.iter().filter_map(|primitive| Some(scene.copy_of(primitive)?.0)).collect();
    let wanted = &state.wanted.unfolded;
    let wanted = if copies.iter().all(|copy| wanted.contains(*copy)) {
        wanted.iter(scene.built_triangles().len() as u32).filter(|copy| !copies.contains(copy)).collect()
    } else {
        wanted.with(&copies.into_iter().collect())
    };
    unfold(state, wanted);
}

/// Unfolds all copies.
pub(super) fn unfold_all(state: &mut AppState) {
    let Some(shown) = &state.model.presented else { return };
    let all = shown.accel.scene.copies_among(&CopyRanges::from(vec![[0, u32::MAX]]));
    unfold(state, all);
}

/// Unfolds these copies, and folds all others.
pub(super) fn unfold(state: &mut AppState, copies: CopyRanges) {
    // Triangles have other numbers then.
    state.selection.nodes.only = None;
    state.wanted.unfolded = copies;
}

/// Selects and frames another of the worst nodes. Opens their list where nothing is ranked yet.
pub(super) fn step_ranking(state: &mut AppState, step: RankingStep) {
    let Some(accel) = state.model.presented.as_ref().map(|shown| &shown.accel) else { return };
    let view = state.views.get::<NodesView>();
    if view.ranking.of_tree(accel).is_none() {
        state.preferences.dock.show(NodesView::NAME);
        return;
    }
    if let Some(node) = view.neighbour(accel, state.selection.nodes.selected, places(step)) {
        state.select_node(node);
        camera::frame_selection(state);
    }
}

/// Selects and frames another of the copies with most tests. Opens their list where there is none yet.
pub(super) fn step_copies(state: &mut AppState, step: RankingStep) {
    let Some(accel) = state.model.presented.as_ref().map(|shown| &shown.accel) else { return };
    let view = state.views.get::<CopiesView>();
    if !view.lists(accel) {
        state.views.get_mut::<CopiesView>().show_list();
        state.preferences.dock.show(CopiesView::NAME);
        return;
    }
    if let Some(copy) = view.neighbour(accel, picking::picked_copy(state), places(step)) {
        picking::pick_copy(state, copy);
        camera::frame_selection(state);
    }
}

/// Places down a list.
const fn places(step: RankingStep) -> isize {
    match step {
        RankingStep::Next => 1,
        RankingStep::Previous => -1,
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
                state.wanted.camera.frame_in(&bounds, state.layout.aspect());
            }
        }
    }
}

/// The box around `triangles`; `None` where there are none.
fn bounds_of(scene: &Scene, triangles: &TriangleSet) -> Option<Aabb> {
    let boxes = triangles.iter().filter_map(|triangle| Some(scene.triangles.get(triangle as usize)?.bounds()));
    boxes.reduce(|all, next| all.union(&next))
}

#[cfg(test)]
mod tests {
    use super::place_of;

    #[test]
    fn numbers_are_read_as_they_are_written() {
        for text in ["12", " node 12", "Node 12 ", "n12", "leaf 12", "#12", "1 2", "node #12"] {
            assert_eq!(place_of(text), Some((false, Some(12))), "{text}");
        }
        for text in ["t7", "triangle 7", "Triangle #7", "tri 7"] {
            assert_eq!(place_of(text), Some((true, Some(7))), "{text}");
        }
        assert_eq!(place_of("71,135"), Some((false, Some(71_135))));
        assert_eq!(place_of("99999999999999999999999"), Some((false, None)), "too large");
        for text in ["", "node", "-3", "1.5", "knot 3", "12x"] {
            assert_eq!(place_of(text), None, "{text}");
        }
    }
}
