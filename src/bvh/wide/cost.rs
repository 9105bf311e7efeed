//! The costs of a subtree by the surface area heuristic, as a leaf or under at most one, two, up to eight lanes of a wide node, and
//! the choice that gives the least (Ylitie, Karras, Laine: *Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide
//! BVHs*, 2017, section 3).

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Select, Simd, SimdBase, f32x8, u32x8};

use super::block::BLOCK;
use super::choice::{BITS, COUNT_SHIFT};
use super::{WIDTH, WideContainer};
use crate::bvh::Node;

/// Cost of visiting a wide node, in the unit of testing a block. Found by trial.
pub(super) const NODE_COST: f32 = 0.5;
/// Primitives that a wide leaf holds at most, unless a binary leaf holds more.
pub(super) const MAX_LEAF: u32 = 16;
/// What is known of a node from what lies below.
#[derive(Debug, Clone, Copy)]
pub(super) struct Known {
    /// Surface area times cost, summed over everything, where it takes one lane.
    pub(super) cost: f32,
    pub(super) below: Below,
}

/// What lies below a node.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Below {
    /// Slot of the first primitive.
    pub(super) first: u32,
    /// Number of primitives; the largest number where they are not neighbours.
    pub(super) count: u32,
    /// Where in a list the costs are; [`SAME`] where they are the same for any number of lanes, [`WAITS`] where nothing is known
    /// yet.
    pub(super) costs: u32,
}

/// Surface area times cost, summed over everything, at best with at most one, two, up to eight lanes.
pub(super) type Costs = [f32; WIDTH];

pub(super) const SAME: u32 = u32::MAX - 1;
pub(super) const WAITS: u32 = u32::MAX;

impl Known {
    #[inline(always)]
    pub(super) fn leaf<C: WideContainer>(node: &Node<C>) -> Self {
        Self { cost: node.container.wide_area() * blocks_of(node.count), below: Below::leaf(node) }
    }

    #[inline(always)]
    fn costs(&self, list: &[Costs]) -> Costs {
        list.get(self.below.costs as usize).copied().unwrap_or([self.cost; WIDTH])
    }
}

impl Below {
    #[inline(always)]
    pub(super) fn leaf<C>(node: &Node<C>) -> Self {
        Self { first: node.first, count: node.count, costs: SAME }
    }
}

/// Blocks of so many triangles, as a cost.
#[inline(always)]
pub(super) fn blocks_of(primitives: u32) -> f32 {
    // The conversion of signed numbers is one instruction.
    primitives.div_ceil(BLOCK as u32) as i32 as f32
}

/// What becomes of a node of this area above `left` and `right`, whose costs are in `list`, and the last part of its [`Choice`].
/// Its own costs go to `list` at `at`, unless they are all the same.
#[inline(always)]
pub(super) fn weigh<S: Simd>(
    simd: S,
    area: f32,
    left: &Known,
    right: &Known,
    list: &mut [Costs],
    at: usize,
) -> (Known, u32) {
    let (first, count) = (left.below.first, left.below.count.saturating_add(right.below.count));
    let neighbours = right.below.first == first.wrapping_add(left.below.count);
    let count = if neighbours { count } else { u32::MAX };
    // Not less than anything where there are too many for a leaf.
    let whole = if count <= MAX_LEAF { area * blocks_of(count) } else { f32::NAN };
    let leaf = (Known { cost: whole, below: Below { first, count, costs: SAME } }, count << COUNT_SHIFT);
    let node = |cost: f32, lanes: u32| (Known { cost, below: Below { first, count, costs: at as u32 } }, lanes);
    if left.below.costs == SAME && right.below.costs == SAME {
        let both = left.cost + right.cost;
        let split = area * NODE_COST + both;
        list[at] = [split, both, both, both, both, both, both, both];
        // Nobody could predict which: no branch.
        let (leaf, node) = (leaf, node(split, EVENLY));
        return if whole <= split { leaf } else { node };
    }
    let (of_left, of_right) = (left.costs(list), right.costs(list));
    // No wide node costs less than this.
    if whole <= area * NODE_COST + of_left[WIDTH - 1] + of_right[WIDTH - 1] {
        return leaf;
    }
    let infinity = f32x8::splat(simd, f32::INFINITY);
    let right = f32x8::from_slice(simd, &of_right);
    let (mut costs, mut lanes) = (infinity, u32x8::from_slice(simd, &TO_LEFT[0]));
    // So many lanes to the left child, the others to the right one.
    macro_rules! share {
        ($($left:literal),*) => {$({
            let cost = infinity.slide::<{ WIDTH - $left }>(right) + f32x8::splat(simd, of_left[$left - 1]);
            let cheaper = cost.simd_lt(costs);
            costs = cost.min(costs);
            lanes = cheaper.select(u32x8::from_slice(simd, &TO_LEFT[$left - 1]), lanes);
        })*};
    }
    share!(1, 2, 3, 4, 5, 6, 7);
    let split = area * NODE_COST + costs[WIDTH - 1];
    if whole <= split {
        return leaf;
    }
    let as_node = f32x8::splat(simd, split);
    // Eight lanes are always shared.
    let limit = as_node.max(f32x8::from_slice(simd, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, f32::INFINITY]));
    let lanes = costs.simd_gt(limit).select(u32x8::splat(simd, 0), lanes);
    costs.min(as_node).store_slice(&mut list[at]);
    node(split, lanes.reduce_sum())
}

/// One lane to the left child, whatever there is to share, in the form of [`Choice`].
const EVENLY: u32 = (1 << COUNT_SHIFT) / ((1 << BITS) - 1) - 1;

/// What [`Choice`] has for each number of lanes where one, two, up to seven go to the left child.
const TO_LEFT: [[u32; WIDTH]; WIDTH - 1] = {
    let mut table = [[0; WIDTH]; WIDTH - 1];
    let mut left = 1;
    while left < WIDTH {
        let mut lane = 1;
        while lane < WIDTH {
            table[left - 1][lane] = (left as u32) << (BITS * lane as u32);
            lane += 1;
        }
        left += 1;
    }
    table
};
