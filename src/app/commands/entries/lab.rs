//! Entries of the menu "Lab".

use egui::Key;

use super::list::{ALT, List, NONE};
use crate::app::commands::action::{Action, RankingStep};
use crate::app::commands::entry::Category;
use crate::app::state::dock::DockView;
use crate::app::state::paper::{Experiment, RowFormat};

/// Adds the entries of the menu.
pub(super) fn add(list: &mut List) {
    let place = |group| (Category::Lab, group);
    for view in DockView::ALL {
        let key = match view {
            DockView::Merges => Key::F6,
            DockView::Icicle => Key::F7,
            DockView::Ray => Key::F8,
            DockView::Nodes => Key::F9,
            DockView::Plots => Key::F10,
            DockView::Paper => Key::F11,
        };
        list.add(place(0), Action::ToggleDock(view), view.label(), view.purpose(), &[(NONE, key)]);
    }
    list.add(
        place(0),
        Action::StepRanking(RankingStep::Next),
        "Next worst node",
        "Select and frame the next node in the list of worst nodes",
        &[(ALT, Key::Period)],
    );
    list.add(
        place(0),
        Action::StepRanking(RankingStep::Previous),
        "Previous worst node",
        "Select and frame the node before in the list of worst nodes",
        &[(ALT, Key::Comma)],
    );
    for experiment in Experiment::ALL {
        let label = format!("Measure: {}", experiment.label());
        let description = match experiment.in_paper() {
            "" => experiment.description().to_owned(),
            number => format!("{} (the paper's {number})", experiment.description()),
        };
        list.add(place(1), Action::Measure(experiment), &label, &description, &[]);
    }
    for format in RowFormat::ALL {
        let what = match format {
            RowFormat::Csv | RowFormat::Json => "rows",
            RowFormat::Png | RowFormat::Svg => "plot",
        };
        let label = format!("Save measured {what} as {}", format.label());
        list.add(place(2), Action::SaveRows(format), &label, "Save a file in the current folder", &[]);
    }
}
