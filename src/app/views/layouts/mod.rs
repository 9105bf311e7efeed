//! The view "Layouts": wide trees of several layouts over the presented binary tree, and what the rays of the view cost in each.

mod plot;

use std::sync::Arc;

use egui::{self, Align, Key, Layout, ScrollArea, Ui, UiBuilder};
use serde::{Deserialize, Serialize};

use super::parts;
use crate::accel::Accel;
use crate::app::format;
use crate::app::state::{AppState, Derived, Presented, Request, Study, ViewState};
use crate::app::studies::{Studies, StudyPlan};
use crate::app::views::{Needs, View};
use crate::app::widgets::table::{self, Column, Table, TableRow};
use crate::app::widgets::{DropDown, Tip as _, chip, empty_view};
use crate::catalog::layouts::{LayoutChoice, NamedLayout};
use crate::catalog::numbers::Direction;
use crate::lab::LabError;
use crate::lab::layouts::{LaidOut, LayoutPlan, layouts, mark_front};
use crate::lab::plot::{Figure, layout_chart};
use crate::lab::population::ViewRays;
use crate::lab::report_table::{ReportTable, layout_costs};
use crate::text::counted;
use bvhscope_engine::layouts::{Collapse, MAX_CHILDREN, MAX_LEAF, Planes};

/// Most children of a node, by which layouts are chosen.
const CHILDREN: [(u32, &str, &str); 4] = [
    (2, "2", "Binary nodes"),
    (4, "4", "Up to 4 children of a node"),
    (8, "8", "Up to 8 children of a node, as of the tree that pictures are traced through"),
    (16, "16", "Up to 16 children of a node"),
];
/// How they are chosen.
const COLLAPSES: [(Collapse, &str, &str); 4] = [
    (Collapse::Greedy, "Greedy", "Again and again the child of the largest area is replaced by its own two"),
    (Collapse::Optimal, "Optimal", "The least cost by the surface area heuristic, by dynamic programming"),
    (Collapse::Memory, "Memory", "The fewest bytes that a random line reads, by dynamic programming"),
    (Collapse::Visits, "Visits", "The least cost by the visits that the rays of the view make, in place of areas"),
];
/// How planes are stored.
const PLANES: [(Planes, &str, &str); 3] = [
    (Planes::F32, "32 bits", "Planes of boxes as they are"),
    (Planes::Bits16, "16 bits", "Planes in a grid of the parent, of 16 bits each, rounded outwards"),
    (Planes::Bits8, "8 bits", "Planes in a grid of the parent, of 8 bits each, rounded outwards"),
];
/// Limits on the triangles of a leaf.
const LEAVES: [(u32, &str, &str); 6] = [
    (1, "1", "Leaves as the binary tree has them"),
    (2, "2", "Leaves are joined up to 2 triangles where that costs less"),
    (4, "4", "Leaves are joined up to 4 triangles where that costs less"),
    (8, "8", "Leaves are joined up to 8 triangles where that costs less"),
    (16, "16", "Leaves are joined up to 16 triangles where that costs less"),
    (32, "32", "Leaves are joined up to 32 triangles where that costs less"),
];

/// Part of the width that the table takes.
const TABLE: f32 = 0.62;
/// Gap between table and plot in points.
const GAP: f32 = 12.0;

/// The inputs of a measurement.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LayoutInputs {
    plan: LayoutPlan,
    rays: ViewRays,
}

/// The layouts of the presented tree, or why it has none.
type Measured = Result<Vec<LaidOut>, String>;

/// The wanted layouts, and what was measured of them.
#[derive(Debug, Default)]
pub(crate) struct LayoutsView {
    plan: LayoutPlan,
    measured: Study<LayoutInputs, Measured>,
}

/// The part of the view in a shared state.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct SharedLayouts {
    plan: LayoutPlan,
}

impl ViewState for LayoutsView {
    const NAME: &'static str = "Layouts";
    type Shared = SharedLayouts;

    fn shared(&self, _: Option<&Arc<Accel>>) -> SharedLayouts {
        let Self { plan, measured: _ } = self;
        SharedLayouts { plan: plan.clone() }
    }

    fn show_shared(&mut self, SharedLayouts { plan }: SharedLayouts) {
        let LayoutPlan { mut children, collapses, planes, mut leaf_sizes } = plan;
        children.retain(|children| (2..=MAX_CHILDREN).contains(children));
        leaf_sizes.retain(|size| (1..=MAX_LEAF).contains(size));
        let plan = LayoutPlan { children, collapses, planes, leaf_sizes };
        self.plan = if plan.is_empty() { LayoutPlan::default() } else { plan };
    }

