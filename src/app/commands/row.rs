//! A row of the table of actions, and an entry of it in menus, palette, keys and help.

use egui::{Key, KeyboardShortcut, Modifiers};

use crate::app::state::AppState;
use crate::app::state::action::Action;

pub(super) type Keys = &'static [(Modifiers, Key)];

/// Menu of an action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Category {
    /// Models, tree files, screenshots.
    File,
    /// Undo, the selection, the clipboard.
    Edit,
    /// Camera, picture, window.
    View,
    /// How the tree is built and which of its nodes are drawn.
    Tree,
    /// Measuring.
    Lab,
    /// Command palette, keys, messages.
    Help,
}

impl Category {
    /// All menus, in the order of the menu bar.
    pub const ALL: [Self; 6] = [Self::File, Self::Edit, Self::View, Self::Tree, Self::Lab, Self::Help];

    /// The name in the menu bar.
    pub const fn label(self) -> &'static str {
        match self {
            Self::File => "File",
            Self::Edit => "Edit",
            Self::View => "View",
            Self::Tree => "Tree",
            Self::Lab => "Lab",
            Self::Help => "Help",
        }
    }
}

/// Everything about one action, or about a family of actions that differ by an index.
#[derive(Clone, Copy)]
pub(super) struct Row {
    pub(super) items: Items,
    /// The submenu that it is in; empty for none.
    submenu: &'static str,
    /// It can be performed now. The index is that of the item; 0 for a single action.
    pub(super) enabled: fn(&AppState, usize) -> bool,
    /// State of a switch or choice; `None` for other actions.
    pub(super) on: fn(&AppState, usize) -> Option<bool>,
    pub(super) perform: fn(&mut AppState, usize),
    /// The action repeats while its key is held.
    pub(super) repeats: bool,
    /// Why it cannot be performed, where that is not plain to see; empty otherwise.
    pub(super) reason: &'static str,
    /// Its keys act only while the viewport has the focus; elsewhere they belong to the focused widget.
    pub(super) in_viewport: bool,
    /// Its keys belong to the focused widget, if that is not the viewport.
    pub(super) yields: bool,
}

/// The actions of a row.
#[derive(Clone, Copy)]
pub(super) enum Items {
    One {
        action: Action,
        label: &'static str,
        tip: &'static str,
        keys: Keys,
    },
    /// The same in every state.
    Fixed(fn() -> Vec<Item>),
    /// Of the present state: recent files, bookmarks, lessons.
    Current(fn(&AppState) -> Vec<Item>),
}

/// An action of a family.
pub(super) struct Item {
    pub(super) action: Action,
    pub(super) label: String,
    /// The effect, in one sentence.
    pub(super) tip: String,
    pub(super) key: Option<(Modifiers, Key)>,
}

/// An action of a family without a key.
pub(super) fn item(action: Action, label: impl Into<String>, tip: impl Into<String>) -> Item {
    Item { action, label: label.into(), tip: tip.into(), key: None }
}

/// A row of one action that can always be performed.
pub(super) const fn one(
    action: Action,
    label: &'static str,
    tip: &'static str,
    keys: Keys,
    perform: fn(&mut AppState, usize),
) -> Row {
    Row { items: Items::One { action, label, tip, keys }, ..many(Vec::new, perform) }
}

/// A row of a family whose actions can always be performed. `perform` takes the index in the list.
pub(super) const fn many(items: fn() -> Vec<Item>, perform: fn(&mut AppState, usize)) -> Row {
    Row {
        items: Items::Fixed(items),
        submenu: "",
        enabled: |_, _| true,
        on: |_, _| None,
        perform,
        repeats: false,
        reason: "",
        in_viewport: false,
        yields: false,
    }
}

/// A row of a family that depends on the state.
pub(super) const fn current(items: fn(&AppState) -> Vec<Item>, perform: fn(&mut AppState, usize)) -> Row {
    Row { items: Items::Current(items), ..many(Vec::new, perform) }
}

impl Row {
    /// In a submenu, which holds all rows beside each other that name it.
    pub(super) const fn within(self, submenu: &'static str) -> Self {
        Self { submenu, ..self }
    }

    /// With the condition under which it can be performed.
    pub(super) const fn when(self, enabled: fn(&AppState, usize) -> bool) -> Self {
        Self { enabled, ..self }
    }

    /// With the reason that its keys give where it cannot be performed.
    pub(super) const fn because(self, reason: &'static str) -> Self {
        Self { reason, ..self }
    }

    /// As a switch or choice that is on or off.
    pub(super) const fn switch(self, on: fn(&AppState, usize) -> Option<bool>) -> Self {
        Self { on, ..self }
    }

    /// Repeated while its key is held.
    pub(super) const fn repeated(self) -> Self {
        Self { repeats: true, ..self }
    }

    /// With keys that a focused widget keeps.
    pub(super) const fn yielding(self) -> Self {
        Self { yields: true, ..self }
    }

    /// With keys that act only while the viewport has the focus.
    pub(super) const fn in_viewport(self) -> Self {
        Self { in_viewport: true, ..self }
    }

    /// The entries whose actions do not depend on the state.
    pub(super) fn entries(&'static self, category: Category, group: usize) -> Vec<Entry> {
        match self.items {
            Items::One { action, label, tip, keys } => {
                let item = item(action, label, tip);
                vec![Entry { shortcuts: shortcuts(keys), ..self.entry(category, group, 0, item) }]
            }
            Items::Fixed(items) => self.family(category, group, items()),
            Items::Current(_) => Vec::new(),
        }
    }

    pub(super) fn family(&'static self, category: Category, group: usize, items: Vec<Item>) -> Vec<Entry> {
        items.into_iter().enumerate().map(|(index, item)| self.entry(category, group, index, item)).collect()
    }

    fn entry(&'static self, category: Category, group: usize, index: usize, item: Item) -> Entry {
        let Item { action, label, tip, key } = item;
        Entry {
            action,
            label,
            description: tip,
            category,
            shortcuts: shortcuts(key.as_slice()),
            group,
            submenu: self.submenu,
            row: self,
            index,
        }
    }
}

fn shortcuts(keys: &[(Modifiers, Key)]) -> Vec<KeyboardShortcut> {
    keys.iter().map(|&(modifiers, key)| KeyboardShortcut::new(modifiers, key)).collect()
}

/// An action as menus and lists show it.
#[derive(Clone)]
pub struct Entry {
    /// The action.
    pub action: Action,
    /// Its label.
    pub label: String,
    /// Its tooltip: the effect, in one sentence.
    pub description: String,
    /// Its menu.
    pub category: Category,
    /// Its keys; menus show the first.
    pub shortcuts: Vec<KeyboardShortcut>,
    /// Its group within the menu; groups are separated by lines.
    pub group: usize,
    /// Its submenu; empty for none.
    pub submenu: &'static str,
    pub(super) row: &'static Row,
    pub(super) index: usize,
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
