//! Dialogs "Help", with two pages, each with a filter: keys and mouse gestures, and the glossary; and "About bvhscope":
//! what a bug report needs to say about program and machine. Dialog "Messages".

use egui::{self, Align, Button, Grid, Label, Layout, RichText, ScrollArea, TextEdit, Ui, vec2};

use crate::app::commands::keys;
use crate::app::state::{AppState, Help, HelpPage, Message, Severity};
use crate::app::widgets::{Tip as _, chip};
use crate::app::{format, theme};
use crate::budget::{Budget, format_bytes};
use crate::catalog::numbers;
use crate::catalog::terms::Term;

/// Largest width of the left column in points.
const KEYS_WIDTH: f32 = 264.0;

/// Shows the dialog while it is open.
pub(crate) fn show(ctx: &egui::Context, state: &mut AppState) {
    let Some(mut help) = state.layout.help.clone() else { return };
    let mut open = true;
    let title = match help.page {
        HelpPage::Shortcuts => "Keys and mouse",
        HelpPage::Glossary => "Glossary",
    };
    super::dialog(ctx, title, [640.0, 520.0], &mut open, |ui| {
        head(ui, &mut help);
        ui.separator();
        ScrollArea::vertical().id_salt(title).auto_shrink(false).show(ui, |ui| match help.page {
            HelpPage::Shortcuts => shortcuts(ui, &help.filter),
            HelpPage::Glossary => glossary(ui, &mut help),
        });
    });
    state.layout.help = open.then_some(help);
}

/// The choice of the page and the filter.
fn head(ui: &mut Ui, help: &mut Help) {
    ui.horizontal(|ui| {
        for (page, label, tip) in [
            (HelpPage::Shortcuts, "Shortcuts", "Every key and mouse gesture (F1)"),
            (HelpPage::Glossary, "Terms", "The words of the window, each with its source (Shift+F1)"),
        ] {
            if chip(ui, label, help.page == page, tip) {
                help.page = page;
                help.term = None;
            }
        }
        let hint = match help.page {
            HelpPage::Shortcuts => "Filter by key or by what it does",
            HelpPage::Glossary => "Filter by word or author",
        };
        let field = ui.add(TextEdit::singleline(&mut help.filter).hint_text(hint).desired_width(f32::INFINITY));
        field.widget_info(|| {
            let mut info = egui::WidgetInfo::text_edit(true, &help.filter, &help.filter, hint);
            info.label = Some("Filter".to_owned());
            info
        });
        if field.changed() {
            help.term = None;
        }
    });
}

fn shortcuts(ui: &mut Ui, filter: &str) {
    let filter = filter.trim().to_lowercase();
    let fits = |keys: &str, what: &str| {
        filter.is_empty() || keys.to_lowercase().contains(&filter) || what.to_lowercase().contains(&filter)
    };
    let mut groups = keys();
    for (_, rows) in &mut groups {
        rows.retain(|(keys, what)| fits(keys, what));
    }
    groups.retain(|(_, rows)| !rows.is_empty());
    if groups.is_empty() {
        nothing(ui);
    }
    for (name, rows) in groups {
        heading(ui, &name.to_uppercase());
        table(ui, name, rows);
    }
}

