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

/// Recomputes the containers of `tree`, bottom-up, from `container` of each primitive.
pub fn refit<C: Container>(
    tree: &mut Tree<C>,
    container: impl Fn(u32) -> C,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    for index in (0..tree.nodes.len()).rev() {
        token.check_every(MEDIUM_STEPS, index)?;
        let node = tree.nodes[index];
        let first = node.first as usize;
        tree.nodes[index].container = if node.is_leaf() {
            around(&tree.primitive_indices[first..first + node.count as usize], &container, token)?
        } else {
            tree.nodes[first].container.union(&tree.nodes[first + 1].container)
        };
    }
    Ok(())
}

/// The container around the primitives with these indices.
fn around<C: Container>(indices: &[u32], container: &impl Fn(u32) -> C, token: &CancelToken) -> Result<C, Cancelled> {
    let mut all = C::EMPTY;
    for batch in indices.chunks(MEDIUM_STEPS) {
        // Leaves of usual size are polled for by node.
        if batch.len() == MEDIUM_STEPS {
            token.check()?;
        }
        all = batch.iter().fold(all, |all, primitive| all.union(&container(*primitive)));
    }
    Ok(all)
}
