//! The width of each node, derived from all that is below it.

use crate::app::state::lab::{IcicleInputs, IcicleState};
use crate::app::studies::{Studies, StudyPlan};
use crate::lab::icicle::subtree_sums;

pub(super) fn add(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan {
        name: "icicle",
        label: "Measuring subtrees",
        at_once: false,
        study: |state| &mut state.lab.icicle.sums,
        wanted: |state, _| {
            let accel = state.tree_of_view(IcicleState::VIEW)?;
            let inputs = state.lab.icicle_inputs(&accel)?;
            Some((accel, inputs))
        },
    };
    studies.add(plan, |accel, inputs: &IcicleInputs, token| {
        accel.compute_ancestry(token)?;
        subtree_sums(accel, inputs.width, inputs.visits.as_ref(), token)
    })
}
