//! How an action appears in menus and lists: label, description, menu, keys.

use egui::{Key, KeyboardShortcut, Modifiers};

use super::action::Action;

/// Menu of an action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Category {
    /// Models, screenshots, clipboard.
    File,
    /// Camera, picture, window.
    View,
    /// The tree and its nodes.
    Tree,
    /// Measuring.
    Lab,
    /// Command palette, keys, messages.
    Help,
}

impl Category {
    /// All menus, in the order of the menu bar.
    pub const ALL: [Self; 5] = [Self::File, Self::View, Self::Tree, Self::Lab, Self::Help];

    /// The name in the menu bar.
    pub const fn label(self) -> &'static str {
        match self {
            Self::File => "File",
            Self::View => "View",
            Self::Tree => "Tree",
            Self::Lab => "Lab",
            Self::Help => "Help",
        }
    }
}

/// An action as menus and lists show it.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// The action.
    pub action: Action,
    /// Its label.
    pub label: String,
    /// Its tooltip: what it does, in one sentence.
    pub description: String,
    /// Its menu.
    pub category: Category,
    /// Its keys; menus show the first.
    pub shortcuts: Vec<KeyboardShortcut>,
    /// Its group within the menu; groups are separated by lines.
    pub group: u8,
    /// Whether its keys act only while the viewport has the focus; elsewhere they belong to the focused widget.
    pub in_viewport: bool,
}

impl Entry {
    /// All keys as text: `Ctrl+Shift+Z, Ctrl+Y`; empty if there are none.
    pub fn keys(&self) -> String {
        self.shortcuts.iter().map(shortcut_text).collect::<Vec<_>>().join(", ")
    }

    /// The first key as text; empty if there is none.
    pub fn first_key(&self) -> String {
        self.shortcuts.first().map(shortcut_text).unwrap_or_default()
    }
}

/// A key with its modifiers as text: `Ctrl+Shift+Z`.
pub fn shortcut_text(shortcut: &KeyboardShortcut) -> String {
    let Modifiers { alt, ctrl, shift, command, .. } = shortcut.modifiers;
    let mut text = String::new();
    for (held, name) in [(ctrl || command, "Ctrl+"), (alt, "Alt+"), (shift, "Shift+")] {
        if held {
            text.push_str(name);
        }
    }
    let key = match shortcut.logical_key {
        Key::Questionmark => "?",
        Key::OpenBracket => "[",
        Key::CloseBracket => "]",
        Key::ArrowUp => "Up",
        Key::ArrowDown => "Down",
        Key::ArrowLeft => "Left",
        Key::ArrowRight => "Right",
        Key::Escape => "Esc",
        Key::Plus => "+",
        Key::Equals => "=",
        Key::Minus => "-",
        Key::Period => ".",
        Key::Comma => ",",
        key => key.name(),
    };
    text + key
}
