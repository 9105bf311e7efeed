//! No hierarchy: a single leaf, for comparison.

use std::time::Instant;

use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use crate::geometry::Triangle;
use crate::stage_times::StageTimes;
use crate::tree::{Container, Node, Tree};

/// Builds a tree whose root is a leaf with all `triangles`.
pub fn build<C: Container>(
    triangles: &[Triangle],
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    let start = Instant::now();
    let mut container = C::EMPTY;
    for batch in triangles.chunks(LIGHT_STEPS) {
        token.check()?;
        container = batch.iter().fold(container, |all, triangle| all.union(&C::of_triangle(triangle)));
    }
    let count = triangles.len() as u32;
    let mut primitive_indices = Vec::with_capacity(triangles.len());
    while primitive_indices.len() < triangles.len() {
        token.check()?;
        let first_index = primitive_indices.len() as u32;
        primitive_indices.extend(first_index..count.min(first_index.saturating_add(LIGHT_STEPS as u32)));
    }
    let tree = Tree { nodes: vec![Node { container, first: 0, count }], primitive_indices, max_depth: 0 };
    times.stages.push(("tree", start.elapsed()));
    token.set_progress(1.0);
    Ok(tree)
}
