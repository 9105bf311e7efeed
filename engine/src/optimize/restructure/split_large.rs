//! [`split`] for many items, in parallel: each task bins and partitions a chunk.

use std::ops::Range;

use fearless_simd::{Level, Simd, SimdBase, SimdSplit, f32x8};

use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::parallel::par_tasks;
use crate::kernel::simd::dispatch_plain;
use crate::optimize::restructure::item::Item;
use crate::optimize::restructure::split::{BINS, BinCounts, Grid, SplitPlane, cheapest_plane, count_in_bins, split};

/// Number of items from which on several threads pay.
pub const MIN_LARGE: usize = 1 << 14;
/// Number of items in a chunk.
const CHUNK_ITEMS: usize = 1 << 12;

/// Bins of a chunk.
struct ChunkBins {
    boxes: [[[f32; 8]; 3]; BINS],
    counts: BinCounts<BINS>,
}

/// [`split`], but with another order of items on each side. The same for any number of threads.
pub fn split_large(
    level: Level,
    items: &mut [Item],
    root: &Item,
    depth: u32,
    token: &CancelToken,
) -> Result<(usize, [Item; 2]), Cancelled> {
    let grid = dispatch_plain!(level, simd => {
        let (min, neg_max) = root.bounds(simd).split();
        Grid::new::<_, BINS>(simd, [min + min, -(neg_max + neg_max)])
    });
    let chunks = par_tasks(items.chunks(CHUNK_ITEMS), token, |items, _| {
        Ok(dispatch_plain!(level, simd => count_chunk(simd, items, &grid)))
    })?;
    let Some((plane, sides)) = dispatch_plain!(level, simd => cheapest_plane_of_chunks(simd, &chunks, &grid)) else {
        return Ok(dispatch_plain!(level, simd => split(simd, items, root, depth)));
    };
    Ok((partition(&plane, items, token)?, sides))
}

/// Partitions each chunk by itself, then swaps the items on the wrong side of the middle.
fn partition(plane: &SplitPlane, items: &mut [Item], token: &CancelToken) -> Result<usize, Cancelled> {
    let left_counts = par_tasks(items.chunks_mut(CHUNK_ITEMS), token, |items, _| Ok(plane.partition(items)))?;
    let middle = left_counts.iter().sum();
    let chunks = left_counts.iter().zip((0..items.len()).step_by(CHUNK_ITEMS));
    let left_in_right = chunks.clone().map(|(&left, start)| start.max(middle)..(start + left).max(middle));
    let right_in_left = chunks.map(|(&left, start)| (start + left).min(middle)..(start + CHUNK_ITEMS).min(middle));
    let (left_items, right_items) = items.split_at_mut(middle);
    let mut misplaced = [subslices(left_items, 0, right_in_left), subslices(right_items, middle, left_in_right)];
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
    par_tasks(swaps, token, |(first, second), _| {
        first.swap_with_slice(second);
        Ok(())
    })?;
    Ok(middle)
}

/// The subslices of `items` for the non-empty `ranges`, which are ascending and relative to `offset` before `items`.
fn subslices(
    mut items: &mut [Item],
    mut offset: usize,
    ranges: impl Iterator<Item = Range<usize>>,
) -> Vec<&mut [Item]> {
    let mut subslices = Vec::new();
    for range in ranges.filter(|range| !range.is_empty()) {
        let (_, rest) = items.split_at_mut(range.start - offset);
        let (subslice, rest) = rest.split_at_mut(range.len());
        subslices.push(subslice);
        (items, offset) = (rest, range.end);
    }
    subslices
}

/// Bins of the `items` of a chunk.
#[inline(always)]
fn count_chunk<S: Simd>(simd: S, items: &[Item], grid: &Grid) -> ChunkBins {
    let (boxes, counts) = count_in_bins::<S, BINS>(simd, items, grid);
    let mut chunk = ChunkBins { boxes: [[[0.0; 8]; 3]; BINS], counts };
    for (to, from) in chunk.boxes.as_flattened_mut().iter_mut().zip(boxes.as_flattened()) {
        from.store_slice(to);
    }
    chunk
}

/// [`cheapest_plane`] for the bins of all chunks together.
#[inline(always)]
fn cheapest_plane_of_chunks<S: Simd>(simd: S, chunks: &[ChunkBins], grid: &Grid) -> Option<(SplitPlane, [Item; 2])> {
    let (mut boxes, mut counts) = count_in_bins::<S, BINS>(simd, &[], grid);
    for chunk in chunks {
        for (sum, part) in boxes.as_flattened_mut().iter_mut().zip(chunk.boxes.as_flattened()) {
            *sum = sum.min(f32x8::from_slice(simd, part));
        }
        for (sum, part) in counts.as_flattened_mut().iter_mut().zip(chunk.counts.as_flattened()) {
            *sum += part;
        }
    }
    cheapest_plane(simd, &boxes, &counts, grid)
}
