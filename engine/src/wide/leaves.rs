//! The leaves of a wide tree: their triangles one after the other in leaf order, without gaps.
//!
//! A leaf is divided into blocks of four triangles, and the remainder forms the last block. A block of `n` triangles is a
//! structure of arrays with a stride of `n`: nine arrays of coordinates, by axis, then by corner, and one of primitive indices. A SIMD
//! load reads one array of the block, and beyond it where `n` is less than four; those lanes are masked.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Select, Simd, SimdBase, f32x4};

use crate::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use crate::geometry::{Aabb, Triangle};
use crate::kernel::prefetch::prefetch_lines;
use crate::wide::block::TriangleBlock;
use crate::wide::child::{Child, LeafRange};
use crate::wide::layout::{BLOCK, COORDINATES, INDEX_MARK, VALUES, WINDOW};
use crate::wide::needles::are_needles;

/// Values after the last triangle, which make the window of every block whole.
pub(crate) const PADDING: usize = WINDOW - VALUES;

/// The triangles of all leaves.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Leaves {
    /// Rows of the triangles in leaf order, block by block, and [`PADDING`].
    pub(crate) values: Vec<f32>,
    /// Leaves that a [`Child`] cannot describe by itself.
    pub(crate) long: Vec<LeafRange>,
}

impl Leaves {
    /// The triangles of a leaf.
    #[inline(always)]
    pub(crate) fn range(&self, leaf: Child) -> LeafRange {
        match leaf.short_leaf() {
            Some(range) => range,
            None => self.long_range(leaf),
        }
    }

    #[cold]
    #[inline(never)]
    fn long_range(&self, leaf: Child) -> LeafRange {
        self.long[leaf.index()]
    }

    /// The blocks of a leaf.
    #[inline(always)]
    pub fn blocks(&self, leaf: Child) -> impl Iterator<Item = TriangleBlock<'_>> {
        let LeafRange { first, count } = self.range(leaf);
        let (mut slot, mut remaining) = (first as usize, count as usize);
        std::iter::from_fn(move || {
            let count = remaining.min(BLOCK);
            let block = (count > 0).then(|| self.block(slot, count));
            slot += count;
            remaining -= count;
            block
        })
    }

    /// The block of `count` triangles from `slot` on.
    #[inline(always)]
    fn block(&self, slot: usize, count: usize) -> TriangleBlock<'_> {
        let Some(window) = self.values[VALUES * slot..].first_chunk() else {
            unreachable!("the padding makes every window whole")
        };
        TriangleBlock { window, count }
    }

    /// The values without the marks of needles, which follow from the corners: `leaves` are all that there are.
    pub(crate) fn unmarked(
        &self,
        leaves: impl Iterator<Item = Child>,
        token: &CancelToken,
    ) -> Result<Vec<f32>, Cancelled> {
        let mut values = self.values.clone();
        for (at, leaf) in leaves.enumerate() {
            token.check_every(MEDIUM_STEPS, at)?;
            let LeafRange { first, count } = self.range(leaf);
            for block in (0..count as usize).step_by(BLOCK) {
                let size = BLOCK.min(count as usize - block);
                let indices = VALUES * (first as usize + block) + COORDINATES * size;
                values[indices..indices + size].iter_mut().for_each(|index| *index = index.abs());
            }
        }
        // The last row of the last block may be followed by copies of its last index.
        values[VALUES * self.triangle_count()..].iter_mut().for_each(|index| *index = index.abs());
        Ok(values)
    }

    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.values.len().saturating_sub(PADDING) / VALUES
    }

    /// The box around the triangles of a leaf.
    pub(crate) fn bounds(&self, leaf: Child) -> Aabb {
        let triangles = self.blocks(leaf).flat_map(|block| (0..block.count()).map(move |lane| block.triangle(lane)));
        triangles.fold(Aabb::EMPTY, |all, triangle| all.union(&triangle.bounds()))
    }

    /// Prefetches a leaf, which need not exist.
    #[inline(always)]
    pub(crate) fn prefetch(&self, leaf: Child) {
        let bytes = size_of::<[f32; VALUES]>();
        prefetch_lines(self.values.as_ptr().cast::<u8>().wrapping_add(leaf.index() * bytes), BLOCK * bytes);
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.values[..]) + size_of_val(&self.long[..])
    }
}

/// Writes the triangles with the given indices, which are a leaf, to the beginning of `values`. What follows there may be
/// overwritten.
#[inline(always)]
pub(crate) fn write_leaf<S: Simd>(simd: S, triangles: &[Triangle], indices: &[u32], values: &mut [f32]) {
    for (indices, at) in indices.chunks(BLOCK).zip((0..).step_by(BLOCK * VALUES)) {
        write_block(simd, triangles, indices, &mut values[at..]);
    }
}

/// Four coordinates of each triangle from the given one on, by coordinate.
#[inline(always)]
fn rows_from<S: Simd>(simd: S, [a, b, c, d]: [&[f32; COORDINATES]; BLOCK], first: usize) -> [f32x4<S>; BLOCK] {
    let [a, c] = [f32x4::from_slice(simd, &a[first..][..BLOCK]), f32x4::from_slice(simd, &c[first..][..BLOCK])];
    let [b, d] = [f32x4::from_slice(simd, &b[first..][..BLOCK]), f32x4::from_slice(simd, &d[first..][..BLOCK])];
    let (even, odd) = (a.interleave(c), b.interleave(d));
    let ((a, b), (c, d)) = (even.0.interleave(odd.0), even.1.interleave(odd.1));
    [a, b, c, d]
}

/// Without branches on the number of triangles, which could not be predicted: every row is written with four, the last one repeated,
/// and the next row overwrites what is too much.
#[inline(always)]
fn write_block<S: Simd>(simd: S, triangles: &[Triangle], indices: &[u32], values: &mut [f32]) {
    let last = indices.len() - 1;
    let triangle =
        |lane: usize| -> &[f32; COORDINATES] { bytemuck::cast_ref(&triangles[indices[last.min(lane)] as usize]) };
    let triangles = [triangle(0), triangle(1), triangle(2), triangle(3)];
    let [ax, ay, az, bx] = rows_from(simd, triangles, 0);
    let [by, bz, cx, cy] = rows_from(simd, triangles, 4);
    let [_, _, _, cz] = rows_from(simd, triangles, 5);
    let marked = |lane: usize| f32::from_bits(indices[last.min(lane)] | INDEX_MARK);
    let marked = f32x4::load_array(simd, [marked(0), marked(1), marked(2), marked(3)]);
    // The sign is the mark of needles.
    let marked = are_needles(simd, [[ax, ay, az], [bx, by, bz], [cx, cy, cz]]).select(-marked, marked);
    let rows = [ax, bx, cx, ay, by, cy, az, bz, cz, marked];
    let count = last % BLOCK + 1;
    if let Some(window) = values.first_chunk_mut() {
        write_rows(&rows, count, window);
    } else {
        for (row, to) in rows.iter().zip(values.chunks_exact_mut(count)) {
            to.copy_from_slice(&row.as_slice()[..count]);
        }
    }
}

/// Writes the rows of a block of `count` triangles: each with four, of which the next row overwrites what is too much.
#[inline(always)]
fn write_rows<S: Simd>(rows: &[f32x4<S>; VALUES], count: usize, window: &mut [f32; BLOCK * VALUES]) {
    for (at, row) in rows.iter().enumerate() {
        window[at * count..][..BLOCK].copy_from_slice(row.as_slice());
    }
}
