//! Optional passes over a finished tree, each of which never raises its SAH cost: treelets built again from the top, subtrees
//! moved to better places, leaves of several primitives. Works on the tree alone, whichever builder made it.

mod below;
mod collapse;
mod layout;
mod reinsert;
mod restructure;
mod sweep;

use std::any::Any;
use std::time::Instant;

use super::builders::StageTimes;
use super::settings::{Pass, Passes};
use super::{Container, Tree};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Aabb;

/// Runs `passes` in the order of [`Pass::ALL`] and adds a stage for each. Those for boxes only leave a tree of spheres as it
/// is. The same result on any number of threads.
pub fn optimize<C: Container>(
    mut tree: Tree<C>,
    passes: Passes,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    if tree.nodes.len() < 2 {
        return Ok(tree);
    }
    let mut moved = false;
    if let Some(boxes) = (&mut tree as &mut dyn Any).downcast_mut::<Tree<Aabb>>() {
        if passes.contains(Pass::Restructure) {
            token.check()?;
            let start = Instant::now();
            restructure::restructure(&mut boxes.nodes, token)?;
            times.stages.push((Pass::Restructure.name(), start.elapsed()));
            moved = true;
        }
        if passes.contains(Pass::Reinsert) {
            token.check()?;
            let start = Instant::now();
            reinsert::reinsert(&mut boxes.nodes, token)?;
            times.stages.push((Pass::Reinsert.name(), start.elapsed()));
            moved = true;
        }
    }
    let collapses = passes.contains(Pass::Collapse);
    if moved || collapses {
        token.check()?;
        let start = Instant::now();
        let becomes_leaf = if collapses { collapse::cheaper_as_leaves(&tree.nodes) } else { Vec::new() };
        tree = layout::depth_first(&tree, &becomes_leaf);
        times.stages.push((if collapses { Pass::Collapse.name() } else { "layout" }, start.elapsed()));
    }
    Ok(tree)
}
