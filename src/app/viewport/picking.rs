//! From the pointer to nodes: the surface below it, and the leaf of the triangle that was clicked.

use glam::Vec3;

use crate::app::state::{AppState, PickedTriangle};
use crate::render::Frame;

/// The point of the surface that the wanted pixel (x, y) of `frame` shows; `None` on the background.
pub fn surface_point(frame: &Frame, x_px: u32, y_px: u32) -> Option<Vec3> {
    let index = frame.index_of(x_px, y_px);
    let distance = *frame.distance.get(index)?;
    if !distance.is_finite() {
        return None;
    }
    let (x, y) = (index as u32 % frame.width_px, index as u32 / frame.width_px);
    let ray = frame.camera.for_size(frame.width_px, frame.height_px).ray(x as f32 + 0.5, y as f32 + 0.5);
    Some(ray.at(distance))
}

/// The triangle that the wanted pixel (x, y) of `frame` shows.
pub fn primitive_at(frame: &Frame, x_px: u32, y_px: u32) -> Option<u32> {
    frame.primitive.get(frame.index_of(x_px, y_px)).copied().filter(|&primitive| primitive != u32::MAX)
}

/// Selects a triangle with its leaf; `None` clears the selection.
pub fn pick(state: &mut AppState, primitive: Option<u32>) {
    state.selection.picked = None;
    state.selection.nodes.selected = None;
    let (Some(primitive), Some(presented)) = (primitive, &state.model.presented) else { return };
    let path = presented.accel.path_to(primitive);
    state.selection.nodes.selected = path.last().copied();
    state.selection.picked = (!path.is_empty()).then_some(PickedTriangle { primitive, path });
}

/// What is selected, in words that mean something in another tree of the same scene.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Selected {
    /// The picked triangle.
    picked: Option<u32>,
    /// The selected node: a triangle below it and its depth, `None` for the leaf.
    node: Option<(u32, Option<usize>)>,
}

/// What is selected now.
pub(crate) fn selected(state: &AppState) -> Selected {
    let node = state.model.presented.as_ref().zip(state.selection.nodes.selected).and_then(|(shown, node)| {
        let on_path = state.selection.picked.as_ref().and_then(|PickedTriangle { primitive, path }| {
            let depth = path.iter().position(|&step| step == node)?;
            Some((*primitive, (depth + 1 < path.len()).then_some(depth)))
        });
        on_path.or_else(|| {
            let primitive = shown.accel.tree.first_primitive_below(node)?;
            let leaf = shown.table.is_leaf(node);
            Some((primitive, (!leaf).then(|| shown.table.depth(node) as usize)))
        })
    });
    Selected { picked: state.selection.picked.as_ref().map(|picked| picked.primitive), node }
}

/// Selects it in the tree that is presented now: the same triangle, and of the node that was selected what stands in its
/// place: the leaf of its triangle, or that leaf's ancestor at the same depth, or the leaf where that lies higher.
pub(crate) fn select_again(state: &mut AppState, selected: Selected) {
    pick(state, selected.picked);
    let Some((primitive, depth)) = selected.node else {
        state.selection.nodes.selected = None;
        return;
    };
    let path = state.model.presented.as_ref().map_or_else(Vec::new, |shown| shown.accel.path_to(primitive));
    let leaf = path.last().copied();
    state.selection.nodes.selected = depth.and_then(|depth| path.get(depth).copied()).or(leaf);
}

/// The node drawn at the chosen depths that holds the triangle: the deepest one on its path.
pub fn shown_node_of(state: &AppState, primitive: u32) -> Option<u32> {
    let presented = state.model.presented.as_ref()?;
    let path = presented.accel.path_to(primitive);
    let [first, last] = state.wanted.overlay.depth;
    path.get(first as usize..path.len().min(last as usize + 1))?.last().copied()
}
