//! The viewport of one tree or two: the picture with its containers, two pictures side by side, or the difference.

use std::sync::Arc;

use egui::{Pos2, Rect};

use super::choice::{drawable, drawn_selection, drawn_table};
use super::draw::{OverlayCallback, Tinted};
use crate::app::state::{AppState, CompareView, Presented, SecondNodes, TreeSide};
use crate::overlay::{Selection, Shown};

/// The draws of the viewport, each with the part of `rect` that it covers. `tinted` is the first tree's picture with the selected
/// triangles tinted.
pub(super) fn callbacks(
    state: &AppState,
    presented: &Presented,
    tinted: Option<Tinted>,
    rect: Rect,
) -> Vec<(Rect, OverlayCallback)> {
    let first = |tinted| callback(state, presented, (TreeSide::A, TreeSide::A), tinted, rect);
    let second =
        |slot| state.model.second.as_ref().map(|second| callback(state, second, (TreeSide::B, slot), None, rect));
    match state.shown_view() {
        CompareView::A => vec![(rect, first(tinted))],
        CompareView::B => second(TreeSide::A).map(|callback| (rect, callback)).into_iter().collect(),
        CompareView::Split => {
            let [left, right] = split(rect, state.wanted.second.map_or(0.5, |second| second.seam));
            let second = second(TreeSide::B).map(|callback| (right, callback));
            std::iter::once((left, first(tinted))).chain(second).collect()
        }
        CompareView::Difference => {
            let Some(difference) = &state.model.difference else { return Vec::new() };
            let picture = Tinted { id: difference.picture_id, rgba: Arc::clone(&difference.map.rgba) };
            // The pictures that the map was made of, which may be older than those on the screen.
            let frame = Arc::clone(&difference.map.frames[0]);
            vec![(rect, OverlayCallback { frame, ..first(Some(picture)) })]
        }
    }
}

/// The parts of `rect` left and right of the seam.
pub(crate) fn split(rect: Rect, seam: f32) -> [Rect; 2] {
    let (left, right) = rect.split_left_right_at_fraction(seam);
    [left, right]
}

/// The tree whose picture is at a point of `rect`, the viewport's rectangle.
pub(super) fn side_at(state: &AppState, at: Pos2, rect: Rect) -> TreeSide {
    match state.shown_view() {
        CompareView::A | CompareView::Difference => TreeSide::A,
        CompareView::B => TreeSide::B,
        CompareView::Split => {
            let [_, right] = split(rect, state.wanted.second.map_or(0.5, |second| second.seam));
            if right.x_range().contains(at.x) { TreeSide::B } else { TreeSide::A }
        }
    }
}

/// The draw of a picture with the containers of its tree `side`, by the GPU objects `slot`.
fn callback(
    state: &AppState,
    shown: &Presented,
    (side, slot): (TreeSide, TreeSide),
    tinted: Option<Tinted>,
    rect: Rect,
) -> OverlayCallback {
    let (nodes, table, selection) = match side {
        TreeSide::A => (&state.layout.graphics.shown, drawn_table(state, shown), drawn_selection(state)),
        // Merges are shown in the first tree.
        TreeSide::B => {
            let SecondNodes { hovered, selected, .. } = state.selection.second;
            let selection = Selection { selected, hovered, ..Selection::default() };
            (&state.layout.graphics.second_shown, &shown.table, selection)
        }
    };
    OverlayCallback {
        frame: Arc::clone(&shown.frame),
        frame_id: shown.frame_id,
        tinted,
        table: (state.shows_containers() || selection.has_ray()).then(|| Arc::clone(table)),
        shown: nodes.clone().unwrap_or_else(|| Arc::new(Shown::NOTHING)),
        settings: drawable(state, table),
        selection,
        rect,
        show_picture: state.preferences.show_geometry,
        side: slot,
        has_second: state.wanted.second.is_some(),
    }
}

/// The nodes of the second tree that are hidden: those with the same triangles as the hidden nodes of the first.
pub(super) fn hidden_in_second(state: &AppState, second: &Presented) -> Selection {
    let mut nodes = Selection::default();
    state.selection.hidden.clone().resolve(&second.accel, &mut nodes);
    nodes
}
