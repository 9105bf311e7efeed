//! Primitives along a curve, mostly Morton's: their codes, sorted, and where a range of them splits.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use std::ops::Range;
use std::time::Instant;

use bytemuck::Zeroable;
use fearless_simd::{Simd, SimdBase, dispatch, f32x4};
use glam::Vec3;
use rayon::prelude::*;

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{Aabb, Triangle};
use crate::kernel::lanes::{FIELDS, LANES};
use crate::kernel::prefetch::prefetch;
use crate::kernel::simd::simd_level;
use crate::order::curve::CurveGrid;
use crate::order::morton::CODE_BITS;
use crate::order::primitive::PrimitiveContainer;
use crate::order::primitive::bounds;
use crate::order::radix_sort::{radix_sort, radix_sort_with};
use crate::settings::Curve;
use crate::stage_times::StageTimes;

/// Triangles to a task where each one is handled alone.
const BATCH: usize = 8192;
/// Most primitives that may have the same packed code before the rest of their codes is sorted as well.
const MAX_CELL_PRIMITIVES: usize = 32;

/// Up to so many keys it is quicker to count those above a split than to search it.
const COUNTED: usize = 32;

/// Primitives sorted by their codes.
pub struct SortedPrimitives<C: PrimitiveContainer> {
    /// What is kept of each primitive's container, in the order of the input.
    kept: Vec<C::Kept>,
    /// The leading bits of each code and, in the lowest `index_bits`, the primitive's number; sorted.
    keys: Vec<u64>,
    index_bits: u32,
    /// Lowest bits of each code that have no room in the keys.
    code_shift: u32,
    /// These bits for the primitives in crowded cells, by position; empty where no cell is crowded.
    crowded: Vec<u64>,
}

/// What a build needs to know about all triangles before it starts.
#[derive(Debug, Clone, Copy)]
pub struct Extent {
    /// Box around the middles of the triangles' boxes.
    middles: Aabb,
    /// The largest absolute value of any coordinate.
    pub largest: f32,
}

/// Measures `triangles`.
pub fn extent(triangles: &[Triangle], token: &CancelToken) -> Result<Extent, Cancelled> {
    let level = simd_level();
    let empty = || [Aabb::EMPTY; 2];
    let [corners, sums] = triangles
        .par_chunks(BATCH)
        .map(|batch| {
            token.check()?;
            Ok(dispatch!(level, simd => extent_of_batch(simd, batch)))
        })
        .try_reduce(empty, |a, b| Ok([a[0].union(&b[0]), a[1].union(&b[1])]))?;
    Ok(Extent {
        middles: Aabb { min: sums.min * 0.5, max: sums.max * 0.5 },
        largest: corners.min.abs().max(corners.max.abs()).max_element(),
    })
}

/// Boxes around the corners and around the sums of the opposite corners of the triangles' boxes.
#[inline(always)]
fn extent_of_batch<S: Simd>(simd: S, batch: &[Triangle]) -> [Aabb; 2] {
    let (mut corners, mut sums) = ([f32x4::splat(simd, f32::INFINITY); 2], [f32x4::splat(simd, f32::INFINITY); 2]);
    (corners[1], sums[1]) = (-corners[1], -sums[1]);
    for triangle in batch {
        let [min, max] = bounds(simd, triangle);
        let sum = min + max;
        corners = [corners[0].min(min), corners[1].max(max)];
        sums = [sums[0].min(sum), sums[1].max(sum)];
    }
    [corners, sums].map(|ends| {
        let [min, max] = ends.map(|end| Vec3::from_slice(end.as_slice()));
        Aabb { min, max }
    })
}

