//! Containers of single primitives: computed eight at a time for their codes, and once more where clustering starts.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use bytemuck::Zeroable;
use fearless_simd::{Simd, SimdBase, f32x4};

use crate::geometry::{Aabb, Dop14, Sphere, Triangle};
use crate::kernel::lanes::{Fields, LANES};
use crate::order::triangle_spheres::spheres_around;
use crate::tree::Container;

/// A container that can be computed for eight triangles at a time.
pub trait PrimitiveContainer: Container + Zeroable {
    /// The part of a primitive's container that is stored from the computation of its code to clustering: the sphere, which is expensive to
    /// compute, and nothing of a box or a polytope.
    type CachedBounds: Copy + Zeroable + Send + Sync;
    /// A value for each number of the container: the two corners of a box, and the planes along the diagonals of a polytope; the
    /// centre and radius of a sphere, which leaves two unused.
    type Fields<T: Copy + Send>: Fields<T>;
    /// The cached bounds of each of `triangles`, and its [`Self::centroid`] in the first three lanes.
    fn bounds_and_centroids<S: Simd>(
        simd: S,
        triangles: &[Triangle; LANES],
    ) -> ([Self::CachedBounds; LANES], [f32x4<S>; LANES]);
    /// The container of `triangle`, whose cached bounds are `cached`.
    fn from_cached(cached: &Self::CachedBounds, triangle: &Triangle) -> Self;
    /// The fields of [`Self::from_cached`].
    fn fields_from_cached<S: Simd>(simd: S, cached: &Self::CachedBounds, triangle: &Triangle) -> Self::Fields<f32>;
    /// The point whose position along the curve is the primitive's code.
    fn centroid(&self) -> glam::Vec3;
}

impl PrimitiveContainer for Aabb {
    type CachedBounds = ();
    type Fields<T: Copy + Send> = [T; 6];

    #[inline(always)]
    fn bounds_and_centroids<S: Simd>(simd: S, triangles: &[Triangle; LANES]) -> ([(); LANES], [f32x4<S>; LANES]) {
        let mut centroids = [f32x4::splat(simd, 0.0); LANES];
        for (centroid, triangle) in centroids.iter_mut().zip(triangles) {
            let [min, max] = corners_of_box(simd, triangle);
            *centroid = (min + max) * 0.5;
        }
        ([(); LANES], centroids)
    }

    #[inline(always)]
    fn from_cached((): &(), triangle: &Triangle) -> Self {
        triangle.bounds()
    }

    #[inline(always)]
    fn fields_from_cached<S: Simd>(simd: S, (): &(), triangle: &Triangle) -> [f32; 6] {
        let [min, max] = corners_of_box(simd, triangle);
        [min[0], min[1], min[2], max[0], max[1], max[2]]
    }

    #[inline(always)]
    fn centroid(&self) -> glam::Vec3 {
        self.center()
    }
}

impl PrimitiveContainer for Sphere {
    type CachedBounds = [f32; 4];
    type Fields<T: Copy + Send> = [T; 6];

    #[inline(always)]
    fn bounds_and_centroids<S: Simd>(simd: S, triangles: &[Triangle; LANES]) -> ([[f32; 4]; LANES], [f32x4<S>; LANES]) {
        let spheres = spheres_around(simd, triangles);
        let mut centroids = [f32x4::splat(simd, 0.0); LANES];
        for (centroid, sphere) in centroids.iter_mut().zip(&spheres) {
            *centroid = f32x4::from_slice(simd, sphere);
        }
        (spheres, centroids)
    }

    #[inline(always)]
    fn from_cached([x, y, z, radius]: &[f32; 4], _: &Triangle) -> Self {
        Self { center: glam::Vec3::new(*x, *y, *z), radius: *radius }
    }

    #[inline(always)]
    fn fields_from_cached<S: Simd>(_: S, [x, y, z, radius]: &[f32; 4], _: &Triangle) -> [f32; 6] {
        [*x, *y, *z, *radius, 0.0, 0.0]
    }

    #[inline(always)]
    fn centroid(&self) -> glam::Vec3 {
        self.center
    }
}

/// Polytopes follow the curve by their boxes.
impl PrimitiveContainer for Dop14 {
    type CachedBounds = ();
    type Fields<T: Copy + Send> = [T; 14];

    #[inline(always)]
    fn bounds_and_centroids<S: Simd>(simd: S, triangles: &[Triangle; LANES]) -> ([(); LANES], [f32x4<S>; LANES]) {
        Aabb::bounds_and_centroids(simd, triangles)
    }

    #[inline(always)]
    fn from_cached((): &(), triangle: &Triangle) -> Self {
        Self::of_triangle(triangle)
    }

    #[inline(always)]
    fn fields_from_cached<S: Simd>(_: S, (): &(), triangle: &Triangle) -> [f32; 14] {
        bytemuck::cast(Self::of_triangle(triangle))
    }

    #[inline(always)]
    fn centroid(&self) -> glam::Vec3 {
        self.bounds.center()
    }
}

/// The minimum and maximum corner of the box around `triangle`, in the first three lanes.
#[inline(always)]
pub fn corners_of_box<S: Simd>(simd: S, triangle: &Triangle) -> [f32x4<S>; 2] {
    let coordinates: &[f32; 9] = bytemuck::cast_ref(triangle);
    let (a, b) = (f32x4::from_slice(simd, &coordinates[0..4]), f32x4::from_slice(simd, &coordinates[3..7]));
    let c = f32x4::from_slice(simd, &[coordinates[6], coordinates[7], coordinates[8], 0.0]);
    [a.min(b).min(c), a.max(b).max(c)]
}
