//! The mouse over the viewport into camera moves and picks.

use egui;
use egui::{EventFilter, PointerButton, Pos2, Rect, Response};
use glam::{Vec2, Vec3};

use crate::app::state::{AppState, Navigation};
use crate::app::viewport;
use crate::app::viewport::{fly, orbit, picking};

/// How much nearer one wheel line or the key + brings the model.
pub(crate) const ZOOM_STEP: f32 = 1.15;
/// Points of scrolling that count as one wheel line.
const POINTS_PER_LINE: f32 = 40.0;

/// Lets mouse and keys act on the wanted camera and on the selection.
pub(crate) fn handle(ui: &egui::Ui, response: &Response, state: &mut AppState) {
    if response.clicked() || response.drag_started() {
        response.request_focus();
    }
    if response.has_focus() {
        let filter = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
    }
    drag(ui, response, state);
    wheel(ui, response, state);
    click(ui, response, state);
    state.layout.viewport_focused = response.has_focus();
    // Wherever the focus is: its letters have no other meaning but in a text.
    let typing = ui.ctx().text_edit_focused() || state.layout.palette.is_some();
    if !typing && state.preferences.navigation == Navigation::Fly {
        fly::handle(ui, state);
    }
}

/// The pixel of the picture under a point of the window.
pub(crate) fn pixel_at(at: Pos2, rect: Rect, scale: f32, size_px: [u32; 2]) -> [u32; 2] {
    let inside = (at - rect.min) * scale;
    [(inside.x.max(0.0) as u32).min(size_px[0].max(1) - 1), (inside.y.max(0.0) as u32).min(size_px[1].max(1) - 1)]
}

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
        // Across the height of the viewport is half a turn.
        let angle = delta * (std::f32::consts::PI / height);
        match state.preferences.navigation {
            Navigation::Orbit => orbit::orbit(&mut state.wanted.camera, up, angle.x, angle.y),
            Navigation::Fly => orbit::look(&mut state.wanted.camera, up, angle.x * 0.5, -angle.y * 0.5),
        }
    }
}

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

fn click(ui: &egui::Ui, response: &Response, state: &mut AppState) {
    let Some(at) = response.interact_pointer_pos() else { return };
    let [x, y] = pixel_at(at, response.rect, ui.ctx().pixels_per_point(), state.layout.viewport_px);
    if response.double_clicked() {
        let point = state.model.presented.as_ref().and_then(|shown| picking::surface_point(&shown.frame, x, y));
        match (point, state.model.bounds()) {
            (Some(point), _) => orbit::focus(&mut state.wanted.camera, point),
            (None, Some(bounds)) => {
                let up = state.model.up();
                orbit::reset(&mut state.wanted.camera, &bounds, up);
            }
            (None, None) => {}
        }
    } else if response.clicked_by(PointerButton::Primary) {
        let primitive = state.model.presented.as_ref().and_then(|shown| picking::primitive_at(&shown.frame, x, y));
        picking::pick(state, primitive);
    }
}

/// The point of the surface that a pixel shows; beside the model the point as far away as the target.
pub(crate) fn point_at([x, y]: [u32; 2], state: &AppState) -> Vec3 {
    if let Some(point) = state.model.presented.as_ref().and_then(|shown| picking::surface_point(&shown.frame, x, y)) {
        return point;
    }
    let camera = viewport::shown_camera(state);
    let view = camera.for_size(state.layout.viewport_px[0], state.layout.viewport_px[1]);
    let ray = view.ray(x as f32 + 0.5, y as f32 + 0.5);
    let ahead = ray.direction.dot(camera.forward()).max(1e-3);
    ray.at((camera.target - ray.origin).dot(camera.forward()) / ahead)
}
