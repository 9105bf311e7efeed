//! The scatter of nodes by predicted and measured visits.

use crate::app::state::lab::{PlotsState, ScatterInputs};
use crate::app::studies::{Studies, StudyPlan};
use crate::lab::visit_scatter::VisitScatter;

pub(super) fn add(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan {
        name: "scatter",
        label: "Comparing visits",
        at_once: false,
        study: |state| &mut state.lab.plots.scatter,
        wanted: |state, _| {
            // Trees of the session are noted while the view is closed, too.
            let trees = [&state.model.second, &state.model.presented];
            trees.into_iter().flatten().for_each(|shown| state.lab.note_tree(&shown.accel));
            let accel = state.tree_of_view(PlotsState::VIEW)?;
            let inputs = state.lab.scatter_inputs(&accel)?;
            Some((accel, inputs))
        },
    };
    studies.add(plan, |accel, inputs: &ScatterInputs, token| {
        // Plotted beside the measured cost.
        accel.epo(token)?;
        VisitScatter::new(accel, inputs.rays.population(), &inputs.visits, token)
    })
}
