//! The cheapest of some splits by the surface area heuristic (Wald, *On fast Construction of SAH-based Bounding Volume
//! Hierarchies*, 2007): items are counted in bins along each axis, and split between two of them.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "several arrays are indexed by the same bin or axis")]

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, SimdInt, SimdSplit, f32x4, f32x8, i32x4};

use crate::optimize::restructure::item::{Item, half_areas};

/// Bins along each axis for many items: 32 gain a thousandth.
pub const BINS: usize = 16;
/// Bins for few, where looking at them takes longer than at the items: more gain a thousandth.
const FEW_BINS: usize = 8;
/// Up to this many items are few.
const FEW: usize = 64;
/// Items that are counted at a time.
const BLOCK: usize = 16;
/// Below this depth items are halved without looking for a better split, which bounds the depth.
pub const MAX_SPLIT_DEPTH: u32 = 96;

/// Reorders `items`, whose box `whole` is, the left side first. Returns its length and the boxes of both sides without links.
#[inline(always)]
pub fn split<S: Simd>(simd: S, items: &mut [Item], whole: &Item, depth: u32) -> (usize, [Item; 2]) {
    if depth >= MAX_SPLIT_DEPTH {
        return halve(simd, items);
    }
    if items.len() > FEW {
        // The middles of many fill nearly all of their box.
        let (min, neg_max) = whole.bounds(simd).split();
        let split = binned::<S, BINS>(simd, items, [min + min, -(neg_max + neg_max)]);
        if let Some(split) = split {
            return split;
        }
    }
    let mut middles = [f32x4::splat(simd, f32::INFINITY), f32x4::splat(simd, f32::NEG_INFINITY)];
    for item in &*items {
        let middle = item.middle(simd);
        middles = [middles[0].min(middle), middles[1].max(middle)];
    }
    let split = if items.len() > FEW {
        binned::<S, BINS>(simd, items, middles)
    } else {
        binned::<S, FEW_BINS>(simd, items, middles)
    };
    match split {
        Some(split) => split,
        None => halve(simd, items),
    }
}

/// The best split between bins over the range of middles `least` to `most`; `None` where all are in one.
#[inline(always)]
fn binned<S: Simd, const N: usize>(simd: S, items: &mut [Item], range: [f32x4<S>; 2]) -> Option<(usize, [Item; 2])> {
    let grid = Grid::new::<S, N>(simd, range);
    let (boxes, counts) = count_in_bins::<S, N>(simd, items, &grid);
    let (cut, sides) = cheapest_cut(simd, &boxes, &counts, &grid)?;
    Some((cut.divide(items), sides))
}

/// Where bins lie.
#[derive(Debug, Clone, Copy)]
pub struct Grid {
    start: [f32; 4],
    bins_per_unit: [f32; 4],
}

impl Grid {
    /// `N` bins along each axis between the two corners of a box of middles.
    #[inline(always)]
    pub fn new<S: Simd, const N: usize>(_: S, [least, most]: [f32x4<S>; 2]) -> Self {
        let (mut start, mut bins_per_unit) = ([0.0; 4], [0.0; 4]);
        least.store_slice(&mut start);
        (most - least).store_slice(&mut bins_per_unit);
        for extent in &mut bins_per_unit {
            // A little less than the number of bins, so that rounding does not lead beyond the last.
            let quotient = N as f32 * 0.9999 / *extent;
            *extent = if quotient.is_finite() { quotient } else { 0.0 };
        }
        Self { start, bins_per_unit }
    }
}

/// Where items are divided.
#[derive(Debug, Clone, Copy)]
pub struct Cut {
    axis: usize,
    /// The first bin of the right side.
    bin: usize,
    start: f32,
    bins_per_unit: f32,
}

impl Cut {
    /// Reorders `items`, those on the left side first. Returns how many these are.
    #[inline(always)]
    pub fn divide(&self, items: &mut [Item]) -> usize {
        let mut left = 0;
        for at in 0..items.len() {
            let is_left = self.is_left(&items[at]);
            // Without a branch: an item of the right side changes places with another one, or itself.
            items.swap(left, at);
            left += usize::from(is_left);
        }
        left
    }

    /// On which side of the cut `item` was counted: the same arithmetic as in [`count_in_bins`].
    #[inline(always)]
    fn is_left(&self, item: &Item) -> bool {
        (item.middle_along(self.axis) - self.start) * self.bins_per_unit < self.bin as f32
    }
}

/// For each bin and axis the box of its items.
pub type Boxes<S, const N: usize> = [[f32x8<S>; 3]; N];
/// For each bin and axis its primitives; the last is always 0.
pub type Counts<const N: usize> = [[i32; 4]; N];

