//! Optional passes over a finished tree, none of which ever raises its SAH cost: leaves of several primitives, treelets built
//! again from the top, subtrees moved to better places. Works on the tree alone, whichever builder made it.

#![allow(clippy::inline_always, reason = "kernels and what they call for each node")]

pub(crate) mod partition;
mod sah;
mod subtree_costs;

mod collapse;
mod reinsert;
mod restructure;

use std::any::Any;
use std::time::Instant;

use collapse::compact;
use reinsert::reinsert;
use restructure::restructure;
use subtree_costs::weigh;

use crate::aac::ClusterContainer;
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Aabb;
use crate::settings::{Pass, Passes};
use crate::stage_times::StageTimes;
use crate::tree::Tree;
use crate::tree::statistics::share;

/// Runs those of `passes` that are for finished trees, in the order of [`Pass::ALL`], and adds a stage and a cost for each, and a stage for putting the nodes in order.
/// Those for boxes only leave a tree of spheres as it is. The same result on any number of threads.
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
    let (weights, plain_cost) = weigh(&mut tree.nodes, collapses, token)?;
    let mut cost = f64::from(weights[0].cost);
    times.costs.push(("tree", share(plain_cost, root_area)));
    let mut done = |pass: Pass, cost: f64| {
        times.stages.push((pass.name(), start.elapsed()));
        times.costs.push((pass.name(), share(cost, root_area)));
        start = Instant::now();
        token.check()
    };
    if collapses {
        done(Pass::Collapse, cost)?;
    }
    if let Some(boxes) = (&mut tree as &mut dyn Any).downcast_mut::<Tree<Aabb>>() {
        if passes.contains(Pass::Restructure) {
            cost -= f64::from(restructure(boxes, weights, collapses, token)?);
            done(Pass::Restructure, cost)?;
        }
        if passes.contains(Pass::Reinsert) {
            cost -= reinsert(&mut boxes.nodes, primitives, cost, token)?;
            done(Pass::Reinsert, cost)?;
        }
    }
    let start = Instant::now();
    let cost = compact(&mut tree, collapses, token)?;
    times.stages.push(("layout", start.elapsed()));
    // What moved may collapse further.
    if let Some((_, last)) = times.costs.last_mut() {
        *last = share(f64::from(cost), root_area);
    }
    Ok(tree)
}
