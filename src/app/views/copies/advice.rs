//! Costs of the rays of the view in scenes with other meshes: one in parts, or two as one.

use std::sync::Arc;

use egui::{ScrollArea, Ui};

use super::content::Content;
use super::report::{copy_button, report};
use crate::accel::Accel;
use crate::app::state::{AppState, Presented};
use crate::lab::LabError;
use crate::lab::copy_advice::{CostOfChange, copy_advice};
use crate::lab::population::ViewRays;
use crate::lab::report_table::{ReportTable, advice_costs};
use bvhscope_engine::cancel::CancelToken;

/// The changes and what they save.
#[derive(Debug)]
pub(super) struct MeasuredAdvice(Vec<CostOfChange>);

impl MeasuredAdvice {
    fn table(&self, shown: &Presented) -> ReportTable {
        advice_costs(&shown.accel.scene.source.label(), &self.0.iter().collect::<Vec<_>>())
    }
}

impl Content for MeasuredAdvice {
    const THREAD: &'static str = "advice";
    const LABEL: &'static str = "Tracing rays through other meshes";

    fn measure(accel: &Arc<Accel>, rays: &ViewRays, token: &CancelToken) -> Result<Self, LabError> {
        let mut rows = Vec::new();
        copy_advice(accel, std::slice::from_ref(rays), token, &mut |row| rows.push(row))?;
        Ok(Self(rows))
    }

    fn rays(&self) -> u64 {
        self.0.first().map_or(0, |row| row.cost.rays)
    }

    /// Copies the table.
    fn outputs(ui: &mut Ui, state: &mut AppState, shown: &Presented, known: Option<&Self>) {
        copy_button(ui, state, known.filter(|known| !known.0.is_empty()).map(|known| || known.table(shown)));
    }

    /// The table.
    fn show(&self, ui: &mut Ui, state: &mut AppState, shown: &Presented, _: &mut Option<u32>) {
        let area = ScrollArea::both().id_salt("advice").auto_shrink(false);
        area.show(ui, |ui| report(ui, state, &self.table(shown)));
    }
}
