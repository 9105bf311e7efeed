//! The view "Paper": measures the paper's tables and figures on the open model.

mod controls;
mod plots;
mod tables;

use std::sync::Arc;

use egui::{self, Key, RichText, ScrollArea, Ui};

use crate::app::state::AppState;
use crate::app::state::paper::{Display, Experiment, PaperPlan};
use crate::app::views::view::View;
use crate::app::{format, theme};
use crate::catalog::settings::by_symbol;

/// The paper's tables and figures.
pub(super) struct PaperView;

impl View for PaperView {
    fn name(&self) -> &'static str {
        PaperPlan::VIEW
    }

    fn purpose(&self) -> &'static str {
        "Measure the paper's tables and figures on the open model"
    }

    fn key(&self) -> Key {
        Key::F11
    }

    fn ui(&self, ui: &mut Ui, state: &mut AppState) {
        show(ui, state);
    }
}

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
        _ => tables::show(ui, state, &result),
    }
}

/// Text shown before the first rows: what would be measured, or that it is being measured.
fn nothing_yet(ui: &mut Ui, state: &AppState) {
    let palette = theme::palette(ui);
    let plan = &state.preferences.paper;
    let text = match (&state.activity.measure, &state.model.loaded) {
        (Some(_), _) => {
            "Measuring. The first rows appear once everything they are compared with is measured.".to_owned()
        }
        (None, None) => "No model loaded yet".to_owned(),
        (None, Some(scene)) => {
            let settings = match plan.experiment {
                Experiment::Tables | Experiment::Threads => {
                    format!(" ({})", by_symbol(&state.wanted.build).join(", "))
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
}
