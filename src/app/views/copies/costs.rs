//! The costs of rays in the parts of a scene of copies.

use std::sync::Arc;

use egui::{self, ScrollArea, Ui, UiBuilder};

use super::content::Content;
use super::dearest::{self, DearCopy};
use super::report::{GAP, report};
use crate::accel::Accel;
use crate::app::state::action::Action;
use crate::app::state::{AppState, Presented};
use crate::app::views::parts;
use crate::app::widgets::Tip as _;
use crate::lab::LabError;
use crate::lab::copy_costs::{CostInPart, copy_costs};
use crate::lab::population::ViewRays;
use crate::lab::report_table::{ReportTable, dearest_copies, mesh_costs};
use crate::text::counted;
use bvhscope_engine::cancel::CancelToken;

/// Number of copies that are listed.
const MOST_COPIES: usize = 200;
/// Part of the width that the table takes.
const TABLE: f32 = 0.62;

/// The costs of the rays in all parts of the scene.
#[derive(Debug)]
pub(super) struct MeasuredParts {
    rows: Vec<CostInPart>,
    /// The copies among them, the dearest first.
    pub(super) dearest: Vec<DearCopy>,
}

impl MeasuredParts {
    fn table(&self, shown: &Presented) -> ReportTable {
        mesh_costs(&shown.accel.scene.source.label(), &self.rows.iter().collect::<Vec<_>>())
    }
}

impl Content for MeasuredParts {
    const THREAD: &'static str = "copies";
    const LABEL: &'static str = "Tracing rays through both levels";

    fn measure(accel: &Arc<Accel>, rays: &ViewRays, token: &CancelToken) -> Result<Self, LabError> {
        let mut rows = Vec::new();
        copy_costs(accel, std::slice::from_ref(rays), MOST_COPIES, token, &mut |row| rows.push(row))?;
        let dear = |row: &CostInPart| {
            let copy = row.part.copy?;
            Some(DearCopy { copy, node: accel.node_of_copy(copy), row: *row })
        };
        let dearest = rows.iter().filter_map(dear).collect();
        Ok(Self { rows, dearest })
    }

    fn rays(&self) -> u64 {
        self.rows.first().map_or(0, |row| row.rays)
    }

    /// Copies both tables, and walks through the copies.
    fn outputs(ui: &mut Ui, state: &mut AppState, shown: &Presented, known: Option<&Self>) {
        let known = known.filter(|known| !known.rows.is_empty());
        let copy = ui.add_enabled(known.is_some(), egui::Button::new("Copy"));
        if let Some(known) = known.filter(|_| copy.tip("Copy both tables as tab-separated text").clicked()) {
            let dearest = dearest_copies(&known.rows.iter().collect::<Vec<_>>());
            let text = format!("{}\n{}", known.table(shown).tab_separated(), dearest.tab_separated());
            state.copy(text, &format!("{} copied", counted(known.rows.len() as u64, "rows")));
        }
        let has_copies = known.is_some_and(|known| !known.dearest.is_empty());
        parts::steps(ui, state, has_copies, "copy", Action::StepCopies, ["Alt+Shift+.", "Alt+Shift+,"]);
    }

    /// The table of the meshes on the left, and the list of copies beside it.
    fn show(&self, ui: &mut Ui, state: &mut AppState, shown: &Presented, revealed: &mut Option<u32>) {
        let [left, right] = parts::beside(ui, TABLE, GAP);
        ui.scope_builder(UiBuilder::new().max_rect(left), |ui| {
            let area = ScrollArea::both().id_salt("copies").auto_shrink(false);
            area.show(ui, |ui| report(ui, state, &self.table(shown)));
        });
        ui.scope_builder(UiBuilder::new().max_rect(right), |ui| {
            dearest::show(ui, state, shown, &self.dearest, revealed);
        });
        ui.advance_cursor_after_rect(left.union(right));
    }
}
