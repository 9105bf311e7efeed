//! Dialog "Keys and mouse": all keyboard shortcuts and mouse gestures.

use egui::{self, Grid, Label, RichText, ScrollArea, Ui, vec2};

use crate::app::commands::{Category, entries};
use crate::app::panels::dialogs::frame;
use crate::app::state::AppState;
use crate::app::theme;

/// Mouse gestures, each with its effect.
const GESTURES: [(&str, &str); 10] = [
    ("Left drag", "Orbit around the target"),
    ("Wheel", "Zoom to the point under the pointer"),
    ("Right drag, middle drag, Shift+left drag", "Pan"),
    ("Click", "Select the triangle, its leaf and the path to the root"),
    ("Double click", "Focus on the point; on the background reset the view"),
    ("W A S D, Q E", "Fly, in fly mode; Shift is faster"),
    ("Drop a file", "Open it; the camera stays if the model is still in view"),
    ("Drag on the depth bar", "Choose depths; Shift moves the range, double click shows all"),
    ("Double click on a slider", "Back to its default"),
    ("Click on a number", "Copy it"),
];

/// Largest width of the left column in points.
const KEYS_WIDTH: f32 = 264.0;

/// Shows the dialog while it is open.
pub(crate) fn show(ctx: &egui::Context, state: &mut AppState) {
    if !state.layout.shortcuts_open {
        return;
    }
    frame::show(ctx, "Keys and mouse", [640.0, 520.0], &mut state.layout.shortcuts_open, |ui| {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            heading(ui, "MOUSE");
            table(ui, "mouse", GESTURES.iter().map(|(keys, what)| ((*keys).to_owned(), *what)));
            for category in Category::ALL {
                heading(ui, &category.label().to_uppercase());
                let rows = entries().iter().filter(|entry| entry.category == category && !entry.shortcuts.is_empty());
                table(ui, category.label(), rows.map(|entry| (entry.keys(), entry.label.as_str())));
            }
        });
    });
}

fn heading(ui: &mut Ui, text: &str) {
    ui.add_space(8.0);
    ui.label(RichText::new(text).heading().color(theme::palette(ui).dim));
    ui.add_space(4.0);
}

fn table<'a>(ui: &mut Ui, id: &str, rows: impl Iterator<Item = (String, &'a str)>) {
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
