//! The keys of the view, while its strip or a row of its lists has the focus.

use egui::{EventFilter, Key, Modifiers, Response, Ui};

use crate::app::state::RayState;
use crate::lab::ray::RayRecord;

/// Applies the keys to the present step, while `response` has the focus.
pub(super) fn handle(ui: &Ui, response: &Response, ray: &mut RayState, record: &RayRecord) {
    if !response.has_focus() {
        return;
    }
    let filter = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
    let pressed = |key| ui.input_mut(|input| input.count_and_consume_key(Modifiers::NONE, key)) as isize;
    let steps = record.steps.len();
    let by = pressed(Key::ArrowRight) - pressed(Key::ArrowLeft);
    if by != 0 {
        ray.step(by, steps);
    }
    for _ in 0..pressed(Key::ArrowDown) {
        next_hit(ray, record);
    }
    if pressed(Key::Home) > 0 {
        ray.go_to(0, steps);
    }
    if pressed(Key::End) > 0 {
        ray.go_to(steps, steps);
    }
    if pressed(Key::Space) > 0 {
        ray.toggle_play(steps);
    }
}

/// Goes to the next step that finds a nearer hit, if there is one.
pub(super) fn next_hit(ray: &mut RayState, record: &RayRecord) {
    if let Some(step) = record.next_hit(ray.cursor) {
        ray.go_to(step, record.steps.len());
    }
}
