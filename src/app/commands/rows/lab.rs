//! Actions of the menu "Lab".

use egui::Key;

use super::parts::{ALT, NONE, is_presented};
use crate::app::commands::action::{Action, RankingStep};
use crate::app::commands::nodes;
use crate::app::commands::row::{Item, Row, item, many, one};
use crate::app::state::dock::DockView;
use crate::app::state::paper::{Experiment, RowFormat};
use crate::app::state::{AppState, Request};

pub(in crate::app::commands) static ROWS: &[&[Row]] = &[
    &[
        many(views, |state, index| state.preferences.dock.toggle(DockView::ALL[index]))
            .switch(|state, index| Some(state.preferences.dock.open == Some(DockView::ALL[index]))),
        one(
            Action::StepRanking(RankingStep::Next),
            "Next worst node",
            "Select and frame the next node in the list of worst nodes",
            &[(ALT, Key::Period)],
            |state, _| nodes::step_ranking(state, RankingStep::Next),
        )
        .when(is_presented)
        .repeated(),
        one(
            Action::StepRanking(RankingStep::Previous),
            "Previous worst node",
            "Select and frame the node before in the list of worst nodes",
            &[(ALT, Key::Comma)],
            |state, _| nodes::step_ranking(state, RankingStep::Previous),
        )
        .when(is_presented)
        .repeated(),
    ],
    &[
        many(experiments, measure).when(|state, _| state.model.loaded.is_some()).within("Measure"),
        many(files, |state, index| state.requests.push(Request::SaveRows(RowFormat::ALL[index])))
            .when(can_save)
            .within("Save measured"),
    ],
];

/// One action per view of the dock.
fn views() -> Vec<Item> {
    let view = |view: DockView| {
        let key = match view {
            DockView::Merges => Key::F6,
            DockView::Icicle => Key::F7,
            DockView::Ray => Key::F8,
            DockView::Nodes => Key::F9,
            DockView::Plots => Key::F10,
            DockView::Paper => Key::F11,
        };
        Item { key: Some((NONE, key)), ..item(Action::ToggleDock(view), view.label(), view.purpose()) }
    };
    DockView::ALL.map(view).into()
}

fn experiments() -> Vec<Item> {
    let experiment = |experiment: Experiment| {
        let tip = match experiment.in_paper() {
            "" => experiment.description().to_owned(),
            number => format!("{} (the paper's {number})", experiment.description()),
        };
        item(Action::Measure(experiment), format!("Measure: {}", experiment.label()), tip)
    };
    Experiment::ALL.map(experiment).into()
}

fn measure(state: &mut AppState, index: usize) {
    state.preferences.paper.choose(Experiment::ALL[index]);
    state.preferences.dock.open = Some(DockView::Paper);
    state.requests.push(Request::Measure);
}

fn files() -> Vec<Item> {
    let file = |format: RowFormat| {
        let what = match format {
            RowFormat::Csv | RowFormat::Json => "rows",
            RowFormat::Png | RowFormat::Svg => "plot",
        };
        let label = format!("Save measured {what} as {}", format.label());
        item(Action::SaveRows(format), label, "Save a file beside the model")
    };
    RowFormat::ALL.map(file).into()
}

fn can_save(state: &AppState, index: usize) -> bool {
    let result = state.activity.measured.get(&state.preferences.paper.experiment);
    result.is_some_and(|result| match RowFormat::ALL[index] {
        RowFormat::Csv | RowFormat::Json => !result.rows.is_empty(),
        RowFormat::Png | RowFormat::Svg => !result.figure.charts.is_empty(),
    })
}
