//! Bounds of all triangles, which a build needs before it starts.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Simd, SimdBase, f32x4};
use glam::Vec3;

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{Aabb, Triangle};
use crate::kernel::SimdLevel;
use crate::kernel::parallel::par_tasks;
use crate::kernel::simd::dispatch_plain;
use crate::order::primitive_container::corners_of_box;

/// Triangles per task.
const BATCH: usize = 8192;

/// Bounds of the centroids and of the coordinates of all triangles.
#[derive(Debug, Clone, Copy)]
pub struct InputBounds {
    /// Box around the centroids of the triangles' boxes: the grid of the space-filling curve covers it.
    pub centroids: Aabb,
    /// Largest absolute value of any coordinate.
    pub max_coordinate: f32,
}

/// Computes the bounds of `triangles` in the calling thread's rayon pool.
pub fn input_bounds(triangles: &[Triangle], token: &CancelToken) -> Result<InputBounds, Cancelled> {
    let level = SimdLevel::of_builds().level();
    let batches = par_tasks(triangles.chunks(BATCH), token, |batch, _| {
        Ok(dispatch_plain!(level, simd => bounds_of_batch(simd, batch)))
    })?;
    let [corners, sums] =
        batches.iter().fold([Aabb::EMPTY; 2], |all, batch| [all[0].union(&batch[0]), all[1].union(&batch[1])]);
    Ok(InputBounds {
        centroids: Aabb { min: sums.min * 0.5, max: sums.max * 0.5 },
        max_coordinate: corners.min.abs().max(corners.max.abs()).max_element(),
    })
}

/// Box around all corners, and box around the sums of the two corners of each triangle's box (twice its centroid).
#[inline(always)]
fn bounds_of_batch<S: Simd>(simd: S, batch: &[Triangle]) -> [Aabb; 2] {
    let (mut corners, mut sums) = ([f32x4::splat(simd, f32::INFINITY); 2], [f32x4::splat(simd, f32::INFINITY); 2]);
    (corners[1], sums[1]) = (-corners[1], -sums[1]);
    for triangle in batch {
        let [min, max] = corners_of_box(simd, triangle);
        let sum = min + max;
        corners = [corners[0].min(min), corners[1].max(max)];
        sums = [sums[0].min(sum), sums[1].max(sum)];
    }
    [corners, sums].map(|ends| {
        let [min, max] = ends.map(|end| Vec3::from_slice(end.as_slice()));
        Aabb { min, max }
    })
}
