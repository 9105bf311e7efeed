//! The cheapest of some splits by the surface area heuristic (Wald, *On fast Construction of SAH-based Bounding Volume
//! Hierarchies*, 2007): items are counted in bins along each axis, and split between two of them.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "several arrays are indexed by the same bin or axis")]

use fearless_simd::{Simd, SimdBase, SimdFloat, SimdSplit, f32x4, f32x8, i32x4};

use super::item::{Item, half_area};

/// Bins along each axis for many items: 32 gain a thousandth.
const BINS: usize = 16;
/// Bins for few, where looking at them takes longer than at the items: more gain a thousandth.
const FEW_BINS: usize = 8;
/// Up to this many items are few.
const FEW: usize = 64;
/// Below this depth items are halved without looking for a better split, which bounds the depth.
const MAX_SPLIT_DEPTH: u32 = 96;

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
    [least, most]: [f32x4<S>; 2],
) -> Option<(usize, [Item; 2])> {
    let (mut start, mut scale) = ([0.0; 4], [0.0; 4]);
    least.store_slice(&mut start);
    (most - least).store_slice(&mut scale);
    for extent in &mut scale {
        // A little less than the number of bins, so that rounding does not lead beyond the last.
        let bins_per_unit = N as f32 * 0.9999 / *extent;
        *extent = if bins_per_unit.is_finite() { bins_per_unit } else { 0.0 };
    }
    let bins_per_unit = f32x4::from_slice(simd, &scale);

    let nothing = f32x8::splat(simd, f32::INFINITY);
    let mut boxes = [[nothing; 3]; N];
    // Primitives, and items in the upper half.
    let mut counts = [[0_u64; 3]; N];
    for item in from {
        let mut bins = [0; 4];
        let at: i32x4<S> = ((item.middle(simd) - least) * bins_per_unit).to_int();
        at.store_slice(&mut bins);
        let bounds = item.bounds(simd);
        let count = u64::from(item.count) | 1 << 32;
        for axis in 0..3 {
            let bin = bins[axis] as usize % N;
            boxes[bin][axis] = boxes[bin][axis].min(bounds);
            counts[bin][axis] += count;
        }
    }

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
    // The same arithmetic as above, so that each item goes where it was counted.
    let (start, scale, cut_at) = (start[axis], scale[axis], cut as f32);
    let (mut left, mut right) = (0, from.len());
    for item in from {
        let is_left = (item.middle_along(axis) - start) * scale < cut_at;
        // Written to both ends: the wrong one is overwritten.
        to[left] = *item;
        to[right - 1] = *item;
        left += usize::from(is_left);
        right -= usize::from(!is_left);
    }
    Some((left, [side(0..cut), side(cut..N)]))
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
