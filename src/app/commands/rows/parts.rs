//! Modifiers, conditions and effects that several rows use.

use egui::Modifiers;

use crate::app::state::AppState;

pub(super) const NONE: Modifiers = Modifiers::NONE;
pub(super) const CTRL: Modifiers = Modifiers::COMMAND;
pub(super) const SHIFT: Modifiers = Modifiers::SHIFT;
pub(super) const ALT: Modifiers = Modifiers::ALT;

/// Inverts a switch.
pub(super) fn flip(value: &mut bool) {
    *value = !*value;
}

/// Copies `text`, if there is any, and posts the message "Copied" `what`.
pub(super) fn copy(state: &mut AppState, text: Option<String>, what: &str) {
    if let Some(text) = text {
        state.copy(text, &format!("Copied {what}"));
    }
}

/// There is a picture with its tree.
pub(super) fn is_presented(state: &AppState, _: usize) -> bool {
    state.model.presented.is_some()
}
