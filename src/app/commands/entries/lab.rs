//! Entries of the menu "Lab".

use egui::Key;

use super::list::{List, NONE};
use crate::app::commands::action::Action;
use crate::app::commands::entry::Category;
use crate::app::state::paper::{Experiment, RowFormat};

/// Adds the entries of the menu.
pub(super) fn add(list: &mut List) {
    let place = |group| (Category::Lab, group);
    list.add(
        place(0),
        Action::TogglePaper,
        "Paper panel",
        "Measure the paper's tables and figures on the open model",
        &[(NONE, Key::F6)],
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
