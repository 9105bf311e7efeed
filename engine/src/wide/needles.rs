//! Which of four triangles are needles.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Simd, SimdBase, f32x4, mask32x4};

use crate::geometry::NEEDLE_ASPECT;
use crate::kernel::each;

/// [`Triangle::is_needle`] of four triangles.
#[inline(always)]
pub(crate) fn are_needles<S: Simd>(simd: S, [a, b, c]: [[f32x4<S>; 3]; 3]) -> mask32x4<S> {
    let (ab, ac) = (each!(axis => b[axis] - a[axis]), each!(axis => c[axis] - a[axis]));
    let normal = [ab[1] * ac[2] - ac[1] * ab[2], ab[2] * ac[0] - ac[2] * ab[0], ab[0] * ac[1] - ac[0] * ab[1]];
    let size = normal[0].abs().max(normal[1].abs()).max(normal[2].abs());
    let squared = |edge: [f32x4<S>; 3]| edge[0] * edge[0] + edge[1] * edge[1] + edge[2] * edge[2];
    (size * f32x4::splat(simd, NEEDLE_ASPECT)).simd_lt(squared(ab).max(squared(ac)))
}
