//! The view "Paper": measures the paper's tables and figures on the open model. The tables have the same cells as on
//! the command line; they sort, and a double click on a row builds its tree.

mod controls;
mod plots;

use std::sync::Arc;

use egui::{self, Key, RichText, ScrollArea, Ui};

use crate::accel::Accel;
use crate::app::state::paper::{Display, Experiment, PaperPlan, PaperResult, apply_row, settings_of};
use crate::app::state::{AppState, Request, ViewState};
use crate::app::views::View;
use crate::app::widgets::Tip as _;
use crate::app::widgets::table::{self, Column, Table, TableRow};
use crate::app::{format, theme};
use crate::catalog::settings::Stated;
use crate::lab::report_table::ReportTable;

/// The paper's tables and figures. Its settings are saved between runs, as part of the preferences.
#[derive(Debug, Default)]
pub(crate) struct PaperView;

impl ViewState for PaperView {
    const NAME: &'static str = PaperPlan::VIEW;
    type Shared = ();

    fn shared(&self, _: Option<&Arc<Accel>>) {}

    fn show_shared(&mut self, (): ()) {}

    #[cfg(test)]
    fn changed() -> Self {
        Self
    }
}

impl View for PaperView {
    const PURPOSE: &'static str = "Measure the paper's tables and figures on the open model";
    const KEY: Key = Key::F11;

    fn ui(&mut self, ui: &mut Ui, state: &mut AppState) {
        controls::show(ui, state);
        ui.add_space(4.0);
        ScrollArea::vertical().id_salt("paper scroll").auto_shrink(false).show(ui, |ui| body(ui, state));
    }
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
                format::counted(scene.triangle_count(), "triangle")
            )
        }
    };
    ui.add(egui::Label::new(RichText::new(text).color(palette.dim)).wrap());
    let tip = "Stop the other measurement, whose finished rows stay, and begin with this question";
    if other.is_some() && ui.button("Measure this instead").tip(tip).clicked() {
        state.activity.requests.push(Request::Measure);
    }
}

/// Shows the tables one below the other. A double click on a row of a tree requests that tree.
pub(crate) fn tables(ui: &mut Ui, state: &mut AppState, result: &PaperResult) {
    ScrollArea::horizontal().id_salt("paper tables").auto_shrink([false, true]).show(ui, |ui| {
        for table in &result.tables {
            show_table(ui, state, result, table);
            ui.add_space(12.0);
        }
    });
}

/// One table and its notes.
fn show_table(ui: &mut Ui, state: &mut AppState, result: &PaperResult, table: &ReportTable) {
    let better = table.better.iter().copied().chain(std::iter::repeat(None));
    let columns = table.columns.iter().zip(better);
    let source = |row: usize| table.sources.get(row).and_then(|&source| result.rows.get(source));
    let is_shown = |row: usize| {
        source(row)
            .and_then(settings_of)
            .is_some_and(|build| state.wanted.tree_files[0].is_none() && build == state.wanted.build)
    };
    let row = |index: usize| {
        let cells = &table.rows[index][..];
        // Indented rows quote published values or files.
        let is_remark = cells.first().is_some_and(|cell| cell.starts_with("  "));
        TableRow { cells, is_remark, is_shown: is_shown(index), preliminary: None }
    };
    let shown = Table {
        title: &table.title,
        columns: columns
            .enumerate()
            .map(|(index, ((name, unit), better))| Column {
                name,
                unit,
                better,
                has_best: !table.undecided.contains(&index),
            })
            .collect(),
        rows: (0..table.rows.len()).map(row).collect(),
        opens: (!table.sources.is_empty()).then_some("builds its tree"),
    };
    let response = table::show(ui, &shown);
    if let Some(row) = response.copied {
        state.copy(table.rows[row].join("\t"), "Row copied");
    }
    if let Some(row) = response.opened.and_then(source) {
        apply_row(row, &mut state.wanted);
    }
    for note in &table.notes {
        ui.add(egui::Label::new(RichText::new(note).color(theme::palette(ui).dim)).extend());
    }
}
