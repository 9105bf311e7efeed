//! The containers of single primitives, as they are made for sorting and kept for the leaves.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use bytemuck::Zeroable;
use fearless_simd::{Simd, SimdBase, f32x4};

use crate::geometry::{Aabb, Sphere, Triangle};
use crate::kernel::lanes::{FIELDS, LANES};
use crate::order::triangle_spheres::spheres_around;
use crate::tree::Container;

/// A container that can be made for many primitives at a time.
pub trait PrimitiveContainer: Container + Zeroable {
    /// What is kept of a primitive's container between the stages of a build: nothing where making it again is cheap.
    type Kept: Copy + bytemuck::Zeroable + Send + Sync;
    /// The parts that are kept of the containers of `triangles`, and [`Self::middle`] of each in the first three lanes.
    fn keep_and_middles<S: Simd>(simd: S, triangles: &[Triangle; LANES]) -> ([Self::Kept; LANES], [f32x4<S>; LANES]);
    /// The container of `triangle`, of which `kept` is left.
    fn restore(kept: &Self::Kept, triangle: &Triangle) -> Self;
    /// The fields of [`Self::restore`].
    fn restore_fields<S: Simd>(simd: S, kept: &Self::Kept, triangle: &Triangle) -> [f32; FIELDS];
    /// The point that its Morton code is made of.
    fn middle(&self) -> glam::Vec3;
}

impl PrimitiveContainer for Aabb {
    type Kept = ();

    #[inline(always)]
    fn keep_and_middles<S: Simd>(simd: S, triangles: &[Triangle; LANES]) -> ([(); LANES], [f32x4<S>; LANES]) {
        let mut middles = [f32x4::splat(simd, 0.0); LANES];
        for (middle, triangle) in middles.iter_mut().zip(triangles) {
            let [min, max] = bounds(simd, triangle);
            *middle = (min + max) * 0.5;
        }
        ([(); LANES], middles)
    }

    #[inline(always)]
    fn restore((): &(), triangle: &Triangle) -> Self {
        triangle.bounds()
    }

    #[inline(always)]
    fn restore_fields<S: Simd>(simd: S, (): &(), triangle: &Triangle) -> [f32; FIELDS] {
        let [min, max] = bounds(simd, triangle);
        [min[0], min[1], min[2], max[0], max[1], max[2]]
    }

    #[inline(always)]
    fn middle(&self) -> glam::Vec3 {
        self.center()
    }
}

impl PrimitiveContainer for Sphere {
    type Kept = [f32; 4];

    #[inline(always)]
    fn keep_and_middles<S: Simd>(simd: S, triangles: &[Triangle; LANES]) -> ([[f32; 4]; LANES], [f32x4<S>; LANES]) {
        let spheres = spheres_around(simd, triangles);
        let mut middles = [f32x4::splat(simd, 0.0); LANES];
        for (middle, sphere) in middles.iter_mut().zip(&spheres) {
            *middle = f32x4::from_slice(simd, sphere);
        }
        (spheres, middles)
    }

    #[inline(always)]
    fn restore([x, y, z, radius]: &[f32; 4], _: &Triangle) -> Self {
        Self { center: glam::Vec3::new(*x, *y, *z), radius: *radius }
    }

    #[inline(always)]
    fn restore_fields<S: Simd>(_: S, [x, y, z, radius]: &[f32; 4], _: &Triangle) -> [f32; FIELDS] {
        [*x, *y, *z, *radius, 0.0, 0.0]
    }

    #[inline(always)]
    fn middle(&self) -> glam::Vec3 {
        self.center
    }
}

/// The opposite corners of the box around `triangle`, in the first three lanes.
#[inline(always)]
pub fn bounds<S: Simd>(simd: S, triangle: &Triangle) -> [f32x4<S>; 2] {
    let numbers: &[f32; 9] = bytemuck::cast_ref(triangle);
    let (a, b) = (f32x4::from_slice(simd, &numbers[0..4]), f32x4::from_slice(simd, &numbers[3..7]));
    let c = f32x4::from_slice(simd, &[numbers[6], numbers[7], numbers[8], 0.0]);
    [a.min(b).min(c), a.max(b).max(c)]
}
