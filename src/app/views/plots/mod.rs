//! The view "Plots": predicted against measured visits of nodes, and what was predicted of trees against what was measured.

mod nodes;
mod state;
mod table;
mod trees;

pub use state::{PlotKind, PlotsView, TreeQuality, TreeSet};

use std::sync::Arc;

use egui::{self, Align, Key, Layout, Ui};

use self::state::{PlottedTree, ScatterInputs, TreeToMeasure};
use super::parts;
use crate::accel::Accel;
use crate::app::state::paper::Experiment;
use crate::app::state::{AppState, Presented, Request, ViewState as _};
use crate::app::studies::{Studies, StudyPlan};
use crate::app::views::{Needs, View};
use crate::app::widgets::{DropDown, Tip as _, chip};
use crate::lab::at_rest::measure_at_rest;
use crate::lab::visit_scatter::VisitScatter;
use crate::scene::Scene;
use bvhscope_engine::builders::BuildError;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

impl View for PlotsView {
    const PURPOSE: &'static str = "What the SAH predicts against what rays really do: visits of nodes, cost of trees, and how long better trees take to build";
    const KEY: Key = Key::F10;

    fn ui(&mut self, ui: &mut Ui, state: &mut AppState) {
        let Some(shown) = parts::presented_tree(ui, state, "Open a model to plot its tree") else { return };
        ui.horizontal(|ui| {
            for kind in PlotKind::ALL {
                if chip(ui, kind.label(), self.kind == kind, kind.meaning()) {
                    self.kind = kind;
                }
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| outputs(ui, self, state, &shown));
        });
        ui.horizontal(|ui| {
            parts::rays(ui, state, &shown);
            if self.kind != PlotKind::Nodes {
                sets(ui, self, state);
            }
            if self.kind == PlotKind::Speed {
                let tip = "The number by which trees are judged; less is better";
                DropDown::new("Quality", &TreeQuality::ALL).beside(ui, "Quality", tip, &mut self.quality);
            }
        });
        match self.kind {
            PlotKind::Nodes => nodes::show(ui, self, state, &shown),
            PlotKind::Prediction => trees::show_predictions(ui, self, state, &shown),
            PlotKind::Speed => trees::show_speed(ui, self, state, &shown),
            PlotKind::List => trees::show_list(ui, self, state, &shown),
        }
    }

    fn needs(&self) -> Needs {
        Needs { visits: true, ..Needs::default() }
    }

    fn add_studies(studies: &mut Studies) -> std::io::Result<()> {
        add_scatter(studies)?;
        add_session(studies)
    }
}

/// The list of trees to plot, and the button that measures the builders.
fn sets(ui: &mut Ui, view: &mut PlotsView, state: &mut AppState) {
    let choices = TreeSet::ALL.map(|set| {
        let [label, meaning] = set.texts();
        (set, label, meaning)
    });
    DropDown::new("Trees", &choices).beside(ui, "Trees", "The trees that are plotted", &mut view.set);
    let TreeSet::Measured(experiment) = view.set else { return };
    if state.activity.measure.is_some() {
        if ui.button("Cancel measuring").tip("Stop and keep the finished trees (Esc)").clicked() {
            state.activity.requests.push(Request::CancelMeasuring);
        }
        return;
    }
    let what = if experiment == Experiment::Thresholds { "thresholds" } else { "builders" };
    let tip = format!("Measure the {what} on the open model in the background, as the view Paper is set");
    if ui.add(egui::Button::new(format!("Measure {what}"))).tip(tip).clicked() {
        state.preferences.paper.choose(experiment);
        state.activity.requests.push(Request::Measure);
    }
}

/// The buttons that copy what is plotted as a table, and save the picture.
fn outputs(ui: &mut Ui, view: &PlotsView, state: &mut AppState, shown: &Presented) {
    let has_any = match view.kind {
        PlotKind::Nodes => view.scatter.of_tree(&shown.accel).is_some(),
        _ => !trees::plotted(view, state, shown).is_empty(),
    };
    let has_plot = has_any && view.kind != PlotKind::List;
    let save = ui.add_enabled(has_plot, egui::Button::new("PNG"));
    if save.tip("Save the plot as a picture in the current folder").clicked() {
        let plots = table::figure(view, state, shown);
        state.activity.requests.push(Request::SavePlots(parts::plot_name(shown, table::stem(view)), plots));
    }
    let copy = ui.add_enabled(has_any, egui::Button::new("Copy"));
    if copy.tip("Copy what is plotted as tab-separated text").clicked() {
        let (text, note) = table::tsv(view, state, shown);
        state.copy(text, &note);
    }
}

/// Adds the study: the scatter of nodes by predicted and measured visits.
fn add_scatter(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan::new(
        "scatter",
        "Comparing visits",
        |state| &mut state.views.get_mut::<PlotsView>().scatter,
        |state, _| {
            // Trees of the session are noted while the view is closed, too.
            let (view, model) = (state.views.get_mut::<PlotsView>(), &state.model);
            for shown in [&model.second, &model.presented].into_iter().flatten() {
                view.note_tree(&model.derived, &shown.accel);
            }
            state.inputs_of(|_: &PlotsView, model, accel| PlotsView::inputs(&model.derived, accel))
        },
    );
    studies.add(plan, |accel, inputs: &ScatterInputs, token| {
        // Plotted beside the measured cost.
        accel.epo(None, token)?;
        VisitScatter::new(accel, inputs.sums.clone(), &inputs.visits, token)
    })
}

/// Adds the study: the readings of a tree of the session, while all of them are to be measured.
fn add_session(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan::new(
        "session",
        "Measuring trees",
        |state| &mut state.views.get_mut::<PlotsView>().measured,
        |state, _| {
            let accel = state.tree_of_view(PlotsView::NAME)?;
            let rays = state.model.derived.rays(&accel.scene)?;
            let wanted = state.views.get_mut::<PlotsView>().next_to_measure(&accel, rays)?;
            Some((accel, wanted))
        },
    );
    studies.add(plan, |accel, wanted: &TreeToMeasure, token| measure_tree(&accel.scene, wanted, token))
}

/// Builds a tree of `scene` and repeats that, or reads it from its file, and counts rays: a second or two. `None` of a tree that cannot be
/// built or read.
fn measure_tree(
    scene: &Arc<Scene>,
    TreeToMeasure { build, file, rays }: &TreeToMeasure,
    token: &CancelToken,
) -> Result<Option<PlottedTree>, Cancelled> {
    let part = token.part(0, 3);
    let accel = match file {
        Some(path) => Accel::read(scene, path, build.optimize, &part).map_err(BuildError::from),
        None => Accel::build_binary(scene, build, &part),
    };
    let accel = match accel {
        Ok(accel) => Arc::new(accel),
        Err(BuildError::Refused(_)) => return Ok(None),
        Err(BuildError::Cancelled(cancelled)) => return Err(cancelled),
    };
    measure_at_rest(&[&accel], &token.part(1, 3))?;
    accel.epo(None, token)?;
    let sums = rays.measure(&accel, &token.part(2, 3))?.sums;
    Ok(Some(PlottedTree { cost: (sums.root_hits > 0).then_some(sums.cost), ..PlottedTree::of(&accel) }))
}
