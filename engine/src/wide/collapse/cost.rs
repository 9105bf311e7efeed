//! Cost of a subtree by the surface area heuristic, as a leaf or under at most one to eight lanes of a wide node, and
//! the decision that minimises it (Ylitie, Karras, Laine, *Efficient Incoherent Ray Traversal on GPUs Through
//! Compressed Wide BVHs*, 2017, section 3).

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Select, Simd, SimdBase, f32x8, u32x8};

use crate::wide::collapse::decision::LANE_BITS;
use crate::wide::layout::{BLOCK, WIDTH};

/// Cost of visiting a wide node relative to that of testing a block. Found by experiment.
pub(crate) const NODE_COST: f32 = 0.5;
/// Maximum number of primitives in a leaf, unless a binary leaf holds more.
pub(crate) const MAX_LEAF_SIZE: u32 = 16;

/// Least cost of a subtree with at most one to eight lanes: surface area times cost, summed over all its nodes.
pub(crate) type LaneCosts = [f32; WIDTH];

/// Number of blocks for `primitives` triangles.
#[inline(always)]
pub(crate) fn block_count(primitives: u32) -> f32 {
    // Converting a signed integer takes a single instruction.
    primitives.div_ceil(BLOCK as u32) as i32 as f32
}

/// Cost of a node by the number of lanes that it may take.
pub(crate) struct CollapseCost<S: Simd> {
    /// Whether it becomes a leaf, for any number of lanes.
    pub(crate) is_leaf: bool,
    /// Cost where it takes one lane.
    pub(crate) cost: f32,
    /// Cost with at most one to eight lanes where it does not become a leaf.
    pub(crate) costs: f32x8<S>,
    /// Lanes of its left child, packed as in [`crate::wide::collapse::decision::Decision`].
    pub(crate) lanes: u32,
}

/// Cost of collapsing a node into 1 to 8 lanes, and the cheapest way to distribute these lanes among its children,
/// whose costs are `costs`. A child that is a leaf costs the same for any number of lanes.
#[inline(always)]
pub(crate) fn collapse_cost<S: Simd>(
    simd: S,
    area: f32,
    primitives: u32,
    costs: [f32x8<S>; 2],
    are_leaves: [bool; 2],
) -> CollapseCost<S> {
    // NaN, which is never less, where there are too many primitives for a leaf.
    let leaf_cost = if primitives <= MAX_LEAF_SIZE { area * block_count(primitives) } else { f32::NAN };
    let [left, right] = costs;
    let infinity = f32x8::splat(simd, f32::INFINITY);
    let (costs, lanes) = if are_leaves[0] | are_leaves[1] {
        // A leaf takes one lane.
        let leaf_is_left = u32x8::splat(simd, u32::from(are_leaves[0])).simd_eq(u32x8::splat(simd, 1));
        let (leaf_side, other_side) = (leaf_is_left.select(left, right), leaf_is_left.select(right, left));
        let lanes = u32x8::from_slice(simd, [&ONE_LANE_RIGHT, &LEFT_LANES[0]][usize::from(are_leaves[0])]);
        (infinity.slide::<{ WIDTH - 1 }>(other_side) + leaf_side, lanes)
    } else {
        distribute_lanes(simd, left, right)
    };
    let split = area * NODE_COST + costs[WIDTH - 1];
    let as_node = f32x8::splat(simd, split);
    // A node that may take all eight lanes is always opened.
    let limit = as_node.max(f32x8::from_slice(simd, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, f32::INFINITY]));
    let lanes = costs.simd_gt(limit).select(u32x8::splat(simd, 0), lanes);
    CollapseCost {
        is_leaf: leaf_cost <= split,
        cost: leaf_cost.min(split),
        costs: costs.min(as_node),
        lanes: lanes.reduce_sum(),
    }
}

/// Costs of two nodes together with one to eight lanes, and the number of these for the left one.
#[inline(always)]
fn distribute_lanes<S: Simd>(simd: S, left: f32x8<S>, right: f32x8<S>) -> (f32x8<S>, u32x8<S>) {
    let left_costs = left.to_array();
    let infinity = f32x8::splat(simd, f32::INFINITY);
    // One lane for the left node unless another number is cheaper, so that both have one whatever their costs are: areas add up to
    // infinity.
    let mut costs = infinity.slide::<{ WIDTH - 1 }>(right) + f32x8::splat(simd, left_costs[0]);
    let mut lanes = u32x8::from_slice(simd, &LEFT_LANES[0]);
    // Considers each number of lanes for the left node; the right one gets the rest.
    macro_rules! distribute_lanes {
        ($($left:literal),*) => {$({
            let cost = infinity.slide::<{ WIDTH - $left }>(right) + f32x8::splat(simd, left_costs[$left - 1]);
            let cheaper = cost.simd_lt(costs);
            costs = cost.min(costs);
            lanes = cheaper.select(u32x8::from_slice(simd, &LEFT_LANES[$left - 1]), lanes);
        })*};
    }
    distribute_lanes!(2, 3, 4, 5, 6, 7);
    (costs, lanes)
}

/// Bits of a [`crate::wide::collapse::decision::Decision`] for each number of lanes where one to seven go to the left
/// child.
const LEFT_LANES: [[u32; WIDTH]; WIDTH - 1] = {
    let mut table = [[0; WIDTH]; WIDTH - 1];
    let mut left = 1;
    while left < WIDTH {
        let mut lane = 1;
        while lane < WIDTH {
            table[left - 1][lane] = (left as u32) << (LANE_BITS * (lane as u32 - 1));
            lane += 1;
        }
        left += 1;
    }
    table
};

/// [`LEFT_LANES`] where all lanes but one go to the left child.
const ONE_LANE_RIGHT: [u32; WIDTH] = {
    let mut row = [0; WIDTH];
    let mut lane = 1;
    while lane < WIDTH {
        row[lane] = LEFT_LANES[lane - 1][lane];
        lane += 1;
    }
    row
};
