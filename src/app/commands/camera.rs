//! Camera commands: standard views, orbit and zoom steps, up axis, framing.

use glam::{Quat, Vec3};

use super::action::{OrbitStep, ViewDirection};
use crate::app::state::AppState;
use crate::app::viewport::{orbit, pixel};
use crate::view::NamedView;

/// Angle of one orbit step in radians: 5 degrees.
const ORBIT_STEP: f32 = 5.0 * std::f32::consts::PI / 180.0;

/// Views the model from one of its sides.
pub(super) fn view_from(state: &mut AppState, direction: ViewDirection) {
    let up = state.model.up();
    let (front, right) = orbit::front_and_right(up);
    let axis = match direction {
        ViewDirection::Front => front,
        ViewDirection::Back => -front,
        ViewDirection::Right => right,
        ViewDirection::Left => -right,
        ViewDirection::Top => up,
        ViewDirection::Bottom => -up,
    };
    orbit::view_along(&mut state.wanted.camera, axis, up);
}

/// Goes back to a standard view of the model.
pub(super) fn reset(state: &mut AppState, view: NamedView) {
    let up = state.model.up();
    if let Some(shown) = &state.model.presented {
        orbit::reset(&mut state.wanted.camera, view, &shown.accel.scene, up);
    }
}

/// Orbits around the target by one step.
pub(super) fn orbit_step(state: &mut AppState, step: OrbitStep) {
    let (yaw, pitch) = match step {
        OrbitStep::Left => (ORBIT_STEP, 0.0),
        OrbitStep::Right => (-ORBIT_STEP, 0.0),
        OrbitStep::Up => (0.0, ORBIT_STEP),
        OrbitStep::Down => (0.0, -ORBIT_STEP),
    };
    let up = state.model.up();
    orbit::orbit(&mut state.wanted.camera, up, yaw, pitch);
}

/// Zooms by `factor` towards the point under the pointer, or towards the target where the pointer is not over the viewport.
pub(super) fn zoom(state: &mut AppState, factor: f32) {
    let hovered = state.selection.hover.map(|hover| pixel::point_at([hover.x_px, hover.y_px], state));
    let toward = hovered.unwrap_or(state.wanted.camera.target);
    orbit::zoom(&mut state.wanted.camera, factor, toward);
}

/// Switches the up axis between y and z and turns the camera with it, so that the front view stays the front view.
pub(super) fn toggle_up(state: &mut AppState) {
    let Some(source) = state.model.presented.as_ref().map(|shown| shown.accel.scene.source.clone()) else { return };
    let old = state.model.up();
    let new = if old.y.abs() > 0.5 { Vec3::Z } else { Vec3::Y };
    let turn = Quat::from_rotation_arc(old, new);
    let camera = &mut state.wanted.camera;
    camera.eye = camera.target + turn * (camera.eye - camera.target);
    camera.up = (turn * camera.up).normalize_or(new);
    state.model.up_override = Some((source, new));
}

/// Moves the camera so that the selected node, or the model, fills the picture.
pub(super) fn frame_selection(state: &mut AppState) {
    let selected = state.selection.nodes.selected.and_then(|node| {
        let shown = state.model.presented.as_ref()?;
        shown.table.bounds(node)
    });
    if let Some(bounds) = selected.or_else(|| state.model.bounds()) {
        orbit::frame_all(&mut state.wanted.camera, &bounds);
    }
}
