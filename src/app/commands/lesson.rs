//! Reading lessons: begin, next step, back, and the reader's own settings at the end.

use super::share::{shared_state, show_state};
use crate::app::state::AppState;
use crate::app::state::lesson::Reading;

/// Begins the lesson of this index. What the window shows is put aside, once.
pub(super) fn begin(state: &mut AppState, index: usize) {
    let Some(lesson) = state.layout.lessons.get(index).cloned() else { return };
    let put_aside = state.layout.lesson.take().map_or_else(|| shared_state(state), |reading| *reading.put_aside);
    state.layout.close_dialogs();
    state.layout.tour = None;
    state.layout.lesson = Some(Reading::new(lesson, put_aside));
    show_step(state);
}

/// Shows the next step, or ends the lesson after its last.
pub(super) fn next(state: &mut AppState) {
    let Some(reading) = &mut state.layout.lesson else { return };
    if reading.step + 1 < reading.lesson.steps.len() {
        reading.step += 1;
        show_step(state);
    } else {
        leave(state);
    }
}

/// Shows the step before.
pub(super) fn back(state: &mut AppState) {
    let Some(reading) = state.layout.lesson.as_mut().filter(|reading| reading.step > 0) else { return };
    reading.step -= 1;
    show_step(state);
}

/// Ends the lesson; the reader's own state comes back.
pub(super) fn leave(state: &mut AppState) {
    if let Some(reading) = state.layout.lesson.take() {
        show_state(state, *reading.put_aside);
    }
}

fn show_step(state: &mut AppState) {
    if let Some(shared) = state.layout.lesson.as_ref().map(|reading| reading.current().state.clone()) {
        show_state(state, shared);
    }
}
