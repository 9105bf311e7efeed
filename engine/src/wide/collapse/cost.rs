//! The costs of a subtree by the surface area heuristic, as a leaf or under at most one, two, up to eight lanes of a wide node, and
//! the choice that gives the least (Ylitie, Karras, Laine: *Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide
//! BVHs*, 2017, section 3).

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Select, Simd, SimdBase, f32x8, u32x8};

use crate::wide::collapse::decision::BITS;
use crate::wide::layout::BLOCK;
use crate::wide::layout::WIDTH;

/// Cost of visiting a wide node, in the unit of testing a block. Found by trial.
pub(crate) const NODE_COST: f32 = 0.5;
/// Primitives that a wide leaf holds at most, unless a binary leaf holds more.
pub(crate) const MAX_LEAF: u32 = 16;

/// Surface area times cost, summed over everything, at best with at most one, two, up to eight lanes.
pub(crate) type Costs = [f32; WIDTH];

/// Blocks of so many triangles, as a cost.
#[inline(always)]
pub(crate) fn blocks_of(primitives: u32) -> f32 {
    // The conversion of signed numbers is one instruction.
    primitives.div_ceil(BLOCK as u32) as i32 as f32
}

/// What becomes of a node.
pub(crate) struct Weighed<S: Simd> {
    /// Whether a leaf, whatever lanes there are.
    pub(crate) is_leaf: bool,
    /// What it costs where it takes one lane.
    pub(crate) cost: f32,
    /// What it costs otherwise.
    pub(crate) costs: f32x8<S>,
    /// How many lanes its left child gets, as in [`crate::wide::collapse::decision::Choice`].
    pub(crate) lanes: u32,
}

/// What becomes of a node of this area above so many primitives, whose children cost this, those that are leaves the same for any
/// number of lanes.
#[inline(always)]
pub(crate) fn weigh<S: Simd>(
    simd: S,
    area: f32,
    primitives: u32,
    costs: [f32x8<S>; 2],
    are_leaves: [bool; 2],
) -> Weighed<S> {
    // Not less than anything where there are too many for a leaf.
    let whole = if primitives <= MAX_LEAF { area * blocks_of(primitives) } else { f32::NAN };
    let [left, right] = costs;
    let infinity = f32x8::splat(simd, f32::INFINITY);
    let (costs, lanes) = if are_leaves[0] | are_leaves[1] {
        // A leaf needs one lane.
        let is_left = u32x8::splat(simd, u32::from(are_leaves[0])).simd_eq(u32x8::splat(simd, 1));
        let (one, other) = (is_left.select(left, right), is_left.select(right, left));
        let lanes = u32x8::from_slice(simd, [&ALL_BUT_ONE_TO_LEFT, &TO_LEFT[0]][usize::from(are_leaves[0])]);
        (infinity.slide::<{ WIDTH - 1 }>(other) + one, lanes)
    } else {
        share(simd, left, right)
    };
    let split = area * NODE_COST + costs[WIDTH - 1];
    let as_node = f32x8::splat(simd, split);
    // Eight lanes are always shared.
    let limit = as_node.max(f32x8::from_slice(simd, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, f32::INFINITY]));
    let lanes = costs.simd_gt(limit).select(u32x8::splat(simd, 0), lanes);
    Weighed { is_leaf: whole <= split, cost: whole.min(split), costs: costs.min(as_node), lanes: lanes.reduce_sum() }
}

/// What two nodes cost together with one to eight lanes, and how many of these are for the left one.
#[inline(always)]
fn share<S: Simd>(simd: S, left: f32x8<S>, right: f32x8<S>) -> (f32x8<S>, u32x8<S>) {
    let of_left = left.to_array();
    let infinity = f32x8::splat(simd, f32::INFINITY);
    let (mut costs, mut lanes) = (infinity, u32x8::splat(simd, 0));
    // So many lanes to the left node, the others to the right one.
    macro_rules! share {
        ($($left:literal),*) => {$({
            let cost = infinity.slide::<{ WIDTH - $left }>(right) + f32x8::splat(simd, of_left[$left - 1]);
            let cheaper = cost.simd_lt(costs);
            costs = cost.min(costs);
            lanes = cheaper.select(u32x8::from_slice(simd, &TO_LEFT[$left - 1]), lanes);
        })*};
    }
    share!(1, 2, 3, 4, 5, 6, 7);
    (costs, lanes)
}

/// What a [`crate::wide::collapse::decision::Choice`] has for each number of lanes where one, two, up to seven go to the left child.
const TO_LEFT: [[u32; WIDTH]; WIDTH - 1] = {
    let mut table = [[0; WIDTH]; WIDTH - 1];
    let mut left = 1;
    while left < WIDTH {
        let mut lane = 1;
        while lane < WIDTH {
            table[left - 1][lane] = (left as u32) << (BITS * (lane as u32 - 1));
            lane += 1;
        }
        left += 1;
    }
    table
};

/// As [`TO_LEFT`] where one lane goes to the right child.
const ALL_BUT_ONE_TO_LEFT: [u32; WIDTH] = {
    let mut row = [0; WIDTH];
    let mut lane = 1;
    while lane < WIDTH {
        row[lane] = TO_LEFT[lane - 1][lane];
        lane += 1;
    }
    row
};
