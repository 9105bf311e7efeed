//! [`split`] for many items, by many threads: each counts some of them and divides those.

use std::ops::Range;

use fearless_simd::{Level, SimdBase, SimdSplit, dispatch, f32x8};
use rayon::prelude::*;

use crate::cancel::{CancelToken, Cancelled};
use crate::optimize::restructure::item::Item;
use crate::optimize::restructure::split::{BINS, Counts, Cut, Grid, cheapest_cut, count_in_bins, split};

/// From so many items on several threads are worth it.
pub const LARGE: usize = 1 << 14;
/// Items that one task counts and divides.
const CHUNK: usize = 1 << 12;

/// What a task counted.
struct Chunk {
    boxes: [[[f32; 8]; 3]; BINS],
    counts: Counts<BINS>,
}

/// As [`split`], but in another order. The same on any number of threads.
pub fn split_large(
    level: Level,
    items: &mut [Item],
    whole: &Item,
    depth: u32,
    token: &CancelToken,
) -> Result<(usize, [Item; 2]), Cancelled> {
    let grid = dispatch!(level, simd => {
        let (min, neg_max) = whole.bounds(simd).split();
        Grid::new::<_, BINS>(simd, [min + min, -(neg_max + neg_max)])
    });
    let chunks = items.par_chunks(CHUNK).map(|items| {
        token.check()?;
        Ok(dispatch!(level, simd => counted(simd, items, &grid)))
    });
    let chunks: Vec<Chunk> = chunks.collect::<Result<_, _>>()?;
    let Some((cut, sides)) = dispatch!(level, simd => cut_of(simd, &chunks, &grid)) else {
        return Ok(dispatch!(level, simd => split(simd, items, whole, depth)));
    };
    Ok((divide(&cut, items, token)?, sides))
}

/// [`Cut::divide`] of each chunk by itself; then what stands on the wrong side of the middle changes places.
fn divide(cut: &Cut, items: &mut [Item], token: &CancelToken) -> Result<usize, Cancelled> {
    let lefts = items.par_chunks_mut(CHUNK).map(|items| {
        token.check()?;
        Ok(cut.divide(items))
    });
    let lefts: Vec<usize> = lefts.collect::<Result<_, _>>()?;
    let middle = lefts.iter().sum();
    let chunks = lefts.iter().zip((0..items.len()).step_by(CHUNK));
    let of_left = chunks.clone().map(|(&left, start)| start.max(middle)..(start + left).max(middle));
    let of_right = chunks.map(|(&left, start)| (start + left).min(middle)..(start + CHUNK).min(middle));
    let (before, behind) = items.split_at_mut(middle);
    let mut misplaced = [stretches(before, 0, of_right), stretches(behind, middle, of_left)];
    let mut swaps = Vec::new();
    while let [Some(first), Some(second)] = misplaced.each_mut().map(Vec::pop) {
        let len = first.len().min(second.len());
        let (first_rest, first) = first.split_at_mut(first.len() - len);
        let (second_rest, second) = second.split_at_mut(second.len() - len);
        swaps.push((first, second));
        for (list, rest) in misplaced.iter_mut().zip([first_rest, second_rest]) {
            if !rest.is_empty() {
                list.push(rest);
            }
        }
    }
    swaps.into_par_iter().for_each(|(first, second)| first.swap_with_slice(second));
    Ok(middle)
}

/// Those of `ranges`, in order, that are not empty, of `items`, the first of which is at `offset`.
fn stretches(
    mut items: &mut [Item],
    mut offset: usize,
    ranges: impl Iterator<Item = Range<usize>>,
) -> Vec<&mut [Item]> {
    let mut stretches = Vec::new();
    for range in ranges.filter(|range| !range.is_empty()) {
        let (_, rest) = items.split_at_mut(range.start - offset);
        let (stretch, rest) = rest.split_at_mut(range.len());
        stretches.push(stretch);
        (items, offset) = (rest, range.end);
    }
    stretches
}

#[inline(always)]
fn counted<S: fearless_simd::Simd>(simd: S, items: &[Item], grid: &Grid) -> Chunk {
    let (boxes, counts) = count_in_bins::<S, BINS>(simd, items, grid);
    let mut chunk = Chunk { boxes: [[[0.0; 8]; 3]; BINS], counts };
    for (to, from) in chunk.boxes.as_flattened_mut().iter_mut().zip(boxes.as_flattened()) {
        from.store_slice(to);
    }
    chunk
}

#[inline(always)]
fn cut_of<S: fearless_simd::Simd>(simd: S, chunks: &[Chunk], grid: &Grid) -> Option<(Cut, [Item; 2])> {
    let (mut boxes, mut counts) = count_in_bins::<S, BINS>(simd, &[], grid);
    for chunk in chunks {
        for (all, one) in boxes.as_flattened_mut().iter_mut().zip(chunk.boxes.as_flattened()) {
            *all = all.min(f32x8::from_slice(simd, one));
        }
        for (all, one) in counts.as_flattened_mut().iter_mut().zip(chunk.counts.as_flattened()) {
            *all += one;
        }
    }
    cheapest_cut(simd, &boxes, &counts, grid)
}
