//! Fly mode: W, A, S, D, Q and E move the camera through the scene, faster with Shift. The mouse turns it.

use egui;
use egui::Key;
use glam::Vec3;

use crate::app::state::AppState;

/// Speed in diagonals of the model's bounding box per second.
const SPEED: f32 = 0.4;
/// Factor of the speed while Shift is held.
const FAST_FACTOR: f32 = 4.0;
/// Longest time step in seconds, so that a delayed UI frame does not move the camera out of the scene.
const MAX_STEP_SECS: f32 = 0.1;

/// Moves the camera while keys are held.
pub(crate) fn handle(ui: &egui::Ui, state: &mut AppState) {
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
