//! The table of actions: label, tip, keys, condition, switch and effect of each, one file per menu. Each list is in the order of
//! the menu, in groups that lines separate.

mod edit;
mod file;
mod help;
mod lab;
mod tree;
mod view;

pub(in crate::app) use tree::compare_description;
pub(in crate::app) use view::shading_description;

use egui::Modifiers;

use super::row::{Category, Row};
use crate::app::state::AppState;

/// The rows of a menu in their groups, which lines separate.
pub(super) const fn groups(menu: Category) -> &'static [&'static [Row]] {
    match menu {
        Category::File => file::ROWS,
        Category::Edit => edit::ROWS,
        Category::View => view::ROWS,
        Category::Tree => tree::ROWS,
        Category::Lab => lab::ROWS,
        Category::Help => help::ROWS,
    }
}

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

/// There is a picture with its tree.
fn is_presented(state: &AppState, _: usize) -> bool {
    state.model.presented.is_some()
}
