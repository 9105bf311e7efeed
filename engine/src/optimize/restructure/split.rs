//! Binned splits by the surface area heuristic (Wald, *On fast Construction of SAH-based Bounding Volume Hierarchies*,
//! 2007): items are counted in bins along each axis and split between two bins.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "several arrays are indexed by the same bin or axis")]

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, SimdInt, SimdSplit, f32x4, f32x8, i32x4};

use crate::optimize::restructure::item::{Item, half_areas};

/// Number of bins along each axis for many items: 32 gain a thousandth.
pub const BINS: usize = 16;
/// Number of bins for few items, where evaluating bins takes longer than filling them: more gain a thousandth.
const FEW_ITEMS_BINS: usize = 8;
/// Maximum number of items that count as few.
const MAX_FEW_ITEMS: usize = 64;
/// Number of items that are binned at a time.
const BATCH: usize = 16;
/// Depth from which on items are halved without searching for a split, which bounds the depth.
pub const MAX_SPLIT_DEPTH: u32 = 96;

/// Partitions `items`, whose box is that of `root`, left side first. Returns the length of the left side and the boxes
/// of both sides, without `first`.
#[inline(always)]
pub fn split<S: Simd>(simd: S, items: &mut [Item], root: &Item, depth: u32) -> (usize, [Item; 2]) {
    if depth >= MAX_SPLIT_DEPTH {
        return halve(simd, items);
    }
    if items.len() > MAX_FEW_ITEMS {
        // The centres of many items nearly fill their box.
        let (min, neg_max) = root.bounds(simd).split();
        let split = binned::<S, BINS>(simd, items, [min + min, -(neg_max + neg_max)]);
        if let Some(split) = split {
            return split;
        }
    }
    let mut centres = [f32x4::splat(simd, f32::INFINITY), f32x4::splat(simd, f32::NEG_INFINITY)];
    for item in &*items {
        let centre = item.doubled_centre(simd);
        centres = [centres[0].min(centre), centres[1].max(centre)];
    }
    let split = if items.len() > MAX_FEW_ITEMS {
        binned::<S, BINS>(simd, items, centres)
    } else {
        binned::<S, FEW_ITEMS_BINS>(simd, items, centres)
    };
    match split {
        Some(split) => split,
        None => halve(simd, items),
    }
}

/// The best split between bins over a `range` of doubled centres; `None` if all items are in one bin.
#[inline(always)]
fn binned<S: Simd, const N: usize>(simd: S, items: &mut [Item], range: [f32x4<S>; 2]) -> Option<(usize, [Item; 2])> {
    let grid = Grid::new::<S, N>(simd, range);
    let (boxes, counts) = count_in_bins::<S, N>(simd, items, &grid);
    let (plane, sides) = cheapest_plane(simd, &boxes, &counts, &grid)?;
    Some((plane.partition(items), sides))
}

/// Positions of the bins.
#[derive(Debug, Clone, Copy)]
pub struct Grid {
    start: [f32; 4],
    bins_per_unit: [f32; 4],
}

impl Grid {
    /// `N` bins along each axis between the corners `min` and `max` of a box around doubled centres.
    #[inline(always)]
    pub fn new<S: Simd, const N: usize>(_: S, [min, max]: [f32x4<S>; 2]) -> Self {
        let (mut start, mut bins_per_unit) = ([0.0; 4], [0.0; 4]);
        min.store_slice(&mut start);
        (max - min).store_slice(&mut bins_per_unit);
        for extent in &mut bins_per_unit {
            // Slightly less than the number of bins, so that rounding cannot exceed the last bin.
            let quotient = N as f32 * 0.9999 / *extent;
            *extent = if quotient.is_finite() { quotient } else { 0.0 };
        }
        Self { start, bins_per_unit }
    }
}

/// A plane between two bins.
#[derive(Debug, Clone, Copy)]
pub struct SplitPlane {
    axis: usize,
    /// The first bin of the right side.
    bin: usize,
    start: f32,
    bins_per_unit: f32,
}

impl SplitPlane {
    /// Partitions `items`, left side first. Returns the length of the left side.
    #[inline(always)]
    pub fn partition(&self, items: &mut [Item]) -> usize {
        let mut left = 0;
        for index in 0..items.len() {
            let is_left = self.is_left(&items[index]);
            // Without a branch: an item of the left side is swapped with the first of the right side or with itself.
            items.swap(left, index);
            left += usize::from(is_left);
        }
        left
    }

    /// On which side `item` was counted: the same arithmetic as in [`count_in_bins`].
    #[inline(always)]
    fn is_left(&self, item: &Item) -> bool {
        (item.doubled_centre_along(self.axis) - self.start) * self.bins_per_unit < self.bin as f32
    }
}

/// For each bin and axis the box of its items.
pub type BinBoxes<S, const N: usize> = [[f32x8<S>; 3]; N];
/// For each bin and axis its number of primitives; the last element is always 0.
pub type BinCounts<const N: usize> = [[i32; 4]; N];

