//! What is drawn of one tree or two: the picture with its containers, two pictures side by side, or the difference. The
//! presented picture with the selected triangles tinted, made once per picture and selection.

use std::sync::Arc;

use egui::{Pos2, Rect};

use super::choice::{drawable, drawn_selection, drawn_table};
use super::draw::OverlayCallback;
use crate::app::state::{AppState, CompareView, Preferences, Presented, SecondNodes, TreeSide};
use crate::overlay::{Selection, Shown, tinted};
use crate::visibility::TriangleSet;

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
    let Preferences { show_geometry, show_containers, .. } = state.preferences;
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
        table: (show_containers || selection.has_ray()).then(|| Arc::clone(table)),
        shown: nodes.clone().unwrap_or_else(|| Arc::new(Shown::NOTHING)),
        settings: drawable(state, table),
        selection,
        rect,
        show_picture: show_geometry,
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

/// A tinted picture.
#[derive(Clone)]
pub(crate) struct Tinted {
    /// Identifies it among tinted and plain pictures.
    pub(crate) id: u64,
    /// Its pixels, as those of the frame.
    pub(crate) rgba: Arc<Vec<[u8; 4]>>,
}

/// Set in the ids of tinted pictures, which plain ones do not have.
const TINTED: u64 = 1 << 63;

/// Nodes whose triangles are collected in one UI frame.
const NODES_PER_FRAME: usize = 100_000;

/// Triangles below a node, as far as they are collected.
struct Collected {
    triangles: TriangleSet,
    /// The nodes that are still to be visited.
    open: Vec<u32>,
}

/// The picture tinted last, and what it was made from.
#[derive(Default)]
pub(crate) struct Tint {
    /// Table and node, and the triangles below the node.
    selected: Option<((u64, u32), Collected)>,
    /// Picture, table and node.
    last: Option<((u64, u64, u32), Tinted)>,
    count: u64,
}

impl Tint {
    /// The presented picture with the triangles of the selected node tinted; `None` where none is selected, or the root, which
    /// is everything, and where colours stand for values.
    pub(crate) fn update(&mut self, state: &AppState, presented: &Presented) -> Option<Tinted> {
        let exists = |node: &u32| (1..presented.table.len() as u32).contains(node);
        let is_coded = presented.frame.settings.shading.is_coded();
        let Some(node) = state.selection.nodes.selected.filter(|node| exists(node) && !is_coded) else {
            self.selected = None;
            return None;
        };
        let table = presented.table.id;
        let key = (presented.frame_id, table, node);
        if let Some((_, tinted)) = self.last.as_ref().filter(|(last, _)| *last == key) {
            return Some(tinted.clone());
        }
        let mut selected = if let Some((last, collected)) = self.selected.take()
            && last == (table, node)
        {
            collected
        } else {
            let triangles = TriangleSet::none(presented.accel.scene.triangles.len());
            Collected { triangles, open: vec![node] }
        };
        presented.table.collect_triangles(&mut selected.open, &mut selected.triangles, NODES_PER_FRAME);
        let Collected { triangles, open } = &selected;
        let tinted = open.is_empty().then(|| {
            self.count += 1;
            let rgba = Arc::new(tinted(&presented.frame.rgba, &presented.frame.primitive, triangles));
            Tinted { id: TINTED | self.count, rgba }
        });
        self.selected = Some(((table, node), selected));
        let tinted = tinted?;
        self.last = Some((key, tinted.clone()));
        Some(tinted)
    }

    /// Whether the triangles of the selected node are still being collected.
    pub(crate) fn is_collecting(&self) -> bool {
        self.selected.as_ref().is_some_and(|(_, collected)| !collected.open.is_empty())
    }
}
