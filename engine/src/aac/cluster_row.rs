//! Rows of sixteen clusters side by side, one per SIMD lane, with which long lists are searched.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "several arrays are indexed by the same row or field")]

use fearless_simd::{Simd, SimdBase, SimdMask, f32x16, mask32x16, u32x16};

use crate::aac::cluster::ClusterStack;
use crate::aac::cluster_container::ClusterContainer;
use crate::kernel::lanes::Fields;

/// Number of clusters compared at a time.
pub const WIDTH: usize = 16;

/// Clusters that are compared at a time.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub struct Row<C: ClusterContainer> {
    /// Container fields, see [`ClusterContainer::fields`].
    pub fields: C::Fields<[f32; WIDTH]>,
    /// Lower bounds of the distances to the best matches; infinity for empty places and for the query.
    pub bounds: [f32; WIDTH],
    /// Distances to the query; infinity where the bound is, and everywhere if there is no query.
    pub query_distances: [f32; WIDTH],
}

impl<C: ClusterContainer> Row<C> {
    /// Loads the clusters from `at` on of a list that ends at `end`.
    #[inline(always)]
    pub fn new(list: &ClusterStack<C>, at: usize, end: usize) -> Self {
        let mut row = Self {
            fields: C::Fields::splat([0.0; WIDTH]),
            bounds: [f32::INFINITY; WIDTH],
            query_distances: [f32::INFINITY; WIDTH],
        };
        for field in 0..C::USED_FIELDS {
            // The stack has capacity for a row behind the list.
            row.fields[field].copy_from_slice(&list.fields[field][at..at + WIDTH]);
            row.fields[field][WIDTH.min(end - at)..].fill(C::INFINITELY_FAR[field]);
        }
        row
    }

    /// The containers of all lanes.
    #[inline(always)]
    pub fn fields<S: Simd>(&self, simd: S) -> C::Fields<f32x16<S>> {
        let mut fields = C::Fields::splat(f32x16::splat(simd, 0.0));
        for field in 0..C::USED_FIELDS {
            fields[field] = f32x16::load_array_ref(simd, &self.fields[field]);
        }
        fields
    }
}

/// Mask of the lane of the place `at` in its row.
#[inline(always)]
pub fn lane_mask<S: Simd>(simd: S, at: usize) -> mask32x16<S> {
    let lanes = u32x16::load_array(simd, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]);
    lanes.simd_eq(u32x16::splat(simd, (at % WIDTH) as u32))
}

/// The minimum of each vector, in the lane of the vector's index.
#[inline(always)]
pub fn minimum_of_each<S: Simd>(mut vectors: [f32x16<S>; WIDTH]) -> f32x16<S> {
    let mut half = WIDTH / 2;
    while half > 0 {
        for at in 0..half {
            let (first, second) = (vectors[at], vectors[at + half]);
            vectors[at] = first.zip_low(second).min(first.zip_high(second));
        }
        half /= 2;
    }
    vectors[0]
}

/// One bit per lane of `row` that equals `value`.
#[inline(always)]
pub fn equal<S: Simd>(simd: S, row: &[f32; WIDTH], value: f32x16<S>) -> u64 {
    f32x16::load_array_ref(simd, row).simd_eq(value).to_bitmask()
}