/// Counts `items` in the `N` bins of `grid` along each axis.
#[inline(always)]
pub fn count_in_bins<S: Simd, const N: usize>(simd: S, items: &[Item], grid: &Grid) -> (BinBoxes<S, N>, BinCounts<N>) {
    let start = f32x4::from_slice(simd, &grid.start);
    let bins_per_unit = f32x4::from_slice(simd, &grid.bins_per_unit);
    let mut boxes = [[f32x8::splat(simd, f32::INFINITY); 3]; N];
    let mut counts = [[0; 4]; N];
    let mut bins = [[0; 4]; BATCH];
    // First the bins of a batch: with known addresses the stores need not wait.
    for batch in items.chunks(BATCH) {
        for (bins, item) in bins.iter_mut().zip(batch) {
            let bin: i32x4<S> = ((item.doubled_centre(simd) - start) * bins_per_unit).to_int();
            bin.store_slice(bins);
        }
        for (bins, item) in bins.iter().zip(batch) {
            let bounds = item.bounds(simd);
            for axis in 0..3 {
                let bin = bins[axis] as usize % N;
                boxes[bin][axis] = boxes[bin][axis].min(bounds);
                counts[bin][axis] += item.count as i32;
            }
        }
    }
    (boxes, counts)
}

/// The plane of least cost, with the boxes of both sides; `None` if all items are in one bin.
#[inline(always)]
pub fn cheapest_plane<S: Simd, const N: usize>(
    simd: S,
    boxes: &BinBoxes<S, N>,
    counts: &BinCounts<N>,
    grid: &Grid,
) -> Option<(SplitPlane, [Item; 2])> {
    let empty = f32x8::splat(simd, f32::INFINITY);
    let bin_counts = |bin: usize| i32x4::from_slice(simd, &counts[bin]);
    // Costs of all bins from each one on, then of all bins before it, one axis per lane. An empty side costs NaN, which
    // is never less.
    let mut right_costs = [f32x4::splat(simd, 0.0); N];
    let (mut bounds, mut count) = ([empty; 3], i32x4::splat(simd, 0));
    for bin in (1..N).rev() {
        for axis in 0..3 {
            bounds[axis] = bounds[axis].min(boxes[bin][axis]);
        }
        count += bin_counts(bin);
        right_costs[bin] = half_areas(simd, &bounds) * count.to_float::<f32x4<S>>();
    }
    let (mut best_cost, mut best_bin) = (f32x4::splat(simd, f32::INFINITY), i32x4::splat(simd, 0));
    let mut best_left_count = best_bin;
    (bounds, count) = ([empty; 3], i32x4::splat(simd, 0));
    for bin in 1..N {
        for axis in 0..3 {
            bounds[axis] = bounds[axis].min(boxes[bin - 1][axis]);
        }
        count += bin_counts(bin - 1);
        let cost = half_areas(simd, &bounds) * count.to_float::<f32x4<S>>() + right_costs[bin];
        let is_less = cost.simd_lt(best_cost);
        best_cost = is_less.select(cost, best_cost);
        best_bin = is_less.select(i32x4::splat(simd, bin as i32), best_bin);
        best_left_count = is_less.select(count, best_left_count);
    }
    let (mut costs, mut bins) = ([0.0; 4], [0; 4]);
    best_cost.store_slice(&mut costs);
    best_bin.store_slice(&mut bins);
    let mut best = (f32::INFINITY, 0, 0);
    for axis in 0..3 {
        let (cost, bin) = (costs[axis], bins[axis]);
        if cost < best.0 || (cost == best.0 && bin < best.1) {
            best = (cost, bin, axis);
        }
    }
    let (cost, split_bin, axis) = best;
    if cost == f32::INFINITY {
        return None;
    }
    let split_bin = split_bin as usize;
    // Repeated boxes change nothing, and loops of constant length are predicted.
    let (mut left, mut right) = (boxes[0][axis], boxes[N - 1][axis]);
    for bin in 1..N {
        left = left.min(boxes[bin.min(split_bin - 1)][axis]);
        right = right.min(boxes[(N - 1 - bin).max(split_bin)][axis]);
    }
    let (mut left_counts, mut all) = ([0; 4], [0; 4]);
    best_left_count.store_slice(&mut left_counts);
    (count + bin_counts(N - 1)).store_slice(&mut all);
    let [left_count, all] = [left_counts[axis] as u32, all[axis] as u32];
    let sides = [Item::from_bounds(left, left_count, 0), Item::from_bounds(right, all - left_count, 0)];
    Some((SplitPlane { axis, bin: split_bin, start: grid.start[axis], bins_per_unit: grid.bins_per_unit[axis] }, sides))
}

/// Splits `items` into halves in their present order.
#[inline(always)]
fn halve<S: Simd>(simd: S, items: &[Item]) -> (usize, [Item; 2]) {
    let (left, right) = items.split_at(items.len() / 2);
    (left.len(), [bounds_of(simd, left), bounds_of(simd, right)])
}

/// The box around `items`, without `first`.
#[inline(always)]
fn bounds_of<S: Simd>(simd: S, items: &[Item]) -> Item {
    let (mut bounds, mut count) = (f32x8::splat(simd, f32::INFINITY), 0);
    for item in items {
        (bounds, count) = (bounds.min(item.bounds(simd)), count + item.count);
    }
    Item::from_bounds(bounds, count, 0)
}
