//! [`split`] for many items, by many threads: each counts some of them, then moves them to where the counts say.

use fearless_simd::{Level, SimdBase, SimdSplit, dispatch, f32x8};
use rayon::prelude::*;

use super::item::Item;
use super::split::{BINS, Counts, Cut, Grid, cheapest_cut, count_in_bins, split};
use crate::cancel::{CancelToken, Cancelled};

/// From so many items on several threads are worth it.
pub const LARGE: usize = 1 << 16;
/// Items that one task counts and moves.
const CHUNK: usize = 1 << 14;

/// What a task counted.
struct Chunk {
    boxes: [[[f32; 8]; 3]; BINS],
    counts: Counts<BINS>,
}

/// As [`split`], but with the right side in the order of `from`. The same on any number of threads.
pub fn split_large(
    level: Level,
    from: &[Item],
    to: &mut [Item],
    whole: &Item,
    depth: u32,
    token: &CancelToken,
) -> Result<(usize, [Item; 2]), Cancelled> {
    let grid = dispatch!(level, simd => {
        let (min, neg_max) = whole.bounds(simd).split();
        Grid::new::<_, BINS>(simd, [min + min, -(neg_max + neg_max)])
    });
    let chunks = from.par_chunks(CHUNK).map(|items| {
        token.check()?;
        Ok(dispatch!(level, simd => counted(simd, items, &grid)))
    });
    let chunks: Vec<Chunk> = chunks.collect::<Result<_, _>>()?;
    let Some((cut, sides)) = dispatch!(level, simd => cut_of(simd, &chunks, &grid)) else {
        return Ok(dispatch!(level, simd => split(simd, from, to, whole, depth)));
    };
    let left_counts = chunks.iter().map(|chunk| cut.left_of(&chunk.counts));
    let middle = left_counts.clone().sum();
    let (mut left, mut right) = to.split_at_mut(middle);
    let mut targets = Vec::with_capacity(chunks.len());
    for (items, left_count) in from.chunks(CHUNK).zip(left_counts) {
        let (own_left, rest_left) = left.split_at_mut(left_count);
        let (own_right, rest_right) = right.split_at_mut(items.len() - left_count);
        (left, right) = (rest_left, rest_right);
        targets.push((items, own_left, own_right));
    }
    targets.into_par_iter().try_for_each(|(items, left, right)| {
        token.check()?;
        let (mut left, mut right) = (left.iter_mut(), right.iter_mut());
        for item in items {
            if let Some(place) = if cut.is_left(item) { left.next() } else { right.next() } {
                *place = *item;
            }
        }
        Ok(())
    })?;
    Ok((middle, sides))
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
