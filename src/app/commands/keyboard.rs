//! Keyboard shortcuts.

use egui::{self, Event, Key, Modifiers};

use super::entries::entries;
use super::row::Entry;
use super::share::paste_state;
use crate::app::state::AppState;
use crate::app::state::action::Action;

/// Performs the actions whose keys were pressed. A focused text field keeps its keys; so does the open palette, except for
/// Ctrl+P, F1 and Esc.
pub fn handle_shortcuts(ctx: &egui::Context, state: &mut AppState) {
    let typing = ctx.text_edit_focused() || (state.layout.palette.is_some() && ctx.egui_wants_keyboard_input());
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
            if entry.row.in_viewport && !state.layout.viewport_focused {
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
                actions.push(action);
            }
            false
        });
    });
    if let Some(text) = pasted {
        paste_state(state, &text);
    }
    for action in actions {
        if action.is_enabled(state) || action == Action::Cancel {
            action.perform(state);
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
