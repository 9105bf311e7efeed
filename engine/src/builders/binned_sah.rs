//! Top-down splits by the surface area heuristic over bins (Wald, *On fast Construction of SAH-based Bounding Volume
//! Hierarchies*, 2007).

use std::time::Instant;

use glam::Vec3;

use crate::aac::ClusterContainer;
use crate::builders::flatten::{Pair, flatten};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{Aabb, Triangle};
use crate::kernel::par_collect::zeros;
use crate::stage_times::StageTimes;
use crate::tree::{Node, Tree};

/// Bins along each axis; more than 16 gain little (Wald, 2007, section 3.5).
const BINS: usize = 16;
/// Subtrees up to this size are built by one thread.
const FORK_ABOVE: usize = 4096;
/// Triangles between two looks at the token.
const BATCH: usize = 1 << 16;
/// Below this depth primitives are halved without looking for a better split, which bounds the recursion.
const MAX_SPLIT_DEPTH: u32 = 96;

/// A primitive as it is moved about.
#[derive(Clone, Copy)]
struct Item<C> {
    container: C,
    middle: Vec3,
    index: u32,
}

/// A tree of single primitives.
pub fn build<C: ClusterContainer>(
    triangles: &[Triangle],
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    let start = Instant::now();
    let mut items = Vec::with_capacity(triangles.len());
    for batch in triangles.chunks(BATCH) {
        token.check()?;
        items.extend(batch.iter().zip(items.len() as u32..).map(|(triangle, index)| {
            let container = C::of_triangle(triangle);
            Item { container, middle: container.centroid(), index }
        }));
    }
    let mut slots: Vec<Pair<C>> = zeros(items.len(), token)?;
    let root = split(&mut items, &mut slots, 0, 0, token)?;
    times.stages.push(("tree", start.elapsed()));
    token.check()?;
    let start = Instant::now();
    let tree = flatten(root, &slots, |position| items[position].index, token)?;
    times.stages.push(("flatten", start.elapsed()));
    token.set_progress(1.0);
    Ok(tree)
}

/// The node over `items`, the first of which is at `offset` in the whole list.
fn split<C: ClusterContainer>(
    items: &mut [Item<C>],
    slots: &mut [Pair<C>],
    offset: usize,
    depth: u32,
    token: &CancelToken,
) -> Result<Node<C>, Cancelled> {
    if let [item] = items {
        return Ok(Node { container: item.container, first: offset as u32, count: 1 });
    }
    let middle = if depth < MAX_SPLIT_DEPTH { best_split(items, token)? } else { items.len() / 2 };
    let forks = items.len() > FORK_ABOVE;
    let (left_items, right_items) = items.split_at_mut(middle);
    let (left_slots, right_slots) = slots.split_at_mut(middle);
    let (left, right) = if forks {
        token.check()?;
        rayon::join(
            || split(left_items, left_slots, offset, depth + 1, token),
            || split(right_items, right_slots, offset + middle, depth + 1, token),
        )
    } else {
        (
            split(left_items, left_slots, offset, depth + 1, token),
            split(right_items, right_slots, offset + middle, depth + 1, token),
        )
    };
    let (left, right) = (left?, right?);
    slots[middle - 1] = [left, right];
    Ok(Node {
        container: left.container.union(&right.container),
        first: (offset + middle - 1) as u32,
        count: left.count + right.count,
    })
}

/// Reorders `items` so that the cheapest of all binned splits lies at the returned position.
fn best_split<C: ClusterContainer>(items: &mut [Item<C>], token: &CancelToken) -> Result<usize, Cancelled> {
    let mut bounds = Aabb::EMPTY;
    for batch in items.chunks(BATCH) {
        token.check()?;
        bounds = batch
            .iter()
            .fold(bounds, |all, item| Aabb { min: all.min.min(item.middle), max: all.max.max(item.middle) });
    }
    let extent = bounds.extent();
    let bins_per_unit = Vec3::select(extent.cmpgt(Vec3::ZERO), Vec3::splat(BINS as f32 * 0.9999) / extent, Vec3::ZERO);
    let bin_of = |item: &Item<C>, axis: usize| {
        (((item.middle[axis] - bounds.min[axis]) * bins_per_unit[axis]) as usize).min(BINS - 1)
    };
    let mut counts = [[0_u32; BINS]; 3];
    let mut containers = [[C::EMPTY; BINS]; 3];
    for batch in items.chunks(BATCH) {
        token.check()?;
        for item in batch {
            for axis in 0..3 {
                let bin = bin_of(item, axis);
                counts[axis][bin] += 1;
                containers[axis][bin] = containers[axis][bin].union(&item.container);
            }
        }
    }
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in (0..3).filter(|&axis| extent[axis] > 0.0) {
        // The cost of everything from each bin on, then of everything before it.
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
            let splits = count > 0 && (count as usize) < items.len();
            if splits && best.is_none_or(|best| cost < best.0) {
                best = Some((cost, axis, bin));
            }
        }
    }
    let Some((_, axis, bin)) = best else { return Ok(items.len() / 2) };
    // Unstable, but the same on each run: swaps depend on the items only.
    let mut middle = 0;
    for start in (0..items.len()).step_by(BATCH) {
        token.check()?;
        for at in start..items.len().min(start + BATCH) {
            if bin_of(&items[at], axis) < bin {
                items.swap(at, middle);
                middle += 1;
            }
        }
    }
    Ok(middle)
}