    #[cfg(test)]
    fn changed() -> Self {
        let plan = LayoutPlan {
            children: vec![4],
            collapses: vec![Collapse::Greedy],
            planes: vec![Planes::Bits16],
            leaf_sizes: vec![8],
        };
        Self { plan, ..Self::default() }
    }
}

impl View for LayoutsView {
    const PURPOSE: &'static str = "The tree as tracers lay it out: what children of a node, bits of a plane and sizes of leaves do to tests and bytes of a ray";
    const KEY: Key = Key::Y;

    fn ui(&mut self, ui: &mut Ui, state: &mut AppState) {
        let Some(shown) = parts::presented_tree(ui, state, "Open a model to lay out its tree") else { return };
        let inputs = self.inputs(&state.model.derived, &shown.accel);
        let known = inputs.as_ref().and_then(|inputs| self.measured.get(&shown.accel, inputs)).cloned();
        ui.horizontal(|ui| {
            parts::rays(ui, state, &shown);
            if let Some(Ok(rows)) = known.as_deref() {
                on_show(ui, state, rows);
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| outputs(ui, state, &shown, known.as_deref()));
        });
        ui.horizontal(|ui| self.choices(ui));
        ui.add_space(4.0);
        match known.as_deref() {
            Some(Ok(rows)) if rows.iter().all(|row| row.rays.rays == 0) => {
                empty_view(ui, parts::no_rays(state, &shown).unwrap_or("There are no such rays"));
            }
            Some(Ok(rows)) => body(ui, state, rows),
            Some(Err(_)) if shown.accel.scene.copies.is_some() => {
                empty_view(ui, "Layouts are of trees of one level: File has “Copies flat” for this scene");
            }
            Some(Err(reason)) => empty_view(ui, &format::capital(reason)),
            None => {
                let study = (&mut self.measured, inputs);
                parts::wait_for(ui, &mut state.model.derived, &shown.accel, study, "Laying out wide trees");
            }
        }
    }

    // Their rays are those of measured visits.
    fn needs(&self) -> Needs {
        Needs { visits: true, ..Needs::default() }
    }

    fn add_studies(studies: &mut Studies) -> std::io::Result<()> {
        let plan = StudyPlan::new(
            "layouts",
            "Laying out wide trees",
            |state| &mut state.views.get_mut::<Self>().measured,
            |state, _| state.inputs_of(|view: &Self, model, accel| view.inputs(&model.derived, accel)),
        );
        studies.add(plan, |accel, LayoutInputs { plan, rays }: &LayoutInputs, token| {
            let mut rows = Vec::new();
            match layouts(accel, plan, std::slice::from_ref(rays), token, &mut |row| rows.push(row)) {
                Ok(()) => {
                    mark_front(rows.iter_mut());
                    Ok(Ok(rows))
                }
                Err(LabError::Refused(text)) => Ok(Err(text)),
                Err(LabError::Cancelled(cancelled)) => Err(cancelled),
            }
        })
    }
}

impl LayoutsView {
    /// The inputs for `accel`, where the rays are known.
    fn inputs(&self, derived: &Derived, accel: &Arc<Accel>) -> Option<LayoutInputs> {
        Some(LayoutInputs { plan: self.plan.clone(), rays: derived.rays(&accel.scene)? })
    }

    /// The axes of the layouts, each value of which is laid out with each of the others.
    fn choices(&mut self, ui: &mut Ui) {
        let LayoutPlan { children, collapses, planes, leaf_sizes } = &mut self.plan;
        chips(ui, "Children", "Most children of a node", &CHILDREN, children);
        chips(ui, "Chosen by", "How the children of a node are chosen from the binary tree", &COLLAPSES, collapses);
        chips(ui, "Planes", "How the planes of boxes are stored", &PLANES, planes);
        let mut leaves = leaf_sizes.first().copied().unwrap_or(1);
        let before = leaves;
        DropDown::new("Leaves", &LEAVES).beside(ui, "Leaves", "Most triangles of a leaf", &mut leaves);
        if leaves != before {
            *leaf_sizes = vec![leaves];
        }
    }
}

/// A chip for each value of an axis, of which at least one stays.
fn chips<T: Copy + PartialEq>(ui: &mut Ui, label: &str, tip: &str, all: &[(T, &str, &str)], wanted: &mut Vec<T>) {
    ui.weak(label).tip(tip);
    for &(value, name, meaning) in all {
        let is_wanted = wanted.contains(&value);
        if chip(ui, name, is_wanted, meaning) && (!is_wanted || wanted.len() > 1) {
            let stays = |other: T| if other == value { !is_wanted } else { wanted.contains(&other) };
            *wanted = all.iter().map(|&(other, ..)| other).filter(|&other| stays(other)).collect();
        }
    }
    ui.add_space(6.0);
}

