//! Mouse and keys over the viewport: camera moves, fly mode and picking.

use egui::{CursorIcon, EventFilter, Key, PointerButton, Response};
use glam::{Vec2, Vec3};

use super::picking::{pixel_at, point_at};
use super::sides::side_at;
use super::{orbit, picking};
use crate::app::state::{AppState, Navigation, TreeSide};
use crate::view::NamedView;

/// Zoom factor of one wheel line or one press of the key +.
pub(crate) const ZOOM_STEP: f32 = 1.15;
/// Scroll distance of one wheel line in points.
const POINTS_PER_LINE: f32 = 40.0;

/// Applies mouse and keys to the wanted camera and the selection.
pub(crate) fn handle(ui: &egui::Ui, response: &Response, state: &mut AppState) {
    if response.clicked() || response.drag_started() {
        response.request_focus();
    }
    if response.has_focus() {
        let filter = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
    }
    if response.hovered() && !response.dragged() && state.picks_rays() {
        ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
    }
    drag(ui, response, state);
    wheel(ui, response, state);
    click(ui, response, state);
    state.layout.viewport_focused = response.has_focus();
    // Wherever the focus is: the letter keys mean nothing else, except while typing.
    let typing = ui.ctx().text_edit_focused() || state.layout.palette.is_some();
    if !typing && state.preferences.navigation == Navigation::Fly {
        fly(ui, state);
    }
}

/// Drags: orbit or look around; pan with the other buttons or Shift.
fn drag(ui: &egui::Ui, response: &Response, state: &mut AppState) {
    let delta = response.drag_delta();
    if delta == egui::Vec2::ZERO {
        return;
    }
    let height = response.rect.height().max(1.0);
    let shift = ui.input(|input| input.modifiers.shift);
    let panning = response.dragged_by(PointerButton::Secondary)
        || response.dragged_by(PointerButton::Middle)
        || (response.dragged_by(PointerButton::Primary) && shift);
    let up = state.model.up();
    if panning {
        orbit::pan(&mut state.wanted.camera, Vec2::new(delta.x, delta.y), height);
    } else if response.dragged_by(PointerButton::Primary) {
        // A drag across the height of the viewport is half a turn.
        let angle = delta * (std::f32::consts::PI / height);
        match state.preferences.navigation {
            Navigation::Orbit => orbit::orbit(&mut state.wanted.camera, up, angle.x, angle.y),
            Navigation::Fly => orbit::look(&mut state.wanted.camera, up, angle.x * 0.5, -angle.y * 0.5),
        }
    }
}

/// Wheel and pinch: zoom to the point under the pointer.
fn wheel(ui: &egui::Ui, response: &Response, state: &mut AppState) {
    let Some(at) = response.hover_pos() else { return };
    let (scroll, pinch) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
    let factor = ZOOM_STEP.powf(scroll / POINTS_PER_LINE) * pinch;
    if (factor - 1.0).abs() > 1e-5 {
        let pixel = pixel_at(at, response.rect, ui.ctx().pixels_per_point(), state.layout.viewport_px);
        let toward = point_at(pixel, state);
        orbit::zoom(&mut state.wanted.camera, factor, toward);
    }
}

/// Click: select, or take the ray of the pixel. Double click: focus on a point, or reset the view on the background.
fn click(ui: &egui::Ui, response: &Response, state: &mut AppState) {
    let Some(at) = response.interact_pointer_pos() else { return };
    let [x, y] = pixel_at(at, response.rect, ui.ctx().pixels_per_point(), state.layout.viewport_px);
    if response.double_clicked() {
        let point = state.model.presented.as_ref().and_then(|shown| picking::surface_point(&shown.frame, x, y));
        let (up, aspect) = (state.model.up(), state.layout.aspect());
        match (point, &state.model.presented) {
            (Some(point), _) => orbit::focus(&mut state.wanted.camera, point),
            (None, Some(shown)) => {
                orbit::reset(&mut state.wanted.camera, NamedView::Default, &shown.accel.scene, up, aspect);
            }
            (None, None) => {}
        }
    } else if response.clicked_by(PointerButton::Primary) && state.picks_rays() {
        state.take_ray([x, y]);
    } else if response.clicked_by(PointerButton::Primary) {
        let side = side_at(state, at, response.rect);
        let primitive = state.shown_tree(side).and_then(|shown| picking::primitive_at(&shown.frame, x, y));
        match side {
            TreeSide::A => picking::pick(state, primitive),
            TreeSide::B => picking::pick_in_second(state, primitive),
        }
    } else if response.clicked_by(PointerButton::Secondary) {
        let primitive = state.model.presented.as_ref().and_then(|shown| picking::primitive_at(&shown.frame, x, y));
        picking::pick_for_menu(state, primitive);
        state.layout.node_menu = Some([at.x, at.y]);
    }
}

/// Speed in diagonals of the model's bounding box per second.
const SPEED: f32 = 0.4;
/// Factor of the speed while Shift is held.
const FAST_FACTOR: f32 = 4.0;
/// Longest time step in seconds, so that a delayed UI frame does not move the camera out of the scene.
const MAX_STEP_SECS: f32 = 0.1;

/// Moves the camera while keys are held.
pub(crate) fn fly(ui: &egui::Ui, state: &mut AppState) {
    let (direction, faster, seconds) = ui.input(|input| {
        let modifiers = input.modifiers;
        if modifiers.ctrl || modifiers.alt || modifiers.command {
            return (Vec3::ZERO, false, 0.0);
        }
        let axis = |plus, minus| f32::from(input.key_down(plus)) - f32::from(input.key_down(minus));
        let direction = Vec3::new(axis(Key::D, Key::A), axis(Key::E, Key::Q), axis(Key::W, Key::S));
        (direction, modifiers.shift, input.stable_dt.min(MAX_STEP_SECS))
    });
    if direction == Vec3::ZERO {
        return;
    }
    let Some(bounds) = state.model.bounds() else { return };
    let up = state.model.up();
    let camera = &mut state.wanted.camera;
    let (right, _, forward) = camera.for_size(1, 1).axes();
    let speed = bounds.extent().length() * SPEED * if faster { FAST_FACTOR } else { 1.0 };
    let step = (right * direction.x + up * direction.y + forward * direction.z).normalize_or_zero() * speed * seconds;
    camera.eye += step;
    camera.target += step;
    ui.ctx().request_repaint();
}
