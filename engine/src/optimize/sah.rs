//! Cost of nodes by the surface area heuristic (Goldsmith, Salmon, *Automatic Creation of Object Hierarchies for Ray
//! Tracing*, 1987).

#![allow(clippy::inline_always, reason = "called from SIMD kernels, which must not leave their instructions")]

use crate::tree::Container;
use crate::tree::statistics::INTERSECTION_COST;

/// Maximum number of primitives in a collapsed leaf: flat or coincident triangles would collapse without limit.
pub const MAX_LEAF_SIZE: u32 = 32;

/// SAH cost of a leaf of `primitives`, not normalised.
#[inline(always)]
pub fn leaf_cost(area: f32, primitives: u32) -> f32 {
    area * primitives as f32 * INTERSECTION_COST
}

/// SAH cost of a node with a container `C` whose children cost `children_cost` together, and whether it is cheaper as a leaf; never if not
/// `collapses`.
#[inline(always)]
pub fn node_or_leaf_cost<C: Container>(area: f32, primitives: u32, children_cost: f32, collapses: bool) -> (f32, bool) {
    let node = area * C::KIND.traversal_cost() + children_cost;
    let leaf = leaf_cost(area, primitives);
    if collapses && primitives <= MAX_LEAF_SIZE && leaf <= node { (leaf, true) } else { (node, false) }
}
