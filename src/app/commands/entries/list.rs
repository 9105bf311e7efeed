//! A list of entries under construction, and shorthands for keys.

use egui::{Key, KeyboardShortcut, Modifiers};

use crate::app::commands::action::Action;
use crate::app::commands::entry::{Category, Entry};

pub(super) const NONE: Modifiers = Modifiers::NONE;
pub(super) const CTRL: Modifiers = Modifiers::COMMAND;
pub(super) const SHIFT: Modifiers = Modifiers::SHIFT;
pub(super) const ALT: Modifiers = Modifiers::ALT;

/// Entries in the order of the menus.
#[derive(Default)]
pub(super) struct List {
    pub(super) entries: Vec<Entry>,
}

impl List {
    /// Adds an action to a group of a menu, with all its keys.
    pub(super) fn add(
        &mut self,
        (category, group): (Category, u8),
        action: Action,
        label: &str,
        description: &str,
        keys: &[(Modifiers, Key)],
    ) {
        self.entries.push(Entry {
            action,
            label: label.to_owned(),
            description: description.to_owned(),
            category,
            shortcuts: keys.iter().map(|&(modifiers, key)| KeyboardShortcut::new(modifiers, key)).collect(),
            group,
            in_viewport: matches!(action, Action::Orbit(_)),
        });
    }
}
