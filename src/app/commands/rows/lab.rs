//! Actions of the menu "Lab".

use egui::Key;

use crate::app::commands::nodes;
use crate::app::commands::row::{ALT, Item, NONE, Row, SHIFT, is_presented, item, many, one};
use crate::app::state::action::{Action, RankingStep};
use crate::app::state::paper::{Experiment, PaperPlan, RowFormat};
use crate::app::state::{AppState, Request};
use crate::app::views::{Tab, VIEWS};

pub(in crate::app::commands) static ROWS: &[&[Row]] = &[
    &[
        many(views, |state, index| state.preferences.dock.toggle(VIEWS[index].name))
            .switch(|state, index| Some(state.preferences.dock.shows(VIEWS[index].name))),
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
        one(
            Action::StepCopies(RankingStep::Next),
            "Next worst copy",
            "Select and frame the next of the copies with most tests, in a scene of two levels",
            &[(ALT.plus(SHIFT), Key::Period)],
            |state, _| nodes::step_copies(state, RankingStep::Next),
        )
        .when(has_copies)
        .repeated(),
        one(
            Action::StepCopies(RankingStep::Previous),
            "Previous worst copy",
            "Select and frame the one before of the copies with most tests",
            &[(ALT.plus(SHIFT), Key::Comma)],
            |state, _| nodes::step_copies(state, RankingStep::Previous),
        )
        .when(has_copies)
        .repeated(),
    ],
    &[
        many(experiments, measure).when(|state, _| state.model.loaded.is_some()).within("Measure"),
        many(files, |state, index| state.activity.requests.push(Request::SaveRows(RowFormat::ALL[index])))
            .when(|state, index| state.can_save_rows(RowFormat::ALL[index]))
            .within("Save measured"),
    ],
];

fn has_copies(state: &AppState, _: usize) -> bool {
    state.model.presented.as_ref().is_some_and(|shown| shown.accel.scene.copies.is_some())
}

/// One action per view of the dock.
fn views() -> Vec<Item> {
    let item_of = |view: &Tab| Item {
        key: Some((NONE, view.key)),
        ..item(Action::ToggleDock(view.name), view.name, view.purpose)
    };
    VIEWS.iter().map(item_of).collect()
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
    state.preferences.dock.show(PaperPlan::VIEW);
    state.activity.requests.push(Request::Measure);
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
