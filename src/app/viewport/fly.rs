//! Fly mode: W, A, S, D, Q and E through the scene; Shift is faster. The mouse looks around.

use egui;
use egui::Key;
use glam::Vec3;

use crate::app::state::AppState;

/// Model diameters a second.
const SPEED: f32 = 0.4;
/// What Shift multiplies the speed with.
const FASTER: f32 = 4.0;
/// Longest step in seconds, so that a hitch does not throw the observer out of the scene.
const MAX_STEP_SECS: f32 = 0.1;

/// Moves the camera while keys are held.
pub(crate) fn handle(ui: &egui::Ui, state: &mut AppState) {
    let (wish, faster, seconds) = ui.input(|input| {
        let modifiers = input.modifiers;
        if modifiers.ctrl || modifiers.alt || modifiers.command {
            return (Vec3::ZERO, false, 0.0);
        }
        let axis = |plus, minus| f32::from(input.key_down(plus)) - f32::from(input.key_down(minus));
        let wish = Vec3::new(axis(Key::D, Key::A), axis(Key::E, Key::Q), axis(Key::W, Key::S));
        (wish, modifiers.shift, input.stable_dt.min(MAX_STEP_SECS))
    });
    if wish == Vec3::ZERO {
        return;
    }
    let Some(bounds) = state.model.bounds() else { return };
    let up = state.model.up();
    let camera = &mut state.wanted.camera;
    let (right, _, forward) = camera.for_size(1, 1).axes();
    let speed = bounds.extent().length() * SPEED * if faster { FASTER } else { 1.0 };
    let step = (right * wish.x + up * wish.y + forward * wish.z).normalize_or_zero() * speed * seconds;
    camera.eye += step;
    camera.target += step;
    ui.ctx().request_repaint();
}
