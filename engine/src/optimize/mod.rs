//! Optional passes over a finished tree, whichever builder made it, that never raise its SAH cost: [`collapse`] makes
//! leaves of several primitives, [`mod@restructure`] rebuilds treelets from the top, [`mod@reinsert`] moves subtrees,
//! [`mod@anneal`] does both for as long as it is given. [`fn@orient`] comes last and makes a tree of other containers.

#![allow(clippy::inline_always, reason = "kernels and what they call for each node")]

mod move_search;
pub(crate) mod partition;
mod sah;
mod simd_box;
mod subtree_costs;

mod anneal;
mod collapse;
mod divisions;
mod orient;
mod reinsert;
mod restructure;

use std::time::Instant;

pub use anneal::ANNEALING_PARTS;
use anneal::anneal;
use collapse::collapse_in_order;
pub use orient::orient;
pub use reinsert::{Effort, reinsert, reinsert_worst};
use restructure::restructure;
pub(crate) use simd_box::NodeBounds;
pub(crate) use subtree_costs::subtree_costs;

use crate::aac::ClusterContainer;
use crate::cancel::{CancelToken, Cancelled};
use crate::settings::{BuildSettings, Pass, Passes};
use crate::stage_times::StageTimes;
use crate::tree::Tree;
use crate::tree::statistics::normalized_cost;

/// Writes the nodes of a binary tree, which may be in any order with siblings together, depth first, and primitives in leaf order.
pub fn write_in_order<C: ClusterContainer>(tree: &mut Tree<C>, token: &CancelToken) -> Result<(), Cancelled> {
    collapse_in_order(tree, false, token).map(|_| ())
}

/// Runs those of the passes of `settings` that apply to finished trees, in the order of [`Pass::ALL`], except that trees to anneal
/// are collapsed at the end: subtrees can be moved only while they are there. `source` is the triangle that a primitive is a
/// part of, where some are split; annealing can leave parts out. Adds a stage and a cost for each pass, and a stage "layout"
/// for writing the nodes in order. Passes for boxes leave trees of other containers unchanged. The result is the same for any number of
/// threads.
pub fn optimize<C: ClusterContainer>(
    mut tree: Tree<C>,
    settings: &BuildSettings,
    source: Option<&dyn Fn(u32) -> u32>,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    let passes = settings.passes().without(Pass::Split).without(Pass::Orient);
    if tree.nodes.len() < 2 || passes == Passes::NONE {
        return Ok(tree);
    }
    let root_area = f64::from(tree.nodes[0].container.relative_area());
    let primitives = tree.primitive_indices.len();
    let collapses = passes.contains(Pass::Collapse);
    let collapses_first = collapses && !passes.contains(Pass::Anneal);
    let mut start = Instant::now();
    let (costs, initial_cost) = subtree_costs(&mut tree.nodes, collapses_first, token)?;
    let mut cost = f64::from(costs[0].cost);
    times.costs.push(("tree", normalized_cost(initial_cost, root_area)));
    let mut finish_pass = |pass: Pass, cost: f64| {
        times.stages.push((pass.name(), start.elapsed()));
        times.costs.push((pass.name(), normalized_cost(cost, root_area)));
        start = Instant::now();
        token.check()
    };
    if collapses_first {
        finish_pass(Pass::Collapse, cost)?;
    }
    if let Some(box_tree) = C::boxes_of(&mut tree) {
        if passes.contains(Pass::Restructure) {
            cost -= f64::from(restructure(box_tree, costs, collapses_first, token)?);
            finish_pass(Pass::Restructure, cost)?;
        }
        if passes.contains(Pass::Reinsert) {
            cost -= reinsert(&mut box_tree.nodes, primitives, cost, Effort::PASS, token)?;
            finish_pass(Pass::Reinsert, cost)?;
        }
        if passes.contains(Pass::Anneal) {
            (cost, times.annealing) = anneal(box_tree, source, settings.rounds, collapses, token)?;
            finish_pass(Pass::Anneal, cost)?;
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
