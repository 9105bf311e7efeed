//! Keyboard shortcuts, and the list of all keys and mouse gestures for the help dialog and `docs/keys.md`.

use egui::{self, Event, Key, Modifiers};

use super::clipboard::paste_state;
use super::entries::entries;
use super::row::{Category, Entry};
use crate::app::state::action::Action;
use crate::app::state::{AppState, Severity};

/// Performs the actions whose keys were pressed. A focused text field keeps its keys; so does the open palette, except for
/// Ctrl+P, F1 and Esc.
pub fn handle_shortcuts(ctx: &egui::Context, state: &mut AppState) {
    let typing = ctx.text_edit_focused() || (state.layout.palette.is_some() && ctx.egui_wants_keyboard_input());
    let focused_elsewhere = !state.layout.viewport_focused && ctx.memory(|memory| memory.focused().is_some());
    // Esc first closes an open drop-down list or menu.
    let popup_open = egui::Popup::is_any_open(ctx);
    let (mut actions, mut pasted) = (Vec::new(), None);
    ctx.input_mut(|input| {
        input.events.retain(|event| {
            if let (Event::Paste(text), false) = (event, typing) {
                pasted = Some(text.clone());
                return false;
            }
            let Event::Key { key, pressed: true, modifiers, repeat, .. } = event else { return true };
            let Some(entry) = entry_of(*key, *modifiers) else { return true };
            let is_kept = entry.row.yields && focused_elsewhere;
            if is_kept || entry.row.in_viewport && !state.layout.viewport_focused {
                return true;
            }
            let action = entry.action;
            if action == Action::Cancel && popup_open {
                return true;
            }
            let opens_dialog =
                matches!(action, Action::Palette | Action::Shortcuts | Action::Glossary) && *key != Key::Questionmark;
            let closes_dialog = action == Action::Cancel && dialogs_open(state);
            // A letter typed at a window in front is meant for its field, even before that has the focus.
            let is_letter = !(modifiers.any() || key.name().len() > 1 && key.name().starts_with('F'));
            if is_letter && state.layout.has_dialog() && !closes_dialog {
                return true;
            }
            if (typing || state.layout.palette.is_some()) && !opens_dialog && !closes_dialog {
                return true;
            }
            if !repeat || entry.row.repeats {
                actions.push((action, entry.row.reason));
            }
            false
        });
    });
    if let Some(text) = pasted {
        paste_state(state, &text);
    }
    for (action, reason) in actions {
        if action.is_enabled(state) || action == Action::Cancel {
            action.perform(state);
        } else if !reason.is_empty() {
            state.messages.notify(Severity::Info, reason);
        }
    }
}

/// The entry whose shortcut is this key with exactly these modifiers.
fn entry_of(key: Key, modifiers: Modifiers) -> Option<&'static Entry> {
    let matches = |wanted: &egui::KeyboardShortcut| {
        let shift_is_part_of_key = matches!(key, Key::Questionmark | Key::Plus);
        let shift = shift_is_part_of_key || wanted.modifiers.shift == modifiers.shift;
        wanted.logical_key == key
            && shift
            && wanted.modifiers.alt == modifiers.alt
            && wanted.modifiers.command == (modifiers.command || modifiers.ctrl)
    };
    entries().iter().find(|entry| entry.shortcuts.iter().any(matches))
}

/// Whether a dialog is open.
fn dialogs_open(state: &AppState) -> bool {
    state.layout.palette.is_some() || state.layout.has_dialog()
}

/// Mouse gestures, each with its effect.
const GESTURES: [(&str, &str); 11] = [
    ("Left drag", "Orbit around the target"),
    ("Wheel", "Zoom to the point under the pointer"),
    ("Right drag, middle drag, Shift+left drag", "Pan"),
    ("Click", "Select the triangle, its leaf and the path to the root"),
    ("Double click", "Focus on the point; on the background reset the view"),
    ("W A S D, Q E", "Fly, in fly mode; Shift is faster"),
    ("Drop a file", "Open it; the model that is open keeps its camera"),
    ("Drag on the depth bar", "Choose depths; Shift moves the range, double click shows all"),
    ("Double click on a slider", "Back to its default"),
    ("Click on a number", "Copy it"),
    ("Right click on a number", "Copy it with its name, or explain it"),
];

/// Keys or gestures under a heading, each with its effect.
pub type KeyList = (&'static str, Vec<(String, &'static str)>);

/// Mouse gestures, then the keys of each menu in its order.
pub fn keys() -> Vec<KeyList> {
    let mouse = GESTURES.map(|(gesture, effect)| (gesture.to_owned(), effect)).into();
    let menus = Category::ALL.into_iter().map(|category| {
        let with_keys = entries().iter().filter(|entry| entry.category == category && !entry.shortcuts.is_empty());
        (category.label(), with_keys.map(|entry| (entry.keys(), entry.label.as_str())).collect())
    });
    std::iter::once(("Mouse", mouse)).chain(menus).collect()
}
