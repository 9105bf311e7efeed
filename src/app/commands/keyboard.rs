//! Keys into actions.

use egui::{self, Event, Key, Modifiers};

use crate::app::commands::{Action, Entry, entries};
use crate::app::state::AppState;

/// Carries out what was asked for by keys. A focused text field keeps its keys; the palette, while open, keeps all but
/// Ctrl+P and Esc.
pub fn handle_shortcuts(ctx: &egui::Context, state: &mut AppState) {
    let typing = ctx.text_edit_focused() || (state.layout.palette.is_some() && ctx.egui_wants_keyboard_input());
    // Esc closes an open list or menu and nothing else.
    let list_open = egui::Popup::is_any_open(ctx);
    let mut actions = Vec::new();
    ctx.input_mut(|input| {
        input.events.retain(|event| {
            let Event::Key { key, pressed: true, modifiers, repeat, .. } = event else { return true };
            let Some(entry) = entry_of(*key, *modifiers) else { return true };
            if entry.in_viewport && !state.layout.viewport_focused {
                return true;
            }
            let action = entry.action;
            if action == Action::Cancel && list_open {
                return true;
            }
            let opens_lists = matches!(action, Action::Palette | Action::Shortcuts) && *key != Key::Questionmark;
            let closes = action == Action::Cancel && windows_open(state);
            if (typing || state.layout.palette.is_some()) && !opens_lists && !closes {
                return true;
            }
            if !repeat || repeats(action) {
                actions.push(action);
            }
            false
        });
    });
    for action in actions {
        if action.is_enabled(state) || action == Action::Cancel {
            action.perform(state);
        }
    }
}

/// The entry of a key with exactly these modifiers.
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

/// Whether holding the key down repeats the action.
fn repeats(action: Action) -> bool {
    matches!(
        action,
        Action::RaiseThreshold
            | Action::LowerThreshold
            | Action::Deeper
            | Action::Shallower
            | Action::SelectParent
            | Action::SelectChild
            | Action::SelectSecondChild
            | Action::Orbit(_)
            | Action::ZoomIn
            | Action::ZoomOut
            | Action::Undo
            | Action::Redo
    )
}

fn windows_open(state: &AppState) -> bool {
    state.layout.palette.is_some()
        || state.layout.shortcuts_open
        || state.layout.start_page_open
        || state.layout.messages_open
}