/// What is in the bins of a grid of `N`.
#[inline(always)]
pub fn count_in_bins<S: Simd, const N: usize>(simd: S, items: &[Item], grid: &Grid) -> (Boxes<S, N>, Counts<N>) {
    let start = f32x4::from_slice(simd, &grid.start);
    let bins_per_unit = f32x4::from_slice(simd, &grid.bins_per_unit);
    let mut boxes = [[f32x8::splat(simd, f32::INFINITY); 3]; N];
    let mut counts = [[0; 4]; N];
    let mut bins = [[0; 4]; BLOCK];
    // The bins of some items first: where they are known early, what is written does not wait.
    for block in items.chunks(BLOCK) {
        for (bins, item) in bins.iter_mut().zip(block) {
            let at: i32x4<S> = ((item.middle(simd) - start) * bins_per_unit).to_int();
            at.store_slice(bins);
        }
        for (bins, item) in bins.iter().zip(block) {
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

/// The cheapest cut between bins, with boxes of both sides; `None` where all items are in one bin.
#[inline(always)]
pub fn cheapest_cut<S: Simd, const N: usize>(
    simd: S,
    boxes: &Boxes<S, N>,
    counts: &Counts<N>,
    grid: &Grid,
) -> Option<(Cut, [Item; 2])> {
    let nothing = f32x8::splat(simd, f32::INFINITY);
    let primitives_in = |bin: usize| i32x4::from_slice(simd, &counts[bin]);
    // The costs of everything from each bin on, then of everything before it, with an axis in each lane. Of nothing they are no
    // numbers, as are sums with them, and never less than others.
    let mut right_costs = [f32x4::splat(simd, 0.0); N];
    let (mut bounds, mut count) = ([nothing; 3], i32x4::splat(simd, 0));
    for bin in (1..N).rev() {
        for axis in 0..3 {
            bounds[axis] = bounds[axis].min(boxes[bin][axis]);
        }
        count += primitives_in(bin);
        right_costs[bin] = half_areas(simd, &bounds) * count.to_float::<f32x4<S>>();
    }
    let (mut least, mut first) = (f32x4::splat(simd, f32::INFINITY), i32x4::splat(simd, 0));
    let mut before = first;
    (bounds, count) = ([nothing; 3], i32x4::splat(simd, 0));
    for bin in 1..N {
        for axis in 0..3 {
            bounds[axis] = bounds[axis].min(boxes[bin - 1][axis]);
        }
        count += primitives_in(bin - 1);
        let cost = half_areas(simd, &bounds) * count.to_float::<f32x4<S>>() + right_costs[bin];
        let is_less = cost.simd_lt(least);
        least = is_less.select(cost, least);
        first = is_less.select(i32x4::splat(simd, bin as i32), first);
        before = is_less.select(count, before);
    }
    let (mut costs, mut bins) = ([0.0; 4], [0; 4]);
    least.store_slice(&mut costs);
    first.store_slice(&mut bins);
    let mut best = (f32::INFINITY, 0, 0);
    for axis in 0..3 {
        let (cost, bin) = (costs[axis], bins[axis]);
        if cost < best.0 || (cost == best.0 && bin < best.1) {
            best = (cost, bin, axis);
        }
    }
    let (cost, cut, axis) = best;
    if cost == f32::INFINITY {
        return None;
    }
    let cut = cut as usize;
    // A box twice changes nothing, and loops that always take as many turns are predicted.
    let (mut left, mut right) = (boxes[0][axis], boxes[N - 1][axis]);
    for bin in 1..N {
        left = left.min(boxes[bin.min(cut - 1)][axis]);
        right = right.min(boxes[(N - 1 - bin).max(cut)][axis]);
    }
    let (mut left_counts, mut all) = ([0; 4], [0; 4]);
    before.store_slice(&mut left_counts);
    (count + primitives_in(N - 1)).store_slice(&mut all);
    let [left_count, all] = [left_counts[axis] as u32, all[axis] as u32];
    let sides = [Item::of(left, left_count, 0), Item::of(right, all - left_count, 0)];
    Some((Cut { axis, bin: cut, start: grid.start[axis], bins_per_unit: grid.bins_per_unit[axis] }, sides))
}

/// Both halves as they are.
#[inline(always)]
fn halve<S: Simd>(simd: S, items: &[Item]) -> (usize, [Item; 2]) {
    let (left, right) = items.split_at(items.len() / 2);
    (left.len(), [around(simd, left), around(simd, right)])
}

/// The box around `items`, without a link.
#[inline(always)]
fn around<S: Simd>(simd: S, items: &[Item]) -> Item {
    let (mut bounds, mut count) = (f32x8::splat(simd, f32::INFINITY), 0);
    for item in items {
        (bounds, count) = (bounds.min(item.bounds(simd)), count + item.count);
    }
    Item::of(bounds, count, 0)
}
