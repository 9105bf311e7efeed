//! The ranking of the nodes.

use crate::app::state::lab::{NodesState, RankingInputs};
use crate::app::studies::{Studies, StudyPlan};
use crate::lab::node_ranking::rank_nodes;
use crate::lab::node_values::NodeValues;

pub(super) fn add(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan {
        name: "ranking",
        label: "Ranking nodes",
        at_once: false,
        study: |state| &mut state.lab.nodes.ranking,
        wanted: |state, _| {
            let accel = state.tree_of_view(NodesState::VIEW)?;
            let inputs = state.lab.ranking_inputs(&accel)?;
            Some((accel, inputs))
        },
    };
    studies.add(plan, |accel, inputs: &RankingInputs, token| {
        let visits = inputs.visits.as_ref().map(|visits| &*visits.0);
        rank_nodes(&NodeValues { accel, visits }, &inputs.order, token)
    })
}
