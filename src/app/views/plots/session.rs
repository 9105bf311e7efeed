//! The list of trees: their readings, sorted by a click, to measure them, to go back to one, and to put one beside another.

use egui::{Button, ScrollArea, Ui};

use super::trees::{plotted, request};
use crate::app::format;
use crate::app::state::lab::{PlottedTree, TreeSet};
use crate::app::state::{AppState, Presented, TreeSide};
use crate::app::views::table::{self, Column, Table, TableRow};
use crate::app::widgets::{Tip as _, empty_view};
use crate::catalog::numbers::Direction;

/// Title of the table.
const TITLE: &str = "Trees";

/// A reading: its name, its unit, and how it is read.
type Reading = (&'static str, &'static str, fn(&PlottedTree) -> Option<f64>);

/// The readings, of all of which less is better.
const READINGS: [Reading; 5] = [
    ("Build time", "ms", |tree| tree.build_ms),
    ("SAH cost", "", |tree| Some(tree.sah_cost)),
    ("Tests", "entering ray", |tree| tree.tests),
    ("EPO", "", |tree| tree.epo),
    ("Measured cost", "chosen rays", |tree| tree.cost),
];

/// Shows the list.
pub(super) fn show(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    let trees = plotted(state, shown);
    if trees.is_empty() {
        empty_view(ui, "These trees were not measured yet on this model");
        return;
    }
    ui.horizontal(|ui| buttons(ui, state, &trees));
    let is_one_kind = trees.iter().all(|tree| tree.build.container == trees[0].build.container);
    let cells: Vec<Vec<String>> = trees.iter().map(cells).collect();
    let reading = |(name, unit, _): Reading| {
        // Predictions of boxes and of spheres do not compare; times and counts do.
        let compares = is_one_kind || !matches!(name, "SAH cost" | "EPO");
        Column { name, unit, better: compares.then_some(Direction::Less) }
    };
    let name = Column { name: "Settings", unit: "", better: None };
    let row = |(tree, cells)| TableRow { cells, is_remark: false, is_shown: PlottedTree::is(tree, &shown.accel) };
    let table = Table {
        title: TITLE,
        columns: std::iter::once(name).chain(READINGS.map(reading)).collect(),
        rows: trees.iter().zip(cells.iter().map(Vec::as_slice)).map(row).collect(),
        opens: Some("builds or reads its tree"),
    };
    let area = ScrollArea::both().id_salt("session trees").auto_shrink(false);
    let response = area.show(ui, |ui| table::show(ui, &table)).inner;
    if let Some(row) = response.copied {
        state.copy(cells[row].join("\t"), "Row copied");
    }
    if let Some(row) = response.opened {
        request(state, &trees[row], TreeSide::A);
    }
}

/// Name and readings of a tree.
fn cells(tree: &PlottedTree) -> Vec<String> {
    let reading = |(.., read): Reading| read(tree).map_or_else(|| "–".to_owned(), format::significant);
    std::iter::once(tree.name()).chain(READINGS.map(reading)).collect()
}

/// What can be done with the chosen tree, and with all.
fn buttons(ui: &mut Ui, state: &mut AppState, trees: &[PlottedTree]) {
    let chosen = table::chosen(ui, TITLE).and_then(|row| trees.get(row));
    for (side, label, tip) in [
        (TreeSide::A, "Show", "Build or read the chosen tree, as a double click does"),
        (TreeSide::B, "Put into B", "Compare the tree on the screen with the chosen one, as the second tree"),
    ] {
        let button = ui.add_enabled(chosen.is_some(), Button::new(label)).tip(tip);
        if let Some(tree) = chosen.filter(|_| button.disabled_tip("Choose a row first").clicked()) {
            request(state, tree, side);
        }
    }
    if state.lab.plots.set != TreeSet::Session {
        return;
    }
    let scene = state.model.loaded.as_ref();
    let rays = scene.and_then(|scene| state.lab.rays(scene));
    let left = state.lab.plots.session.unmeasured(rays).count();
    if state.lab.plots.measures_all {
        ui.weak(format!("Measuring: {} left (Esc stops)", format::counted(left as u64, "tree")));
        return;
    }
    let label = if left > 0 { format!("Measure all {left}") } else { "Measure all".to_owned() };
    let tip = "Build each tree that lacks a reading again, several times, and count the chosen rays: some seconds a tree, in the background";
    let button = ui.add_enabled(left > 0, Button::new(label)).tip(tip);
    if button.disabled_tip("All are measured").clicked() {
        state.lab.plots.measures_all = true;
        state.lab.plots.measured.resume();
    }
}
