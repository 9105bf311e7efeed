//! Primitives sorted by their codes along a space-filling curve (figure 5: "radix sort P by Morton code"), and where a range of
//! them splits (figure 6: "make partition").

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use std::ops::Range;

use bytemuck::Zeroable;
use fearless_simd::Simd;

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::kernel::SimdLevel;
use crate::kernel::lanes::LANES;
use crate::kernel::parallel::{par_collect, par_tasks, zeros};
use crate::kernel::prefetch::{prefetch, prefetch_whole};
use crate::kernel::simd::dispatch_plain;
use crate::order::curve::CurveGrid;
use crate::order::input_bounds::InputBounds;
use crate::order::morton::CODE_BITS;
use crate::order::primitive_container::PrimitiveContainer;
use crate::order::radix_sort::{radix_sort, radix_sort_with};
use crate::settings::Curve;
use crate::stage_times::{Stage, StageTimes};

/// Primitives per task.
const BATCH: usize = 8192;
/// Maximum number of primitives with the same packed code before they are sorted by the rest of their codes as well.
const MAX_CELL_PRIMITIVES: usize = 32;
/// Maximum number of keys among which a split is found by counting: for so few it is faster than binary search.
const MAX_COUNTED: usize = 32;

/// Primitives sorted by their codes, each packed with its primitive's index into one 64-bit key.
pub struct SortedPrimitives<C: PrimitiveContainer> {
    /// Cached bounds of each primitive, in input order.
    cached: Vec<C::CachedBounds>,
    /// The leading bits of each code above the primitive's index in the lowest `index_bits`; sorted.
    keys: Vec<u64>,
    index_bits: u32,
    /// Number of trailing code bits for which a key has no space.
    code_shift: u32,
    /// These trailing bits for the primitives of crowded cells, by position; empty where no cell is crowded.
    crowded: Vec<u64>,
    /// Containers of blocks of several primitives in sorted order, which are in their places; empty where none are joined.
    blocks: Vec<C>,
    /// Position of the first primitive of each block, and the number of primitives.
    starts: Vec<u32>,
}