fn glossary(ui: &mut Ui, help: &mut Help) {
    let palette = theme::palette(ui);
    let mut found = 0;
    for term in numbers::glossary().into_iter().filter(|term| term.matches(&help.filter)) {
        found += 1;
        let marked = help.term == Some(term);
        ui.add_space(8.0);
        let name = RichText::new(term.name).strong().color(if marked { palette.warm } else { palette.text });
        let name = ui.label(name);
        let text = ui.add(Label::new(term.text).wrap());
        let mut place = name.rect.union(text.rect);
        if !term.source.is_empty() {
            place |= ui.label(RichText::new(term.source).small().color(palette.dim)).rect;
        }
        if marked && scrolls_to(ui, term) {
            ui.scroll_to_rect(place, Some(egui::Align::Center));
        }
    }
    if found == 0 {
        nothing(ui);
    }
    // The mark scrolls once a time that the dialog is opened at it.
    if help.term.is_none() {
        ui.data_mut(|data| data.remove::<Option<&'static Term>>(scrolled_id()));
    }
}

fn scrolled_id() -> egui::Id {
    egui::Id::unique("glossary scrolled to")
}

/// True if the marked term has not been scrolled to yet.
fn scrolls_to(ui: &Ui, term: &'static Term) -> bool {
    let before = ui.data_mut(|data| data.get_temp_mut_or_default::<Option<&'static Term>>(scrolled_id()).replace(term));
    before != Some(term)
}

fn nothing(ui: &mut Ui) {
    ui.add_space(8.0);
    ui.label(RichText::new("Nothing contains this text").color(theme::palette(ui).dim));
}

fn heading(ui: &mut Ui, text: &str) {
    ui.add_space(8.0);
    ui.label(RichText::new(text).heading().color(theme::palette(ui).dim));
    ui.add_space(4.0);
}

fn table(ui: &mut Ui, id: &str, rows: Vec<(String, &str)>) {
    // Long texts wrap rather than widen the window.
    let keys_width = KEYS_WIDTH.min(ui.available_width() * 0.45);
    let what_width = ui.available_width() - keys_width - 16.0;
    Grid::new(id).num_columns(2).spacing(vec2(16.0, 4.0)).min_col_width(keys_width).show(ui, |ui| {
        for (keys, what) in rows {
            for (text, width) in [(RichText::new(keys).strong(), keys_width), (RichText::new(what), what_width)] {
                ui.vertical(|ui| {
                    ui.set_max_width(width);
                    ui.add(Label::new(text).wrap());
                });
            }
            ui.end_row();
        }
    });
}

/// Interval in seconds at which the used memory is asked for.
const MEMORY_INTERVAL_SECS: f64 = 1.0;

/// Shows the dialog while it is open.
pub(crate) fn about(ctx: &egui::Context, state: &mut AppState) {
    if !state.layout.about_open {
        return;
    }
    let facts = facts(state, used_memory(ctx));
    let mut open = true;
    let mut copy = false;
    super::dialog(ctx, "About bvhscope", [440.0, 300.0], &mut open, |ui| copy = about_content(ui, &facts));
    state.layout.about_open = open;
    if copy {
        let lines: Vec<String> = facts.iter().map(|(name, value)| format!("{name}: {value}")).collect();
        state.copy(format!("bvhscope {}\n{}", env!("CARGO_PKG_VERSION"), lines.join("\n")), "Copied these facts");
    }
    ctx.request_repaint_after_secs(MEMORY_INTERVAL_SECS as f32);
}

/// Shows the facts. Returns whether they are to be copied.
fn about_content(ui: &mut Ui, facts: &[(&str, String)]) -> bool {
    let palette = theme::palette(ui);
    ui.label(RichText::new(format!("bvhscope {}", env!("CARGO_PKG_VERSION"))).size(17.0).strong());
    ui.add(Label::new(RichText::new("An oscilloscope for bounding volume hierarchies").color(palette.dim)).wrap());
    ui.add_space(8.0);
    egui::Grid::new("about").num_columns(2).spacing([16.0, 6.0]).show(ui, |ui| {
        for (name, value) in facts {
            ui.label(RichText::new(*name).color(palette.dim));
            ui.add(Label::new(value).wrap());
            ui.end_row();
        }
    });
    ui.add_space(8.0);
    ui.add(Button::new("Copy")).tip("Copy all of this as text, for a bug report").clicked()
}

/// Names and values of what the dialog shows.
fn facts(state: &AppState, used: u64) -> Vec<(&'static str, String)> {
    let graphics = &state.layout.graphics;
    let mut adapter = match graphics.adapter_name.as_str() {
        "" => "none: containers are not drawn".to_owned(),
        name => format!("{name}, {}", graphics.backend),
    };
    if graphics.is_software {
        adapter += " (software)";
    }
    let threads = crate::threads::count(state.wanted.threads);
    vec![
        ("Graphics", adapter),
        ("SIMD level", state.wanted.render.simd.name().to_owned()),
        ("Threads", format!("{threads} of {}", crate::threads::available_threads())),
        ("Memory", format!("{} used, at most {}", format_bytes(used), format_bytes(Budget::of_process().limit()))),
        ("System", format!("{}, {}", std::env::consts::OS, std::env::consts::ARCH)),
        ("Licence", "MIT or Apache-2.0, at your option".to_owned()),
    ]
}

/// Memory of the process in bytes, asked for once a second.
fn used_memory(ctx: &egui::Context) -> u64 {
    let id = egui::Id::unique("used memory");
    let now = ctx.input(|input| input.time);
    let known: Option<(f64, u64)> = ctx.data(|data| data.get_temp(id));
    if let Some((_, used)) = known.filter(|(then, _)| now - then < MEMORY_INTERVAL_SECS) {
        return used;
    }
    let used = Budget::used();
    ctx.data_mut(|data| data.insert_temp(id, (now, used)));
    used
}

/// Shows the dialog of all messages since the program started, newest first, while it is open.
pub(crate) fn messages(ctx: &egui::Context, state: &mut AppState) {
    if !state.layout.messages_open {
        return;
    }
    state.messages.folded = [0; 2];
    let mut copied = None;
    super::dialog(ctx, "Messages", [560.0, 400.0], &mut state.layout.messages_open, |ui| {
        if state.messages.history.is_empty() {
            ui.label(RichText::new("No messages yet").color(theme::palette(ui).dim));
            return;
        }
        let all = || state.messages.history.iter().map(message_line).collect::<Vec<_>>().join("\n");
        let tip = "Copy all of them as text, oldest first";
        if ui.add(Button::new("Copy all")).tip(tip).clicked() {
            copied = Some(all());
        }
        ui.separator();
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            for message in state.messages.history.iter().rev() {
                message_row(ui, message);
            }
        });
    });
    if let Some(text) = copied {
        state.copy(text, "");
    }
    // Keep the ages current.
    ctx.request_repaint_after_secs(1.0);
}

/// A message as a line of text.
fn message_line(message: &Message) -> String {
    format!("{}: {}", message.severity.label(), message.text)
}

/// A message with its age and severity.
fn message_row(ui: &mut Ui, message: &Message) {
    let palette = theme::palette(ui);
    let color = match message.severity {
        Severity::Info => palette.dim,
        Severity::Warning => palette.warning,
        Severity::Error => palette.error,
    };
    ui.horizontal_top(|ui| {
        let ago = format!("{} ago", format::age(message.since.elapsed()));
        for (text, width, color) in [(ago.as_str(), 72.0, palette.dim), (message.severity.label(), 56.0, color)] {
            ui.allocate_ui_with_layout(vec2(width, theme::ROW_HEIGHT), Layout::left_to_right(Align::Min), |ui| {
                ui.set_min_width(width);
                ui.label(RichText::new(text).color(color));
            });
        }
        ui.add(Label::new(&message.text).wrap().selectable(true));
    });
}
