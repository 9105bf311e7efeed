//! The view "Paper": measures the paper's tables and figures on the open model. The tables have the same cells as on
//! the command line; a click copies a row.

mod controls;
mod plots;

use std::sync::Arc;

use egui::{self, Align2, CornerRadius, Key, RichText, Role, ScrollArea, Sense, TextStyle, Ui, WidgetInfo, pos2, vec2};

use crate::app::state::paper::{Display, Experiment, PaperPlan, PaperResult};
use crate::app::state::{AppState, Request};
use crate::app::views::View;
use crate::app::widgets::Tip as _;
use crate::app::{format, theme};
use crate::catalog::settings::Stated;
use crate::lab::report_table::ReportTable;

const PURPOSE: &str = "Measure the paper's tables and figures on the open model";

/// The paper's tables and figures.
pub(super) const VIEW: View = View::new(PaperPlan::VIEW, PURPOSE, Key::F11, show);

fn show(ui: &mut Ui, state: &mut AppState) {
    controls::show(ui, state);
    ui.add_space(4.0);
    ScrollArea::vertical().id_salt("paper scroll").auto_shrink(false).show(ui, |ui| body(ui, state));
}

/// The measured rows as tables or plots, with remarks where they are not those of the present settings.
fn body(ui: &mut Ui, state: &mut AppState) {
    let measured = state.activity.measured.get(&state.preferences.paper.experiment);
    let Some(result) = measured.cloned().filter(|result| !result.rows.is_empty()) else {
        nothing_yet(ui, state);
        return;
    };
    let palette = theme::palette(ui);
    let same = state.model.loaded.as_ref().is_some_and(|scene| Arc::ptr_eq(scene, &result.scene));
    let mut remarks = Vec::new();
    if !same {
        remarks.push(format!("Measured on {}, not on the open model.", result.scene.source.label()));
    }
    if !result.finished && state.activity.measure.is_none() {
        remarks.push("Incomplete: stopped before all rows were measured.".to_owned());
    }
    if !remarks.is_empty() {
        ui.label(RichText::new(remarks.join(" ")).color(palette.warning));
    }
    match state.preferences.paper.display {
        Display::Plots if !result.figure.charts.is_empty() => plots::show(ui, state, &result),
        _ => tables(ui, state, &result),
    }
}

/// Text shown before the first rows: what would be measured, or that it is being measured.
fn nothing_yet(ui: &mut Ui, state: &mut AppState) {
    let palette = theme::palette(ui);
    let plan = &state.preferences.paper;
    let other = state.activity.experiment.filter(|measured| *measured != plan.experiment);
    let text = match (&state.activity.measure, &state.model.loaded) {
        (Some(job), _) if other.is_some() => {
            let percent = job.progress.clamp(0.0, 1.0) * 100.0;
            format!("Measuring: {} ({percent:.0} %).", other.map_or("", Experiment::label))
        }
        (Some(_), _) => {
            "Measuring. The first rows appear once everything they are compared with is measured.".to_owned()
        }
        (None, None) => "No model loaded yet".to_owned(),
        (None, Some(scene)) => {
            let settings = match plan.experiment {
                Experiment::Tables | Experiment::Threads => {
                    format!(" ({})", Stated::of(&state.wanted.build).by_symbol().join(", "))
                }
                _ => String::new(),
            };
            let files = match plan.experiment {
                Experiment::Threads => Vec::new(),
                _ => state.trees_from_files(scene),
            };
            let names = files.iter().filter_map(|accel| accel.file.as_ref()).map(|file| format!(", {}", file.name()));
            format!(
                "{}{settings}{}, on {} with {}. Leave the picture at rest meanwhile.",
                plan.experiment.description(),
                names.collect::<String>(),
                format::elide_middle(&scene.source.label(), 48),
                format::counted(scene.triangles.len() as u64, "triangle")
            )
        }
    };
    ui.add(egui::Label::new(RichText::new(text).color(palette.dim)).wrap());
    let tip = "Stop the other measurement, whose finished rows stay, and begin with this question";
    if other.is_some() && ui.button("Measure this instead").tip(tip).clicked() {
        state.activity.requests.push(Request::Measure);
    }
}

/// Gap between two columns in points.
const GAP: f32 = 16.0;
/// Height of a row in points.
const ROW_HEIGHT: f32 = 18.0;

/// Shows the tables one below the other.
pub(crate) fn tables(ui: &mut Ui, state: &mut AppState, result: &PaperResult) {
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
