//! A field for a path, which is completed from the folder's models and folders. Tab completes, Enter opens.

use std::path::PathBuf;

use egui::text::{CCursor, CCursorRange};
use egui::{self, Button, EventFilter, Key, Modifiers, RichText, TextEdit, Ui, vec2};

use crate::app::state::{AppState, Request};
use crate::app::theme;
use crate::app::widgets::Tip as _;

/// Shows the field and what is offered. Returns the path to open.
pub(super) fn show(ui: &mut Ui, state: &mut AppState) -> Option<PathBuf> {
    request_listing(state);
    if let Some(instead) = state.layout.path_field.asked_for {
        let text = format!("The desktop offers no file dialog (neither a portal nor zenity): {instead}");
        ui.add(egui::Label::new(RichText::new(text).color(theme::palette(ui).warning)).wrap());
    }
    let mut opened = None;
    ui.horizontal(|ui| {
        let id = ui.scope_id().with("path");
        let focused = ui.memory(|memory| memory.has_focus(id));
        if focused {
            keys(ui, state, id);
        }
        let field = &mut state.layout.path_field;
        let width = (ui.available_width() - 64.0).max(80.0);
        let edit = TextEdit::singleline(&mut field.text)
            .id(id)
            .hint_text(match field.tree {
                Some(_) => "Path of a tree file, as in ~/models/bunny.bvh",
                None => "Path of a model, as in ~/models/bunny.obj, or builtin:NAME",
            })
            .desired_width(width)
            .lock_focus(true);
        let response = ui.add(edit);
        response.widget_info(|| {
            let mut info = egui::WidgetInfo::text_edit(true, &field.text, &field.text, "Path of a model");
            info.label = Some("Path".to_owned());
            info
        });
        if std::mem::take(&mut field.wants_focus) {
            response.request_focus();
        }
        if std::mem::take(&mut field.selects_all) {
            select(ui, id, 0, &field.text);
        }
        if response.changed() {
            field.chosen = None;
        }
        let entered = response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        let response = response.tip("Tab completes, arrow keys choose, Enter opens");
        let button = ui.add_enabled(!field.text.trim().is_empty(), Button::new("Open"));
        if button.tip("Open this file").clicked() || entered {
            opened = open(state);
            if opened.is_none() {
                response.request_focus();
            }
        }
    });
    offered(ui, state).or(opened)
}

/// Requests the entries of the folder that is typed, once.
fn request_listing(state: &mut AppState) {
    let field = &mut state.layout.path_field;
    let folder = field.folder();
    if !field.text.is_empty() && field.requested.as_ref() != Some(&folder) {
        field.requested = Some(folder.clone());
        state.activity.requests.push(Request::ListFolder(folder));
    }
}

/// Tab and arrow keys of the focused field.
fn keys(ui: &Ui, state: &mut AppState, id: egui::Id) {
    let filter = EventFilter { tab: true, horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(id, filter));
    let field = &mut state.layout.path_field;
    let (tab, down, up) = ui.input_mut(|input| {
        (
            input.consume_key(Modifiers::NONE, Key::Tab),
            input.consume_key(Modifiers::NONE, Key::ArrowDown),
            input.consume_key(Modifiers::NONE, Key::ArrowUp),
        )
    });
    if down || up {
        field.choose(if down { 1 } else { -1 });
    }
    if tab {
        field.complete();
        // The cursor goes behind what was completed.
        select(ui, id, usize::MAX, &field.text);
    }
}

/// Selects the `text` of the field from a character to its end.
fn select(ui: &Ui, id: egui::Id, from: usize, text: &str) {
    let mut edit = egui::text_edit::TextEditState::load(ui.ctx(), id).unwrap_or_default();
    let end = text.chars().count();
    let [from, end] = [from.min(end), end].map(CCursor::new);
    edit.cursor.set_char_range(Some(CCursorRange::two(from, end)));
    edit.store(ui.ctx(), id);
}

/// The path to open: the chosen entry, else what is typed; `None` where that is empty or a folder, into which the field goes.
fn open(state: &mut AppState) -> Option<PathBuf> {
    let field = &mut state.layout.path_field;
    let offered = field.offered();
    if let Some(entry) = field.chosen.and_then(|index| offered.get(index)) {
        return field.take(entry);
    }
    let name = field.text.trim();
    if name.is_empty() {
        return None;
    }
    if let Some(folder) = offered.iter().find(|entry| entry.is_folder && name.ends_with(&entry.name)) {
        return field.take(folder);
    }
    (!name.ends_with('/')).then(|| field.path())
}

/// The entries that the typed name begins, below the field. Returns the path of one that was clicked.
fn offered(ui: &mut Ui, state: &mut AppState) -> Option<PathBuf> {
    if state.layout.path_field.text.is_empty() {
        return None;
    }
    let offered = state.layout.path_field.offered();
    let chosen = state.layout.path_field.chosen;
    let mut clicked = None;
    for (index, entry) in offered.iter().enumerate() {
        let text = RichText::new(entry.shown()).color(theme::palette(ui).text);
        let button = Button::selectable(chosen == Some(index), text).min_size(vec2(ui.available_width(), 20.0));
        let tip = if entry.is_folder { "Show what is in this folder" } else { "Open this model" };
        if ui.add(button).tip(tip).clicked() {
            clicked = Some(entry.clone());
        }
    }
    let entry = clicked?;
    let path = state.layout.path_field.take(&entry);
    state.layout.path_field.wants_focus = path.is_none();
    path
}
