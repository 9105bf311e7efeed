//! The forms of a scene of copies: flat, in two levels, and with the tree over the copies opened.

use std::sync::Arc;

use egui::{self, ScrollArea, Ui, UiBuilder};

use super::content::Content;
use super::plot;
use super::report::{GAP, copy_button, report};
use crate::accel::Accel;
use crate::app::state::{AppState, Presented, Request};
use crate::app::views::parts;
use crate::app::widgets::Tip as _;
use crate::lab::LabError;
use crate::lab::copy_forms::{CostInForm, copy_forms, flat_form};
use crate::lab::plot::{bytes_chart, figure_of, visits_chart};
use crate::lab::population::ViewRays;
use crate::lab::report_table::{ReportTable, form_costs};
use crate::text::counted;
use bvhscope_engine::cancel::CancelToken;

/// Most parts for each copy in the tree above.
const OPEN: [f32; 6] = [1.0, 1.5, 2.0, 3.0, 4.0, 8.0];
/// Part of the width that the table takes.
const TABLE: f32 = 0.5;

/// The forms, and why the flat one is left out.
#[derive(Debug)]
pub(super) struct MeasuredForms {
    rows: Vec<CostInForm>,
    without_flat: Option<String>,
}

impl MeasuredForms {
    fn table(&self, shown: &Presented) -> ReportTable {
        let mut table = form_costs(&scene_of(shown), &self.rows.iter().collect::<Vec<_>>());
        table.notes.extend(self.without_flat.as_ref().map(|reason| format!("The flat scene is left out: {reason}.")));
        table
    }
}

fn scene_of(shown: &Presented) -> String {
    let scene = &shown.accel.scene;
    format!("{}, {} of all copies", scene.source.label(), counted(scene.triangle_count(), "triangles"))
}

impl Content for MeasuredForms {
    const THREAD: &'static str = "forms";
    const LABEL: &'static str = "Building the forms of the scene";

    fn measure(accel: &Arc<Accel>, rays: &ViewRays, token: &CancelToken) -> Result<Self, LabError> {
        let [of_flat, of_forms] = [token.part(0, 2), token.part(1, 2)];
        let (flat, without_flat) = match flat_form(accel, &of_flat) {
            Ok(flat) => (Some(flat), None),
            Err(LabError::Refused(reason)) => (None, Some(reason)),
            Err(cancelled) => return Err(cancelled),
        };
        let mut rows = Vec::new();
        copy_forms(accel, flat.as_ref(), &OPEN, std::slice::from_ref(rays), &of_forms, &mut |row| rows.push(row))?;
        Ok(Self { rows, without_flat })
    }

    fn rays(&self) -> u64 {
        self.rows.first().map_or(0, |row| row.cost.rays)
    }

    /// Copies the table, and saves the curves.
    fn outputs(ui: &mut Ui, state: &mut AppState, shown: &Presented, known: Option<&Self>) {
        let known = known.filter(|known| !known.rows.is_empty());
        let save = ui.add_enabled(known.is_some(), egui::Button::new("PNG"));
        if let Some(known) = known.filter(|_| save.tip("Save the curves as a picture in the current folder").clicked())
        {
            let figure = figure_of(&scene_of(shown), &[known.rows.iter().collect()]);
            state.activity.requests.push(Request::SavePlots(parts::plot_name(shown, "forms"), figure));
        }
        copy_button(ui, state, known.map(|known| || known.table(shown)));
    }

    /// The table, and beside it the curves over how far the tree above is opened.
    fn show(&self, ui: &mut Ui, state: &mut AppState, shown: &Presented, _: &mut Option<u32>) {
        let [left, right] = parts::beside(ui, TABLE, GAP);
        ui.scope_builder(UiBuilder::new().max_rect(left), |ui| {
            let area = ScrollArea::both().id_salt("forms").auto_shrink(false);
            area.show(ui, |ui| report(ui, state, &self.table(shown)));
        });
        let rows: Vec<&CostInForm> = self.rows.iter().collect();
        ui.scope_builder(UiBuilder::new().max_rect(right), |ui| {
            let halves = parts::beside(ui, 0.5, GAP);
            for (chart, half) in [visits_chart(&rows), bytes_chart(&rows)].iter().zip(halves) {
                ui.scope_builder(UiBuilder::new().max_rect(half), |ui| plot::show(ui, chart));
            }
        });
        ui.advance_cursor_after_rect(left.union(right));
    }
}
