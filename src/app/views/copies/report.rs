//! Tables of the view with their notes.

use egui::{self, Ui};

use crate::app::state::AppState;
use crate::app::widgets::Tip as _;
use crate::app::widgets::table::{self, Column, Table, TableRow};
use crate::catalog::numbers::Direction;
use crate::lab::report_table::ReportTable;
use crate::text::counted;

/// Gap between a table and what is beside it in points.
pub(super) const GAP: f32 = 16.0;

/// Shows a table with its notes.
pub(super) fn report(ui: &mut Ui, state: &mut AppState, report: &ReportTable) {
    let columns = report.columns.iter().map(|(name, unit)| {
        let is_count = unit == "a ray";
        Column { name, unit, better: is_count.then_some(Direction::Less), has_best: false }
    });
    let row = |cells| TableRow { cells, is_remark: false, is_shown: false, preliminary: None };
    let shown = Table {
        title: &report.title,
        columns: columns.collect(),
        rows: report.rows.iter().map(|cells| row(&cells[..])).collect(),
        opens: None,
    };
    if let Some(row) = table::show(ui, &shown).copied {
        state.copy(report.rows[row].join("\t"), "Row copied");
    }
    // The table may be wider than what is seen of it.
    let width = ui.clip_rect().width() - 2.0 * ui.spacing().scroll.allocated_width();
    for note in &report.notes {
        let label = egui::Label::new(egui::RichText::new(note).weak()).wrap();
        ui.allocate_ui(egui::vec2(width, 0.0), |ui| ui.add(label));
    }
}

/// The button that copies a `table`, if there is one.
pub(super) fn copy_button(ui: &mut Ui, state: &mut AppState, table: Option<impl FnOnce() -> ReportTable>) {
    let copy = ui.add_enabled(table.is_some(), egui::Button::new("Copy"));
    if let Some(table) = table.filter(|_| copy.tip("Copy the table as tab-separated text").clicked()) {
        let table = table();
        state.copy(table.tab_separated(), &format!("{} copied", counted(table.rows.len() as u64, "rows")));
    }
}
