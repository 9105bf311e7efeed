//! Dialog "Open a model": built-in scenes, recent files, and the file dialog.

use egui::{self, Button, RichText, ScrollArea, Ui, vec2};

use crate::app::commands::Action;
use crate::app::panels::dialogs::{frame, path_field};
use crate::app::state::{AppState, Request};
use crate::app::{format, theme};
use crate::scene::{BUILTIN_SCENES, SceneSource, format_names};

/// Shows the dialog while it is open.
pub(crate) fn show(ctx: &egui::Context, state: &mut AppState) {
    if !state.layout.start_page_open {
        return;
    }
    let mut open = true;
    let mut chosen = None;
    let mut path = None;
    frame::show(ctx, "Open a model", [560.0, 440.0], &mut open, |ui| {
        path = path_field::show(ui, state);
        ui.add_space(4.0);
        ScrollArea::vertical().auto_shrink([false, true]).show(ui, |ui| content(ui, state, &mut chosen));
    });
    state.layout.start_page_open = open;
    if let Some(path) = path {
        state.layout.start_page_open = false;
        state.requests.push(Request::Open(SceneSource::File(path)));
    }
    if let Some(action) = chosen {
        state.layout.start_page_open = false;
        Action::perform(action, state);
    }
}

fn content(ui: &mut Ui, state: &AppState, chosen: &mut Option<Action>) {
    let dim = theme::palette(ui).dim;
    ui.horizontal_wrapped(|ui| {
        let formats = format_names("or");
        if ui.button("Open a file…").on_hover_text(format!("{formats} (Ctrl+O)")).clicked() {
            *chosen = Some(Action::Open);
        }
        ui.label(RichText::new(format!("or drop an {formats} file on the window")).color(dim));
    });
    heading(ui, "BUILT IN");
    for (index, scene) in BUILTIN_SCENES.iter().enumerate() {
        let tip = "Open it; the present scene stays until the new one is built";
        entry(ui, [scene.label, scene.description], tip, Action::OpenBuiltin(index), chosen);
    }
    if state.preferences.recent.is_empty() {
        return;
    }
    heading(ui, "RECENT");
    for (index, path) in state.preferences.recent.iter().enumerate() {
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        let folder = path.parent().map_or_else(String::new, |folder| folder.display().to_string());
        let texts = [format::elide_middle(&name, 32), format::elide_middle(&folder, 44)];
        let tip = format!("Open {}; the present scene stays until the new one is built", path.display());
        entry(ui, texts.each_ref().map(String::as_str), &tip, Action::OpenRecent(index), chosen);
    }
}

fn heading(ui: &mut Ui, text: &str) {
    ui.add_space(12.0);
    ui.label(RichText::new(text).heading().color(theme::palette(ui).dim));
    ui.add_space(4.0);
}

/// A button with a name on the left and a detail on the right.
fn entry(ui: &mut Ui, [name, detail]: [&str; 2], tip: &str, action: Action, chosen: &mut Option<Action>) {
    let text = RichText::new(detail).color(theme::palette(ui).dim);
    let button = Button::new((name, egui::Atom::grow(), text))
        .min_size(vec2(ui.available_width(), 24.0))
        .frame_when_inactive(false);
    let response = ui.add(button);
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, name));
    if response.on_hover_text(tip).clicked() {
        *chosen = Some(action);
    }
}
