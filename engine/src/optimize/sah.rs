//! What lies below a node, by the surface area heuristic (Goldsmith, Salmon, *Automatic Creation of Object Hierarchies*, 1987).

#![allow(clippy::inline_always, reason = "called from SIMD kernels, which must not leave their instructions")]

use crate::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST};

/// Most primitives in a leaf that is made here: flat and coinciding triangles would give leaves without end.
const MAX_LEAF_SIZE: u32 = 32;

/// SAH cost of one leaf with `primitives`, not normalised.
#[inline(always)]
pub fn leaf_cost(area: f32, primitives: u32) -> f32 {
    area * primitives as f32 * INTERSECTION_COST
}

/// SAH cost of a node over children that cost `below` together, and whether it is a leaf: that of the cheaper, where
/// subtrees may become leaves.
#[inline(always)]
pub fn joined_cost(area: f32, primitives: u32, below: f32, collapses: bool) -> (f32, bool) {
    let node = area * TRAVERSAL_COST + below;
    let leaf = leaf_cost(area, primitives);
    if collapses && primitives <= MAX_LEAF_SIZE && leaf <= node { (leaf, true) } else { (node, false) }
}
