//! Scaling of scenes whose areas would overflow or vanish in `f32`. Scaling by a power of two is exact, and so is the shape
//! of the tree; its containers are then recomputed from the original triangles.

use crate::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use crate::geometry::Triangle;
use crate::tree::{Container, Tree};

/// The triangles, scaled by `scale`.
pub fn scaled(triangles: &[Triangle], scale: f32, token: &CancelToken) -> Result<Vec<Triangle>, Cancelled> {
    let mut scaled = Vec::with_capacity(triangles.len());
    for batch in triangles.chunks(MEDIUM_STEPS) {
        token.check()?;
        scaled.extend(batch.iter().map(|t| Triangle { a: t.a * scale, b: t.b * scale, c: t.c * scale }));
    }
    Ok(scaled)
}

/// Recomputes the containers of `tree`, bottom-up, for other coordinates of its triangles.
pub fn refit<C: Container>(tree: &mut Tree<C>, triangles: &[Triangle], token: &CancelToken) -> Result<(), Cancelled> {
    for index in (0..tree.nodes.len()).rev() {
        token.check_every(MEDIUM_STEPS, index)?;
        let node = tree.nodes[index];
        let first = node.first as usize;
        tree.nodes[index].container = if node.is_leaf() {
            container_of(&tree.primitive_indices[first..first + node.count as usize], triangles, token)?
        } else {
            tree.nodes[first].container.union(&tree.nodes[first + 1].container)
        };
    }
    Ok(())
}

/// The container of the triangles with these indices.
fn container_of<C: Container>(indices: &[u32], triangles: &[Triangle], token: &CancelToken) -> Result<C, Cancelled> {
    let mut container = C::EMPTY;
    for batch in indices.chunks(MEDIUM_STEPS) {
        // Leaves of usual size are polled for by node.
        if batch.len() == MEDIUM_STEPS {
            token.check()?;
        }
        let containers = batch.iter().map(|&primitive| C::of_triangle(&triangles[primitive as usize]));
        container = containers.fold(container, |all, one| all.union(&one));
    }
    Ok(container)
}
