//! Dialog "Help" with two pages, each with a filter: keys and mouse gestures, and the glossary.

use egui::{self, Grid, Label, RichText, ScrollArea, TextEdit, Ui, vec2};

use crate::app::commands::keys;
use crate::app::panels::dialogs::frame;
use crate::app::state::{AppState, Help, HelpPage};
use crate::app::theme;
use crate::app::widgets::chip;
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
    frame::show(ctx, title, [640.0, 520.0], &mut open, |ui| {
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
