//! From the pointer to nodes: the surface below it, and the leaf of the triangle that was clicked.

use glam::Vec3;

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

/// The node drawn at the chosen depths that holds the triangle: the deepest one on its path.
pub fn shown_node_of(state: &AppState, primitive: u32) -> Option<u32> {
    let presented = state.presented.as_ref()?;
    let path = presented.accel.path_to(primitive);
    let [first, last] = state.wanted.overlay.depth;
    path.get(first as usize..path.len().min(last as usize + 1))?.last().copied()
}
