//! Optional passes over a finished tree, whichever builder made it, that never raise its SAH cost: [`collapse`] makes
//! leaves of several primitives, [`mod@restructure`] rebuilds treelets from the top, [`mod@reinsert`] moves subtrees.

#![allow(clippy::inline_always, reason = "kernels and what they call for each node")]

pub(crate) mod partition;
mod sah;
mod subtree_costs;

mod collapse;
mod reinsert;
mod restructure;

use std::any::Any;
use std::time::Instant;

use collapse::collapse_in_order;
use reinsert::reinsert;
use restructure::restructure;
use subtree_costs::subtree_costs;

use crate::aac::ClusterContainer;
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Aabb;
use crate::settings::{Pass, Passes};
use crate::stage_times::StageTimes;
use crate::tree::Tree;
use crate::tree::statistics::normalized_cost;

/// Runs those of `passes` that apply to finished trees, in the order of [`Pass::ALL`]. Adds a stage and a cost for
/// each, and a stage "layout" for writing the nodes in order. Passes for boxes leave a tree of spheres unchanged. The
/// result is the same for any number of threads.
pub fn optimize<C: ClusterContainer>(
    mut tree: Tree<C>,
    passes: Passes,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    let passes = passes.without(Pass::Split);
    if tree.nodes.len() < 2 || passes == Passes::NONE {
        return Ok(tree);
    }
    let root_area = f64::from(tree.nodes[0].container.relative_area());
    let primitives = tree.primitive_indices.len();
    let collapses = passes.contains(Pass::Collapse);
    let mut start = Instant::now();
    let (costs, initial_cost) = subtree_costs(&mut tree.nodes, collapses, token)?;
    let mut cost = f64::from(costs[0].cost);
    times.costs.push(("tree", normalized_cost(initial_cost, root_area)));
    let mut finish_pass = |pass: Pass, cost: f64| {
        times.stages.push((pass.name(), start.elapsed()));
        times.costs.push((pass.name(), normalized_cost(cost, root_area)));
        start = Instant::now();
        token.check()
    };
    if collapses {
        finish_pass(Pass::Collapse, cost)?;
    }
    if let Some(box_tree) = (&mut tree as &mut dyn Any).downcast_mut::<Tree<Aabb>>() {
        if passes.contains(Pass::Restructure) {
            cost -= f64::from(restructure(box_tree, costs, collapses, token)?);
            finish_pass(Pass::Restructure, cost)?;
        }
        if passes.contains(Pass::Reinsert) {
            cost -= reinsert(&mut box_tree.nodes, primitives, cost, token)?;
            finish_pass(Pass::Reinsert, cost)?;
        }
    }
    let start = Instant::now();
    let cost = collapse_in_order(&mut tree, collapses, token)?;
    times.stages.push(("layout", start.elapsed()));
    // The moved nodes may allow further collapses.
    if let Some((_, last)) = times.costs.last_mut() {
        *last = normalized_cost(f64::from(cost), root_area);
    }
    Ok(tree)
}
