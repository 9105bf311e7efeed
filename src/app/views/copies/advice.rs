//! Costs of the rays of the view in scenes with other meshes: one in parts, or two as one.

use std::sync::Arc;

use egui::{self, ScrollArea, Ui};

use super::report::report;
use crate::accel::Accel;
use crate::app::state::{AppState, Presented};
use crate::app::widgets::Tip as _;
use crate::lab::LabError;
use crate::lab::copy_advice::{CostOfChange, copy_advice};
use crate::lab::population::ViewRays;
use crate::lab::report_table::{ReportTable, advice_costs};
use crate::text::counted;
use bvhscope_engine::cancel::CancelToken;

/// The changes and what they save.
#[derive(Debug, Default)]
pub(super) struct MeasuredAdvice(Vec<CostOfChange>);

impl MeasuredAdvice {
    /// Takes `rays` through the scene of `accel` with other meshes.
    pub(super) fn measure(&mut self, accel: &Arc<Accel>, rays: &ViewRays, token: &CancelToken) -> Result<(), LabError> {
        copy_advice(accel, std::slice::from_ref(rays), token, &mut |row| self.0.push(row))
    }

    pub(super) fn rays(&self) -> u64 {
        self.0.first().map_or(0, |row| row.cost.rays)
    }

    fn table(&self, shown: &Presented) -> ReportTable {
        advice_costs(&shown.accel.scene.source.label(), &self.0.iter().collect::<Vec<_>>())
    }
}

/// Shows the table.
pub(super) fn show(ui: &mut Ui, state: &mut AppState, shown: &Presented, known: &MeasuredAdvice) {
    let area = ScrollArea::both().id_salt("advice").auto_shrink(false);
    area.show(ui, |ui| report(ui, state, &known.table(shown)));
}

/// The button that copies the table.
pub(super) fn outputs(ui: &mut Ui, state: &mut AppState, shown: &Presented, known: Option<&MeasuredAdvice>) {
    let known = known.filter(|known| !known.0.is_empty());
    let copy = ui.add_enabled(known.is_some(), egui::Button::new("Copy"));
    if let Some(known) = known.filter(|_| copy.tip("Copy the table as tab-separated text").clicked()) {
        let table = known.table(shown);
        state.copy(table.tab_separated(), &format!("{} copied", counted(table.rows.len() as u64, "rows")));
    }
}
