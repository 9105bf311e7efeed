//! From a click to nodes: the triangle under the cursor, its leaf, the path to the root, and walking from there.

use std::sync::Arc;

use glam::Vec3;

use super::orbit;
use super::state::AppState;
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
    state.picked = None;
    state.selection.selected = None;
    let (Some(primitive), Some(presented)) = (primitive, &state.presented) else { return };
    let path = presented.accel.path_to(primitive);
    state.selection.selected = path.last().copied();
    state.picked = (!path.is_empty()).then_some((primitive, path));
}

/// Clears what is selected; hidden nodes stay hidden.
pub fn clear_selection(state: &mut AppState) {
    pick(state, None);
}

/// Selects a node of the tree.
pub fn select_node(state: &mut AppState, node: u32) {
    let known = state.presented.as_ref().is_some_and(|presented| (node as usize) < presented.table.parents.len());
    if known {
        state.selection.selected = Some(node);
    }
}

/// Selects the parent of the selected node; the root's is itself.
pub fn select_parent(state: &mut AppState) {
    if let (Some(node), Some(presented)) = (state.selection.selected, &state.presented)
        && let Some(&parent) = presented.table.parents.get(node as usize)
    {
        select_node(state, parent);
    }
}

/// Selects the other child of the selected node's parent.
pub fn select_sibling(state: &mut AppState) {
    if let (Some(node), Some(presented)) = (state.selection.selected, &state.presented)
        && let Some(&parent) = presented.table.parents.get(node as usize)
        && parent != node
        && let Some([first, second]) = presented.table.children(parent)
    {
        select_node(state, if node == first { second } else { first });
    }
}

/// Selects a child of the selected node: the one on the path to the picked triangle, else the first. A leaf has none.
pub fn select_child(state: &mut AppState) {
    let Some(presented) = &state.presented else { return };
    let Some(node) = state.selection.selected else {
        select_node(state, 0);
        return;
    };
    let Some([first, _]) = presented.table.children(node) else { return };
    let on_path = state.picked.as_ref().and_then(|(_, path)| {
        let at = path.iter().position(|&step| step == node)?;
        path.get(at + 1).copied()
    });
    select_node(state, on_path.unwrap_or(first));
}

/// Leaves the selected node, and what is below it, out of the overlay, and moves on to its parent.
pub fn hide_selected(state: &mut AppState) {
    let (Some(node), Some(presented)) = (state.selection.selected, &state.presented) else { return };
    let table = Arc::clone(&presented.table);
    let mut below = vec![node];
    while let Some(next) = below.pop() {
        state.selection.hidden.insert(next);
        below.extend(table.children(next).into_iter().flatten());
    }
    select_parent(state);
}

/// Shows every node again.
pub fn show_all(state: &mut AppState) {
    state.selection.hidden.clear();
}

/// Brings the selected node into full view; the whole model where nothing is selected.
pub fn frame_selection(state: &mut AppState) {
    let Some(presented) = &state.presented else { return };
    let bounds = state.selection.selected.map_or(presented.accel.scene.bounds, |node| presented.table.node_box(node));
    orbit::frame_all(&mut state.wanted.camera, &bounds);
}

/// The node drawn at the chosen depths that holds the triangle: the deepest one on its path.
pub fn shown_node_of(state: &AppState, primitive: u32) -> Option<u32> {
    let presented = state.presented.as_ref()?;
    let path = presented.accel.path_to(primitive);
    let [first, last] = state.wanted.overlay.depth;
    path.get(first as usize..path.len().min(last as usize + 1))?.last().copied()
}
