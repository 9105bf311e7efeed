//! The table of actions: label, tip, keys, condition, switch and effect of each, one file per menu. Each list is in the order of
//! the menu, in groups that lines separate.

mod edit;
mod file;
mod help;
mod lab;
mod tree;
mod view;

pub(super) use edit::ROWS as EDIT;
pub(super) use file::ROWS as FILE;
pub(super) use help::ROWS as HELP;
pub(super) use lab::ROWS as LAB;
pub(super) use tree::ROWS as TREE;
pub(in crate::app) use tree::compare_description;
pub(super) use view::ROWS as VIEW;
pub(in crate::app) use view::shading_description;

use egui::Modifiers;

use crate::app::state::AppState;

const NONE: Modifiers = Modifiers::NONE;
const CTRL: Modifiers = Modifiers::COMMAND;
const SHIFT: Modifiers = Modifiers::SHIFT;
const ALT: Modifiers = Modifiers::ALT;

/// Inverts a switch.
fn flip(value: &mut bool) {
    *value = !*value;
}

/// Copies `text`, if there is any, and posts the message "Copied" `what`.
fn copy(state: &mut AppState, text: Option<String>, what: &str) {
    if let Some(text) = text {
        state.copy(text, &format!("Copied {what}"));
    }
}

/// Whether there is a picture with its tree.
fn is_presented(state: &AppState, _: usize) -> bool {
    state.model.presented.is_some()
}