/// The codes of the containers' middles along `curve`, sorted. Adds the stages "codes" and "sort".
pub fn sort_primitives<C: PrimitiveContainer>(
    triangles: &[Triangle],
    extent: &Extent,
    curve: Curve,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<SortedPrimitives<C>, Cancelled> {
    token.check()?;
    let start = Instant::now();
    let grid = CurveGrid::new(&extent.middles, curve);
    let index_bits = usize::BITS - (triangles.len() - 1).leading_zeros();
    let code_shift = (CODE_BITS + index_bits).saturating_sub(u64::BITS);
    let mut kept: Vec<C::Kept> = bytemuck::zeroed_vec(triangles.len());
    let mut keys = vec![0; triangles.len()];
    let level = simd_level();
    triangles
        .par_chunks(BATCH)
        .zip(kept.par_chunks_mut(BATCH))
        .zip(keys.par_chunks_mut(BATCH))
        .enumerate()
        .try_for_each(|(batch, ((triangles, kept), keys))| {
            token.check()?;
            dispatch!(level, simd => codes_of_batch::<C, _>(simd, &grid, triangles, kept, keys));
            for (key, index) in keys.iter_mut().zip(batch * BATCH..) {
                *key = (*key >> code_shift) << index_bits | index as u64;
            }
            Ok(())
        })?;
    times.stages.push(("codes", start.elapsed()));
    token.check()?;

    let start = Instant::now();
    radix_sort(&mut keys, u64::BITS.min(CODE_BITS + index_bits), token)?;
    token.check()?;
    let mut order = SortedPrimitives { kept, keys, index_bits, code_shift, crowded: Vec::new() };
    let crowded = order.crowded_cells();
    if !crowded.is_empty() {
        order.sort_crowded_cells(&crowded, triangles, &grid, token)?;
    }
    times.stages.push(("sort", start.elapsed()));
    token.check()?;
    Ok(order)
}

/// Writes what is kept of each container to `kept` and the codes to `codes`.
#[inline(always)]
fn codes_of_batch<C: PrimitiveContainer, S: Simd>(
    simd: S,
    grid: &CurveGrid,
    triangles: &[Triangle],
    kept: &mut [C::Kept],
    codes: &mut [u64],
) {
    let (blocks, rest) = triangles.as_chunks::<LANES>();
    let mut last = [Triangle::zeroed(); LANES];
    last[..rest.len()].copy_from_slice(rest);
    let blocks = blocks.iter().chain((!rest.is_empty()).then_some(&last));
    for ((triangles, kept), codes) in blocks.zip(kept.chunks_mut(LANES)).zip(codes.chunks_mut(LANES)) {
        let (all_kept, middles) = C::keep_and_middles(simd, triangles);
        kept.copy_from_slice(&all_kept[..kept.len()]);
        codes.copy_from_slice(&grid.codes(simd, &middles, triangles)[..codes.len()]);
    }
}

impl<C: PrimitiveContainer> SortedPrimitives<C> {
    /// Number of primitives.
    pub fn len(&self) -> usize {
        self.keys.len()
    }

    /// The number in the input of the primitive at `position`.
    #[inline(always)]
    pub fn primitive(&self, position: usize) -> u32 {
        (self.keys[position] & !(u64::MAX << self.index_bits)) as u32
    }

    /// The container of `primitive`, which is one of `triangles`, the input.
    #[inline(always)]
    pub fn container(&self, triangles: &[Triangle], primitive: u32) -> C {
        C::restore(&self.kept[primitive as usize], &triangles[primitive as usize])
    }

    /// The fields of the container of the primitive at `position`, and that primitive's number in the input.
    #[inline(always)]
    pub fn fields<S: Simd>(&self, simd: S, triangles: &[Triangle], position: usize) -> ([f32; FIELDS], u32) {
        let primitive = self.primitive(position);
        let (kept, triangle) = (&self.kept[primitive as usize], &triangles[primitive as usize]);
        (C::restore_fields(simd, kept, triangle), primitive)
    }

    /// Asks for what [`Self::fields`] is going to read.
    #[inline(always)]
    pub fn prefetch(&self, triangles: &[Triangle], position: usize) {
        let primitive = self.primitive(position) as usize;
        if size_of::<C::Kept>() == 0 {
            prefetch(triangles, primitive);
        } else {
            prefetch(&self.kept, primitive);
        }
    }

    /// Where `range` splits: at the first flip of the highest bit that is not the same for all, in the middle where
    /// there is none. A plain loop, which must not land in a caller that enables AVX-512.
    #[inline(never)]
    pub fn split(&self, range: &Range<usize>) -> usize {
        let (first, last) = (self.keys[range.start], self.keys[range.end - 1]);
        let Some(bit) = ((first ^ last) >> self.index_bits).checked_ilog2() else { return self.split_cell(range) };
        let bit = bit + self.index_bits;
        let keys = &self.keys[range.clone()];
        if keys.len() > COUNTED {
            return range.start + keys.partition_point(|key| key >> bit & 1 == 0);
        }
        // No step waits for the one before.
        range.end - keys.iter().map(|key| (key >> bit & 1) as usize).sum::<usize>()
    }

    /// [`Self::split`] where the packed codes are all the same.
    fn split_cell(&self, range: &Range<usize>) -> usize {
        let middle = range.start + range.len() / 2;
        if self.crowded.is_empty() {
            return middle;
        }
        let codes = &self.crowded[range.clone()];
        let Some(bit) = (codes[0] ^ codes[codes.len() - 1]).checked_ilog2() else { return middle };
        range.start + codes.partition_point(|code| code >> bit & 1 == 0)
    }

    /// Where a packed code is shared by too many, in order.
    fn crowded_cells(&self) -> Vec<Range<usize>> {
        let code = |at: usize| self.keys[at] >> self.index_bits;
        // Two looks at distances of half a crowd cannot both miss one.
        let step = MAX_CELL_PRIMITIVES / 2;
        let looks = self.keys.len().saturating_sub(1) / step;
        let hits: Vec<usize> = (0..looks)
            .into_par_iter()
            .with_min_len(BATCH)
            .map(|look| look * step)
            .filter(|&at| code(at) == code(at + step))
            .collect();
        let mut cells: Vec<Range<usize>> = Vec::new();
        for at in hits {
            if cells.last().is_none_or(|last| last.end <= at) {
                let same = |other: &u64| other >> self.index_bits == code(at);
                let start = at - self.keys[..at].iter().rev().take_while(|key| same(key)).count();
                let end = at + self.keys[at..].iter().take_while(|key| same(key)).count();
                cells.push(start..end);
            }
        }
        cells.retain(|cell| cell.len() > MAX_CELL_PRIMITIVES);
        cells
    }

    /// Sorts the primitives of the cells `crowded` by the rest of their codes.
    fn sort_crowded_cells(
        &mut self,
        crowded: &[Range<usize>],
        triangles: &[Triangle],
        grid: &CurveGrid,
        token: &CancelToken,
    ) -> Result<(), Cancelled> {
        let (kept, index_bits, code_shift) = (&self.kept, self.index_bits, self.code_shift);
        let index_mask = !(u64::MAX << index_bits);
        self.crowded = vec![0; self.keys.len()];
        let (mut keys, mut codes, mut passed) = (&mut self.keys[..], &mut self.crowded[..], 0);
        let mut cells = Vec::with_capacity(crowded.len());
        for cell in crowded {
            let (own_keys, own_codes);
            (own_keys, keys) = keys[cell.start - passed..].split_at_mut(cell.len());
            (own_codes, codes) = codes[cell.start - passed..].split_at_mut(cell.len());
            passed = cell.end;
            cells.push((own_keys, own_codes));
        }
        cells.into_par_iter().try_for_each(|(keys, codes)| {
            token.check()?;
            let cell = keys[0] & !index_mask;
            // The same primitives with the other end of their codes.
            keys.par_iter_mut().with_min_len(BATCH).for_each(|key| {
                let primitive = (*key & index_mask) as usize;
                let triangle = &triangles[primitive];
                let code = grid.code(C::restore(&kept[primitive], triangle).middle(), triangle);
                *key = (code & !(u64::MAX << code_shift)) << index_bits | primitive as u64;
            });
            radix_sort_with(keys, codes, code_shift + index_bits, token)?;
            keys.par_iter_mut().zip(codes).with_min_len(BATCH).for_each(|(key, code)| {
                (*code, *key) = (*key >> index_bits, cell | *key & index_mask);
            });
            Ok(())
        })
    }
}
