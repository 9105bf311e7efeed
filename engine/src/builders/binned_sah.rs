//! Top-down construction with binned splits by the surface area heuristic (Wald, *On fast Construction of SAH-based
//! Bounding Volume Hierarchies*, 2007).

use glam::Vec3;

use crate::aac::ClusterContainer;
use crate::builders::flatten::{ChildPair, finish, pair_node};
use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use crate::geometry::{Aabb, Triangle};
use crate::kernel::parallel::zeros;
use crate::stage_times::{Stage, StageTimes};
use crate::tree::{Node, Tree};

/// Number of bins along each axis; more than 16 gain little (Wald, 2007, section 3.5).
const BINS: usize = 16;
/// Maximum number of primitives that are built by one thread.
const FORK_ABOVE: usize = 4096;
/// Depth from which on primitives are halved without searching for a split, which bounds the recursion.
const MAX_SPLIT_DEPTH: u32 = 96;

/// A triangle during construction.
#[derive(Clone, Copy)]
pub(crate) struct BuildPrimitive<C> {
    pub(crate) container: C,
    /// Centre of the container.
    pub(crate) centre: Vec3,
    /// Index in the input.
    pub(crate) index: u32,
}

/// Builds a tree with one triangle per leaf.
pub fn build<C: ClusterContainer>(
    triangles: &[Triangle],
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    let stage = Stage::begin("tree", token);
    let mut primitives = Vec::with_capacity(triangles.len());
    for batch in triangles.chunks(LIGHT_STEPS) {
        token.check()?;
        primitives.extend(batch.iter().zip(primitives.len() as u32..).map(|(triangle, index)| {
            let container = C::of_triangle(triangle);
            BuildPrimitive { container, centre: container.centroid(), index }
        }));
    }
    let mut slots: Vec<ChildPair<C>> = zeros(primitives.len(), token)?;
    let root = split(&mut primitives, &mut slots, 0, 0, token)?;
    finish(root, &slots, |position| primitives[position].index, stage, token, times)
}

/// Builds the node over `primitives`, the first of which has index `offset` in the whole list.
fn split<C: ClusterContainer>(
    primitives: &mut [BuildPrimitive<C>],
    slots: &mut [ChildPair<C>],
    offset: usize,
    depth: u32,
    token: &CancelToken,
) -> Result<Node<C>, Cancelled> {
    if let [primitive] = primitives {
        return Ok(Node { container: primitive.container, first: offset as u32, count: 1 });
    }
    let middle = if depth < MAX_SPLIT_DEPTH { best_split(primitives, token)? } else { primitives.len() / 2 };
    let forks = primitives.len() > FORK_ABOVE;
    let (left_primitives, right_primitives) = primitives.split_at_mut(middle);
    let (left_slots, right_slots) = slots.split_at_mut(middle);
    let children = token.both(
        forks,
        |token| split(left_primitives, left_slots, offset, depth + 1, token),
        |token| split(right_primitives, right_slots, offset + middle, depth + 1, token),
    )?;
    Ok(pair_node(slots, offset, middle, children))
}

/// Partitions `primitives` by the cheapest binned split and returns the size of the left side.
pub(crate) fn best_split<C: ClusterContainer>(
    primitives: &mut [BuildPrimitive<C>],
    token: &CancelToken,
) -> Result<usize, Cancelled> {
    let mut bounds = Aabb::EMPTY;
    for batch in primitives.chunks(LIGHT_STEPS) {
        token.check()?;
        bounds = batch.iter().fold(bounds, |all, primitive| Aabb {
            min: all.min.min(primitive.centre),
            max: all.max.max(primitive.centre),
        });
    }
    let extent = bounds.extent();
    let bins_per_unit = Vec3::select(extent.cmpgt(Vec3::ZERO), Vec3::splat(BINS as f32 * 0.9999) / extent, Vec3::ZERO);
    let bin_of = |primitive: &BuildPrimitive<C>, axis: usize| {
        (((primitive.centre[axis] - bounds.min[axis]) * bins_per_unit[axis]) as usize).min(BINS - 1)
    };
    let mut counts = [[0_u32; BINS]; 3];
    let mut containers = [[C::EMPTY; BINS]; 3];
    for batch in primitives.chunks(LIGHT_STEPS) {
        token.check()?;
        for primitive in batch {
            for axis in 0..3 {
                let bin = bin_of(primitive, axis);
                counts[axis][bin] += 1;
                containers[axis][bin] = containers[axis][bin].union(&primitive.container);
            }
        }
    }
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in (0..3).filter(|&axis| extent[axis] > 0.0) {
        // Costs of all bins from each one on, then of all bins before it.
        let mut right_costs = [0.0; BINS];
        let (mut container, mut count) = (C::EMPTY, 0);
        for bin in (1..BINS).rev() {
            container = container.union(&containers[axis][bin]);
            count += counts[axis][bin];
            right_costs[bin] = container.relative_area() * count as f32;
        }
        (container, count) = (C::EMPTY, 0);
        for bin in 1..BINS {
            container = container.union(&containers[axis][bin - 1]);
            count += counts[axis][bin - 1];
            let cost = container.relative_area() * count as f32 + right_costs[bin];
            let splits = count > 0 && (count as usize) < primitives.len();
            if splits && best.is_none_or(|best| cost < best.0) {
                best = Some((cost, axis, bin));
            }
        }
    }
    let Some((_, axis, bin)) = best else { return Ok(primitives.len() / 2) };
    // Unstable but deterministic: the swaps depend on the primitives only.
    let mut middle = 0;
    for start in (0..primitives.len()).step_by(LIGHT_STEPS) {
        token.check()?;
        for at in start..primitives.len().min(start + LIGHT_STEPS) {
            if bin_of(&primitives[at], axis) < bin {
                primitives.swap(at, middle);
                middle += 1;
            }
        }
    }
    Ok(middle)
}