/// The list of what containers, depths and icicle show: the binary tree or one of the layouts.
fn on_show(ui: &mut Ui, state: &mut AppState, rows: &[LaidOut]) {
    let mut names: Vec<(Option<LayoutChoice>, String)> = vec![(None, "Binary tree".to_owned())];
    names.extend(rows.iter().map(|row| (Some(row.layout.choice), row.layout.name())));
    if let Some(chosen) = state.model.layout.chosen.filter(|&chosen| names.iter().all(|(of, _)| *of != Some(chosen))) {
        names.push((Some(chosen), NamedLayout::from(chosen).name()));
    }
    let tip = "The tree that depths, containers and Icicle are of: the binary one, or the wide one of a layout. Inner boxes vanish in it";
    let choices: Vec<_> = names.iter().map(|(choice, name)| (*choice, name.as_str(), tip)).collect();
    DropDown::new("Layout on show", &choices).beside(ui, "Show", tip, &mut state.model.layout.chosen);
    if let Some(reason) = state.model.layout_fault() {
        ui.weak(format::capital(reason));
    }
}

/// The table on the left, and the plot beside it.
fn body(ui: &mut Ui, state: &mut AppState, rows: &[LaidOut]) {
    let [left, right] = parts::beside(ui, TABLE, GAP);
    ui.scope_builder(UiBuilder::new().max_rect(left), |ui| {
        ScrollArea::both().id_salt("layouts").auto_shrink(false).show(ui, |ui| costs(ui, state, rows));
    });
    ui.scope_builder(UiBuilder::new().max_rect(right), |ui| plot::show(ui, state, rows));
    ui.advance_cursor_after_rect(left.union(right));
}

/// The table of `layouts`.
fn costs(ui: &mut Ui, state: &mut AppState, rows: &[LaidOut]) {
    let report = report(rows);
    // The first two are names and marks.
    let better = |column: usize| (column > 1).then_some(Direction::Less);
    let columns = report.columns.iter().enumerate();
    let shown = Table {
        title: &report.title,
        columns: columns
            .map(|(at, (name, unit))| Column { name, unit, better: better(at), has_best: at > 1 })
            .collect(),
        rows: report
            .rows
            .iter()
            .zip(rows)
            .map(|(cells, row)| TableRow {
                cells,
                is_remark: false,
                is_shown: state.model.layout.chosen.map_or(row.layout.is_own(), |chosen| row.layout.choice == chosen),
                preliminary: None,
            })
            .collect(),
        opens: Some("shows its nodes in the picture and in Icicle"),
    };
    let response = table::show(ui, &shown);
    if let Some(row) = response.copied {
        state.copy(report.rows[row].join("\t"), "Row copied");
    }
    if let Some(row) = response.opened {
        state.model.layout.toggle(rows[row].layout.choice);
    }
    for note in &report.notes {
        ui.add(egui::Label::new(egui::RichText::new(note).weak()).wrap());
    }
}

fn report(rows: &[LaidOut]) -> ReportTable {
    layout_costs(&rows.iter().collect::<Vec<_>>())
}

/// The buttons that copy the table, and save the plot.
fn outputs(ui: &mut Ui, state: &mut AppState, shown: &Presented, known: Option<&Measured>) {
    let rows = known.and_then(|known| known.as_ref().ok()).filter(|rows| !rows.is_empty());
    let save = ui.add_enabled(rows.is_some(), egui::Button::new("PNG"));
    if let Some(rows) = rows.filter(|_| save.tip("Save the plot as a picture in the current folder").clicked()) {
        let scene = &shown.accel.scene;
        let note = format!("{}, {}.", scene.source.label(), counted(scene.triangle_count(), "triangles"));
        let chart = layout_chart(rows[0].population.label(), &rows.iter().collect::<Vec<_>>());
        let figure = Figure { notes: vec![note], charts: vec![chart] };
        state.activity.requests.push(Request::SavePlots(parts::plot_name(shown, "layouts"), figure));
    }
    let copy = ui.add_enabled(rows.is_some(), egui::Button::new("Copy"));
    if let Some(rows) = rows.filter(|_| copy.tip("Copy the table as tab-separated text").clicked()) {
        state.copy(report(rows).tab_separated(), &format!("{} copied", counted(rows.len() as u64, "rows")));
    }
}
