//! The measured rows as tables, with the same cells as on the command line. A click copies a row.

use egui::{self, Align2, CornerRadius, RichText, Role, ScrollArea, Sense, TextStyle, Ui, WidgetInfo, pos2, vec2};

use crate::app::state::AppState;
use crate::app::state::paper::PaperResult;
use crate::app::theme;
use crate::lab::report_table::ReportTable;

/// Gap between two columns in points.
const GAP: f32 = 16.0;
/// Height of a row in points.
const ROW_HEIGHT: f32 = 18.0;

/// Shows the tables one below the other.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState, result: &PaperResult) {
    ScrollArea::horizontal().id_salt("paper tables").auto_shrink([false, true]).show(ui, |ui| {
        for table in &result.tables {
            show_table(ui, state, table);
            ui.add_space(12.0);
        }
    });
}

/// One table: title, header, rows, notes.
fn show_table(ui: &mut Ui, state: &mut AppState, table: &ReportTable) {
    let palette = theme::palette(ui);
    ui.label(RichText::new(&table.title).strong());
    let font = TextStyle::Body.resolve(ui.style());
    let width_of = |text: &str| ui.painter().layout_no_wrap(text.to_owned(), font.clone(), palette.text).size().x;
    let widths: Vec<f32> = table
        .columns
        .iter()
        .enumerate()
        .map(|(index, (name, unit))| {
            let cells = table.rows.iter().filter_map(|row| row.get(index)).map(|cell| width_of(cell));
            cells.chain([width_of(name), width_of(unit)]).fold(0.0, f32::max)
        })
        .collect();
    let total = widths.iter().map(|width| width + GAP).sum::<f32>();
    let line = |ui: &mut Ui, cells: &mut dyn Iterator<Item = &str>, color: egui::Color32, label: String| {
        let (rect, response) = ui.allocate_exact_size(vec2(total, ROW_HEIGHT), Sense::CLICK);
        response.widget_info(|| WidgetInfo::labeled(Role::Label, true, label.clone()));
        if response.hovered() {
            ui.painter().rect_filled(rect, CornerRadius::same(4), ui.visuals().faint_bg_color);
        }
        let mut left = rect.left();
        for (index, (cell, width)) in cells.zip(&widths).enumerate() {
            let (x, align) =
                if index == 0 { (left, Align2::LEFT_CENTER) } else { (left + width, Align2::RIGHT_CENTER) };
            ui.painter().text(pos2(x, rect.center().y), align, cell, font.clone(), color);
            left += width + GAP;
        }
        response
    };
    ui.spacing_mut().item_spacing.y = 0.0;
    let header = |select: fn(&(String, String)) -> &str| table.columns.iter().map(select).collect::<Vec<_>>();
    let names = header(|column| &column.0);
    line(ui, &mut names.iter().copied(), palette.dim, names.join(", "));
    let units = header(|column| &column.1);
    if units.iter().any(|unit| !unit.is_empty()) {
        line(ui, &mut units.iter().copied(), palette.dim, String::new());
    }
    for row in &table.rows {
        // Indented rows quote published values: paint them dimmed.
        let color = if row.first().is_some_and(|cell| cell.starts_with("  ")) { palette.dim } else { palette.text };
        let response = line(ui, &mut row.iter().map(String::as_str), color, row_name(table, row));
        if response.on_hover_text("Click to copy the row").clicked() {
            state.copy(row.join("\t"), "Row copied");
        }
    }
    ui.spacing_mut().item_spacing.y = 4.0;
    for note in &table.notes {
        ui.add(egui::Label::new(RichText::new(note).color(palette.dim)).extend());
    }
}

/// Accessible name of a row: "teapot.obj, triangles 6320, build box 3.07 ms".
fn row_name(table: &ReportTable, row: &[String]) -> String {
    let mut parts = Vec::new();
    for (index, ((name, unit), cell)) in table.columns.iter().zip(row).enumerate() {
        if index == 0 {
            parts.push(cell.trim().to_owned());
        } else if !cell.is_empty() {
            parts.push(format!("{name} {cell} {unit}").trim().to_owned());
        }
    }
    parts.join(", ")
}