/// Sorts primitives by the codes of their containers' centroids along `curve`. Adds the stages "codes" and "sort".
pub fn sort_primitives<C: PrimitiveContainer>(
    triangles: &[Triangle],
    bounds: &InputBounds,
    curve: Curve,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<SortedPrimitives<C>, Cancelled> {
    token.check()?;
    let stage = Stage::begin("codes", token);
    let grid = CurveGrid::new(&bounds.centroids, curve);
    let index_bits = usize::BITS - (triangles.len() - 1).leading_zeros();
    let code_shift = (CODE_BITS + index_bits).saturating_sub(u64::BITS);
    let mut cached: Vec<C::CachedBounds> = zeros(triangles.len(), token)?;
    let mut keys = zeros(triangles.len(), token)?;
    let level = SimdLevel::of_builds().level();
    let batches = triangles.chunks(BATCH).zip(cached.chunks_mut(BATCH)).zip(keys.chunks_mut(BATCH)).enumerate();
    par_tasks(batches, token, |(batch, ((triangles, cached), keys)), _| {
        dispatch_plain!(level, simd => codes_of_batch::<C, _>(simd, &grid, triangles, cached, keys));
        for (key, index) in keys.iter_mut().zip(batch * BATCH..) {
            *key = (*key >> code_shift) << index_bits | index as u64;
        }
        Ok(())
    })?;
    stage.end(times);
    token.check()?;

    let stage = Stage::begin("sort", token);
    radix_sort(&mut keys, u64::BITS.min(CODE_BITS + index_bits), token)?;
    token.check()?;
    let mut order = SortedPrimitives {
        cached,
        keys,
        index_bits,
        code_shift,
        crowded: Vec::new(),
        blocks: Vec::new(),
        starts: Vec::new(),
    };
    let crowded = order.crowded_cells(token)?;
    if !crowded.is_empty() {
        order.sort_crowded_cells(&crowded, triangles, &grid, token)?;
    }
    stage.end(times);
    token.check()?;
    Ok(order)
}

/// Writes the bounds to cache of each of `triangles` to `cached` and its code to `codes`.
#[inline(always)]
fn codes_of_batch<C: PrimitiveContainer, S: Simd>(
    simd: S,
    grid: &CurveGrid,
    triangles: &[Triangle],
    cached: &mut [C::CachedBounds],
    codes: &mut [u64],
) {
    let (blocks, remainder) = triangles.as_chunks::<LANES>();
    let mut last = [Triangle::zeroed(); LANES];
    last[..remainder.len()].copy_from_slice(remainder);
    let blocks = blocks.iter().chain((!remainder.is_empty()).then_some(&last));
    for ((triangles, cached), codes) in blocks.zip(cached.chunks_mut(LANES)).zip(codes.chunks_mut(LANES)) {
        let (bounds, centroids) = C::bounds_and_centroids(simd, triangles);
        cached.copy_from_slice(&bounds[..cached.len()]);
        codes.copy_from_slice(&grid.codes(simd, &centroids, triangles)[..codes.len()]);
    }
}

impl<C: PrimitiveContainer> SortedPrimitives<C> {
    /// Number of primitives.
    pub fn len(&self) -> usize {
        self.keys.len()
    }

    /// Index in the input of the primitive at `position` in sorted order.
    #[inline(always)]
    pub fn primitive(&self, position: usize) -> u32 {
        (self.keys[position] & !(u64::MAX << self.index_bits)) as u32
    }

    /// Container of the primitive with index `primitive` in `triangles`, the input.
    #[inline(always)]
    pub fn container(&self, triangles: &[Triangle], primitive: u32) -> C {
        C::from_cached(&self.cached[primitive as usize], &triangles[primitive as usize])
    }

    /// Blocks of these primitives in their places: block `i` has the container `blocks[i]`, the primitives from the position `starts[i]`
    /// to `starts[i + 1]`, and the code of the first of them.
    pub(crate) fn in_blocks(&self, starts: Vec<u32>, blocks: Vec<C>, token: &CancelToken) -> Result<Self, Cancelled> {
        let of_first = |list: &[u64]| par_collect(blocks.len(), token, |block| list[starts[block] as usize]);
        let crowded = if self.crowded.is_empty() { Vec::new() } else { of_first(&self.crowded)? };
        let (keys, index_bits, code_shift) = (of_first(&self.keys)?, self.index_bits, self.code_shift);
        Ok(Self { cached: Vec::new(), keys, index_bits, code_shift, crowded, blocks, starts })
    }

    /// These primitives with containers of their own, each as a block.
    pub(crate) fn in_containers(&self, containers: &[C], token: &CancelToken) -> Result<Self, Cancelled> {
        let starts = par_collect(self.len() + 1, token, |position| position as u32)?;
        let in_order = par_collect(self.len(), token, |position| containers[self.primitive(position) as usize])?;
        self.in_blocks(starts, in_order, token)
    }

    /// Container of the block at `position`, and the positions of its primitives; `None` where these are primitives.
    #[inline(always)]
    pub fn block(&self, position: usize) -> Option<(&C, Range<usize>)> {
        let block = self.blocks.get(position)?;
        Some((block, self.starts[position] as usize..self.starts[position + 1] as usize))
    }

    /// Container fields of the primitive at `position` in sorted order, and its index in the input.
    #[inline(always)]
    pub fn fields<S: Simd>(&self, simd: S, triangles: &[Triangle], position: usize) -> (C::Fields<f32>, u32) {
        let primitive = self.primitive(position);
        let (cached, triangle) = (&self.cached[primitive as usize], &triangles[primitive as usize]);
        (C::fields_from_cached(simd, cached, triangle), primitive)
    }

    /// Prefetches what [`Self::fields`] reads for `position`.
    #[inline(always)]
    pub fn prefetch(&self, triangles: &[Triangle], position: usize) {
        if !self.blocks.is_empty() {
            return;
        }
        let primitive = self.primitive(position) as usize;
        if size_of::<C::CachedBounds>() == 0 {
            prefetch_whole(triangles, primitive);
        } else {
            prefetch(&self.cached, primitive);
        }
    }

    /// Position that divides `range` in two where the highest code bit that differs within it flips; half way where all codes are
    /// equal. A plain loop, which must not be inlined into a caller that enables AVX-512.
    #[inline(never)]
    pub fn make_partition(&self, range: &Range<usize>) -> usize {
        let (first, last) = (self.keys[range.start], self.keys[range.end - 1]);
        let Some(bit) = ((first ^ last) >> self.index_bits).checked_ilog2() else { return self.partition_cell(range) };
        let bit = bit + self.index_bits;
        let keys = &self.keys[range.clone()];
        if keys.len() > MAX_COUNTED {
            return range.start + keys.partition_point(|key| key >> bit & 1 == 0);
        }
        // Counting has no dependency from one step to the next.
        range.end - keys.iter().map(|key| (key >> bit & 1) as usize).sum::<usize>()
    }

    /// [`Self::make_partition`] of primitives that all have the same packed code.
    fn partition_cell(&self, range: &Range<usize>) -> usize {
        let half_way = range.start + range.len() / 2;
        if self.crowded.is_empty() {
            return half_way;
        }
        let codes = &self.crowded[range.clone()];
        let Some(bit) = (codes[0] ^ codes[codes.len() - 1]).checked_ilog2() else { return half_way };
        range.start + codes.partition_point(|code| code >> bit & 1 == 0)
    }

    /// The bit of the codes by which [`Self::make_partition`] divides `range`, the lowest being 0; `None` where it divides it half way.
    pub fn split_bit(&self, range: &Range<usize>) -> Option<u32> {
        let (first, last) = (self.keys[range.start], self.keys[range.end - 1]);
        let packed = ((first ^ last) >> self.index_bits).checked_ilog2().map(|bit| bit + self.code_shift);
        packed.or_else(|| {
            let codes = self.crowded.get(range.clone())?;
            (codes.first()? ^ codes.last()?).checked_ilog2()
        })
    }

    /// Ranges of more than [`MAX_CELL_PRIMITIVES`] primitives with the same packed code, in order.
    fn crowded_cells(&self, token: &CancelToken) -> Result<Vec<Range<usize>>, Cancelled> {
        let code = |position: usize| self.keys[position] >> self.index_bits;
        // Samples half a crowd apart cannot both miss one.
        let step = MAX_CELL_PRIMITIVES / 2;
        let samples = self.keys.len().saturating_sub(1) / step;
        let hits: Vec<Vec<usize>> = par_tasks((0..samples).step_by(BATCH), token, |first, _| {
            let positions = (first..samples.min(first + BATCH)).map(|sample| sample * step);
            Ok(positions.filter(|&position| code(position) == code(position + step)).collect())
        })?;
        let mut cells: Vec<Range<usize>> = Vec::new();
        for position in hits.into_iter().flatten() {
            if cells.last().is_none_or(|last| last.end <= position) {
                let same = |other: &u64| other >> self.index_bits == code(position);
                let start = position - self.keys[..position].iter().rev().take_while(|key| same(key)).count();
                let end = position + self.keys[position..].iter().take_while(|key| same(key)).count();
                cells.push(start..end);
            }
        }
        cells.retain(|cell| cell.len() > MAX_CELL_PRIMITIVES);
        Ok(cells)
    }

    /// Sorts the primitives of the `crowded` cells by the trailing bits of their codes.
    fn sort_crowded_cells(
        &mut self,
        crowded: &[Range<usize>],
        triangles: &[Triangle],
        grid: &CurveGrid,
        token: &CancelToken,
    ) -> Result<(), Cancelled> {
        let (cached, index_bits, code_shift) = (&self.cached, self.index_bits, self.code_shift);
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
        par_tasks(cells, token, |(keys, codes), token| {
            let cell = keys[0] & !index_mask;
            // Keys of the same primitives with the trailing instead of the leading bits of their codes.
            par_tasks(keys.chunks_mut(BATCH), token, |keys, _| {
                for key in keys {
                    let primitive = (*key & index_mask) as usize;
                    let triangle = &triangles[primitive];
                    let code = grid.code(C::from_cached(&cached[primitive], triangle).centroid(), triangle);
                    *key = (code & !(u64::MAX << code_shift)) << index_bits | primitive as u64;
                }
                Ok(())
            })?;
            radix_sort_with(keys, codes, code_shift + index_bits, token)?;
            par_tasks(keys.chunks_mut(BATCH).zip(codes.chunks_mut(BATCH)), token, |(keys, codes), _| {
                for (key, code) in keys.iter_mut().zip(codes) {
                    (*code, *key) = (*key >> index_bits, cell | *key & index_mask);
                }
                Ok(())
            })
        })
        .map(drop)
    }
}
