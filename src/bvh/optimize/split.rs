//! The cheapest of some splits by the surface area heuristic (Wald, *On fast Construction of SAH-based Bounding Volume
//! Hierarchies*, 2007): items are counted in bins along each axis, and split between two of them.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "several arrays are indexed by the same bin or axis")]

use fearless_simd::{Simd, SimdBase, SimdFloat, SimdSplit, f32x4, f32x8, i32x4};

use super::item::{Item, half_area};

/// Bins along each axis for many items: 32 gain a thousandth.
pub const BINS: usize = 16;
/// Bins for few, where looking at them takes longer than at the items: more gain a thousandth.
const FEW_BINS: usize = 8;
/// Up to this many items are few.
const FEW: usize = 64;
/// Below this depth items are halved without looking for a better split, which bounds the depth.
pub const MAX_SPLIT_DEPTH: u32 = 96;

/// Moves `from`, whose box `whole` is, to `to`, which is as long, the left side to its start and the right one to its end.
/// Returns the length of the left side and boxes of both without links.
#[inline(always)]
pub fn split<S: Simd>(simd: S, from: &[Item], to: &mut [Item], whole: &Item, depth: u32) -> (usize, [Item; 2]) {
    if depth >= MAX_SPLIT_DEPTH {
        return halve(simd, from, to);
    }
    if from.len() > FEW {
        // The middles of many fill nearly all of their box.
        let (min, neg_max) = whole.bounds(simd).split();
        let split = binned::<S, BINS>(simd, from, to, [min + min, -(neg_max + neg_max)]);
        if let Some(split) = split {
            return split;
        }
    }
    let mut middles = [f32x4::splat(simd, f32::INFINITY), f32x4::splat(simd, f32::NEG_INFINITY)];
    for item in from {
        let middle = item.middle(simd);
        middles = [middles[0].min(middle), middles[1].max(middle)];
    }
    let split = if from.len() > FEW {
        binned::<S, BINS>(simd, from, to, middles)
    } else {
        binned::<S, FEW_BINS>(simd, from, to, middles)
    };
    match split {
        Some(split) => split,
        None => halve(simd, from, to),
    }
}

/// The best split between bins over the range of middles `least` to `most`; `None` where all are in one.
#[inline(always)]
fn binned<S: Simd, const N: usize>(
    simd: S,
    from: &[Item],
    to: &mut [Item],
    range: [f32x4<S>; 2],
) -> Option<(usize, [Item; 2])> {
    let grid = Grid::new::<S, N>(simd, range);
    let (boxes, counts) = count_in_bins::<S, N>(simd, from, &grid);
    let (cut, sides) = cheapest_cut(simd, &boxes, &counts, &grid)?;
    let (mut left, mut right) = (0, from.len());
    for item in from {
        let is_left = cut.is_left(item);
        // Written to both ends: the wrong one is overwritten.
        to[left] = *item;
        to[right - 1] = *item;
        left += usize::from(is_left);
        right -= usize::from(!is_left);
    }
    Some((left, sides))
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
    /// On which side of the cut `item` was counted: the same arithmetic as in [`count_in_bins`].
    #[inline(always)]
    pub fn is_left(&self, item: &Item) -> bool {
        (item.middle_along(self.axis) - self.start) * self.bins_per_unit < self.bin as f32
    }

    /// How many items there are on the left side of those counted.
    pub fn left_of<const N: usize>(&self, counts: &Counts<N>) -> usize {
        counts[..self.bin].iter().map(|count| (count[self.axis] >> 32) as usize).sum()
    }
}

/// For each bin and axis the box of its items.
pub type Boxes<S, const N: usize> = [[f32x8<S>; 3]; N];
/// For each bin and axis its primitives, and its items in the upper half.
pub type Counts<const N: usize> = [[u64; 3]; N];

/// What is in the bins of a grid of `N`.
#[inline(always)]
pub fn count_in_bins<S: Simd, const N: usize>(simd: S, items: &[Item], grid: &Grid) -> (Boxes<S, N>, Counts<N>) {
    let start = f32x4::from_slice(simd, &grid.start);
    let bins_per_unit = f32x4::from_slice(simd, &grid.bins_per_unit);
    let mut boxes = [[f32x8::splat(simd, f32::INFINITY); 3]; N];
    let mut counts = [[0_u64; 3]; N];
    for item in items {
        let mut bins = [0; 4];
        let at: i32x4<S> = ((item.middle(simd) - start) * bins_per_unit).to_int();
        at.store_slice(&mut bins);
        let bounds = item.bounds(simd);
        let count = u64::from(item.count) | 1 << 32;
        for axis in 0..3 {
            let bin = bins[axis] as usize % N;
            boxes[bin][axis] = boxes[bin][axis].min(bounds);
            counts[bin][axis] += count;
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
    // The cost of everything from each bin on, then of everything before it; infinite where that is nothing.
    let cost =
        |bounds: f32x8<S>, count: u64| if count == 0 { f32::INFINITY } else { half_area(bounds) * count as u32 as f32 };
    let mut right_costs = [[0.0; 3]; N];
    let (mut bounds, mut count) = ([nothing; 3], [0; 3]);
    for bin in (1..N).rev() {
        for axis in 0..3 {
            bounds[axis] = bounds[axis].min(boxes[bin][axis]);
            count[axis] += counts[bin][axis];
            right_costs[bin][axis] = cost(bounds[axis], count[axis]);
        }
    }
    let mut best = (f32::INFINITY, 0, 0);
    (bounds, count) = ([nothing; 3], [0; 3]);
    for bin in 1..N {
        for axis in 0..3 {
            bounds[axis] = bounds[axis].min(boxes[bin - 1][axis]);
            count[axis] += counts[bin - 1][axis];
            let cost = cost(bounds[axis], count[axis]) + right_costs[bin][axis];
            if cost < best.0 {
                best = (cost, axis, bin);
            }
        }
    }
    let (cost, axis, cut) = best;
    if cost == f32::INFINITY {
        return None;
    }
    let side = |bins: std::ops::Range<usize>| {
        let (mut bounds, mut count) = (nothing, 0);
        for bin in bins {
            bounds = bounds.min(boxes[bin][axis]);
            count += counts[bin][axis];
        }
        Item::of(bounds, count as u32, 0)
    };
    let sides = [side(0..cut), side(cut..N)];
    Some((Cut { axis, bin: cut, start: grid.start[axis], bins_per_unit: grid.bins_per_unit[axis] }, sides))
}

/// Both halves as they are.
#[inline(always)]
fn halve<S: Simd>(simd: S, from: &[Item], to: &mut [Item]) -> (usize, [Item; 2]) {
    to.copy_from_slice(from);
    let middle = from.len() / 2;
    let side = |items: &[Item]| {
        let (mut bounds, mut count) = (f32x8::splat(simd, f32::INFINITY), 0);
        for item in items {
            (bounds, count) = (bounds.min(item.bounds(simd)), count + item.count);
        }
        Item::of(bounds, count, 0)
    };
    (middle, [side(&from[..middle]), side(&from[middle..])])
}
