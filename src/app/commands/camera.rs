//! Commands of the camera and of the section plane: standard views, orbit and zoom steps, up axis, framing; where the
//! plane cuts.

use glam::{Quat, Vec3};

use crate::app::state::action::{OrbitStep, SectionStep, ViewDirection};
use crate::app::state::preferences::{self, Bookmark};
use crate::app::state::{AppState, Severity};
use crate::app::viewport::{orbit, picking};
use crate::section::SectionPlane;
use crate::view::{NamedView, of_file};

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
    let (up, aspect) = (state.model.up(), state.layout.aspect());
    if let Some(shown) = &state.model.presented {
        orbit::reset(&mut state.wanted.camera, view, &shown.accel.scene, up, aspect);
    }
}

/// Looks through a camera of the model's file.
pub(super) fn go_to_camera_of_file(state: &mut AppState, index: usize) {
    let scene = state.model.presented.as_ref().map(|shown| &shown.accel.scene);
    if let Some(camera) = scene.and_then(|scene| scene.cameras.get(index)) {
        state.wanted.camera = of_file(camera);
    }
}

/// Keeps the camera as a bookmark of the model, unless it is one already.
pub(super) fn add_bookmark(state: &mut AppState) {
    let text = if let Some(index) = bookmark_here(state) {
        format!("This camera is kept already as {}", state.preferences.bookmarks[index].name)
    } else {
        let (source, camera) = (&state.wanted.source, state.wanted.camera);
        format!("Camera kept as {}", preferences::add_bookmark(&mut state.preferences.bookmarks, source, camera))
    };
    state.messages.notify(Severity::Info, text);
}

/// Index of the model's bookmark that the camera is at.
pub(super) fn bookmark_here(state: &AppState) -> Option<usize> {
    let mut own = preferences::own_bookmarks(&state.preferences.bookmarks, &state.wanted.source);
    own.find(|(_, known)| known.camera == state.wanted.camera).map(|(index, _)| index)
}

/// Sets the camera to a bookmark; reports where it was made for another model.
pub(super) fn go_to_bookmark(state: &mut AppState, index: usize) {
    let Some(Bookmark { name, source, camera }) = state.preferences.bookmarks.get(index).cloned() else { return };
    state.wanted.camera = camera;
    if source == state.wanted.source.absolute() {
        state.messages.notify(Severity::Info, name);
    } else {
        let text = format!("{name} was kept for {}: this model may be out of its view. R resets it", source.label());
        state.messages.notify(Severity::Warning, text);
    }
}

/// Removes the bookmark that the camera is at.
pub(super) fn remove_bookmark(state: &mut AppState) {
    if let Some(index) = bookmark_here(state) {
        let removed = state.preferences.bookmarks.remove(index);
        state.messages.notify(Severity::Info, format!("{} removed", removed.name));
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
    let hovered = state.selection.hover.map(|hover| picking::point_at([hover.x_px, hover.y_px], state));
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
    let selected = state.selected().and_then(|(shown, node)| shown.table.bounds(node));
    if let Some(bounds) = selected.or_else(|| state.model.bounds()) {
        state.wanted.camera.frame_in(&bounds, state.layout.aspect());
    }
}

/// Changes the section plane of the presented model.
pub(super) fn step_section(state: &mut AppState, step: SectionStep) {
    let Some(bounds) = state.model.bounds() else { return };
    let forward = state.wanted.camera.forward();
    let section = &mut state.wanted.render.section;
    // The half towards the viewer goes, so that the cut is seen.
    let across = |normal: Vec3| {
        let plane = SectionPlane::through(&bounds, normal);
        SectionPlane { flipped: plane.normal.dot(forward) > 0.0, ..plane }
    };
    *section = match (step, *section) {
        (SectionStep::Toggle, Some(_)) | (SectionStep::Snap | SectionStep::Flip, None) => None,
        (SectionStep::Toggle | SectionStep::X, _) => Some(across(Vec3::X)),
        (SectionStep::Y, _) => Some(across(Vec3::Y)),
        (SectionStep::Z, _) => Some(across(Vec3::Z)),
        (SectionStep::Facing, _) => Some(across(-forward)),
        (SectionStep::Snap, Some(plane)) => Some(plane.snapped(&bounds)),
        (SectionStep::Flip, Some(plane)) => Some(SectionPlane { flipped: !plane.flipped, ..plane }),
    };
    // The cut is seen in the picture.
    state.preferences.show_geometry |= state.wanted.render.section.is_some();
}

/// The step can be performed now.
pub(super) fn can_step_section(state: &AppState, step: SectionStep) -> bool {
    let section = state.wanted.render.section;
    match step {
        SectionStep::Snap => section.is_some_and(|plane| plane.axis().is_none()),
        SectionStep::Flip => section.is_some(),
        _ => state.model.presented.is_some(),
    }
}

/// State of a switch or choice; `None` for other steps.
pub(super) fn is_section_on(state: &AppState, step: SectionStep) -> Option<bool> {
    let axis = state.wanted.render.section.map(|plane| plane.axis());
    match step {
        SectionStep::Toggle => Some(axis.is_some()),
        SectionStep::X => Some(axis == Some(Some(0))),
        SectionStep::Y => Some(axis == Some(Some(1))),
        SectionStep::Z => Some(axis == Some(Some(2))),
        SectionStep::Facing => Some(axis == Some(None)),
        SectionStep::Snap | SectionStep::Flip => None,
    }
}
