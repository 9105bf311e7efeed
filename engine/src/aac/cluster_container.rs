//! Containers as agglomerative clustering sees them: fields in SIMD lanes, their union and their merge distance.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "several arrays are indexed by the same field")]

use fearless_simd::Simd;

use crate::geometry::{Aabb, Sphere};
use crate::kernel::lanes::{FIELDS, Lanes};
use crate::order::PrimitiveContainer;

/// A container whose merge distance to many others can be computed at once.
pub trait ClusterContainer: PrimitiveContainer {
    /// Number of fields in use.
    const USED_FIELDS: usize;
    /// Fields of a stand-in for no cluster, whose distance to every container is infinite.
    const INFINITELY_FAR: [f32; FIELDS];
    /// Its fields: a box's minimum and maximum corner, a sphere's centre and radius.
    fn fields(&self) -> [f32; FIELDS];
    /// The container with these `fields`.
    fn from_fields(fields: [f32; FIELDS]) -> Self;
    /// Fields of the smallest container around two, each in all lanes.
    fn union_fields<S: Simd, V: Lanes<S>>(simd: S, first: &[f32; FIELDS], second: &[f32; FIELDS]) -> [V; FIELDS];
    /// d(`own`, other) for each lane of `others`: surface area of the union, or a value that increases with it.
    fn merge_distances<S: Simd, V: Lanes<S>>(own: &[V; FIELDS], others: &[V; FIELDS]) -> V;
}

impl ClusterContainer for Aabb {
    const USED_FIELDS: usize = 6;
    const INFINITELY_FAR: [f32; FIELDS] =
        [-f32::INFINITY, -f32::INFINITY, -f32::INFINITY, f32::INFINITY, f32::INFINITY, f32::INFINITY];
    #[inline(always)]
    fn fields(&self) -> [f32; FIELDS] {
        [self.min.x, self.min.y, self.min.z, self.max.x, self.max.y, self.max.z]
    }

    #[inline(always)]
    fn from_fields([ax, ay, az, bx, by, bz]: [f32; FIELDS]) -> Self {
        Self { min: glam::Vec3::new(ax, ay, az), max: glam::Vec3::new(bx, by, bz) }
    }

    #[inline(always)]
    fn union_fields<S: Simd, V: Lanes<S>>(simd: S, first: &[f32; FIELDS], second: &[f32; FIELDS]) -> [V; FIELDS] {
        let mut union = [V::splat(simd, 0.0); FIELDS];
        for field in 0..FIELDS {
            let (a, b) = (V::splat(simd, first[field]), V::splat(simd, second[field]));
            union[field] = if field < 3 { a.min(b) } else { a.max(b) };
        }
        union
    }

    #[inline(always)]
    fn merge_distances<S: Simd, V: Lanes<S>>(own: &[V; FIELDS], others: &[V; FIELDS]) -> V {
        let x = own[3].max(others[3]) - own[0].min(others[0]);
        let y = own[4].max(others[4]) - own[1].min(others[1]);
        let z = own[5].max(others[5]) - own[2].min(others[2]);
        x * (y + z) + y * z
    }
}

impl ClusterContainer for Sphere {
    const USED_FIELDS: usize = 4;
    const INFINITELY_FAR: [f32; FIELDS] = [0.0, 0.0, 0.0, f32::INFINITY, 0.0, 0.0];
    #[inline(always)]
    fn fields(&self) -> [f32; FIELDS] {
        [self.center.x, self.center.y, self.center.z, self.radius, 0.0, 0.0]
    }

    #[inline(always)]
    fn from_fields([x, y, z, radius, ..]: [f32; FIELDS]) -> Self {
        Self { center: glam::Vec3::new(x, y, z), radius }
    }

    #[inline(always)]
    fn union_fields<S: Simd, V: Lanes<S>>(simd: S, first: &[f32; FIELDS], second: &[f32; FIELDS]) -> [V; FIELDS] {
        splat_fields::<Self, S, V>(simd, &Self::from_fields(*first).union(&Self::from_fields(*second)).fields())
    }

    #[inline(always)]
    fn merge_distances<S: Simd, V: Lanes<S>>(own: &[V; FIELDS], others: &[V; FIELDS]) -> V {
        let (x, y, z) = (own[0] - others[0], own[1] - others[1], own[2] - others[2]);
        let reach = ((x * x + y * y + z * z).sqrt() + (own[3] + others[3])) * 0.5;
        // The radius increases with the area; a sphere inside the other does not enlarge it.
        reach.max(own[3]).max(others[3])
    }
}

/// Copies each of `fields` to all lanes. No closure: one that is not inlined would lack the vector instructions.
#[inline(always)]
pub fn splat_fields<C: ClusterContainer, S: Simd, V: Lanes<S>>(simd: S, fields: &[f32; FIELDS]) -> [V; FIELDS] {
    let mut lanes = [V::splat(simd, 0.0); FIELDS];
    for field in 0..C::USED_FIELDS {
        lanes[field] = V::splat(simd, fields[field]);
    }
    lanes
}

#[cfg(test)]
mod tests {
    use fearless_simd::{dispatch, f32x4};
    use glam::Vec3;

    use super::*;
    use crate::kernel::SimdLevel;

    fn merge_distance<C: ClusterContainer>(own: &C, other: &C) -> f32 {
        dispatch!(SimdLevel::Sse2.level(), simd => {
            let [own, other] = [own, other].map(|container| splat_fields::<C, _, f32x4<_>>(simd, &container.fields()));
            C::merge_distances(&own, &other)[0]
        })
    }

    #[test]
    fn the_merge_distance_of_spheres_is_the_radius_of_their_union() {
        let sphere = |x: f32, radius: f32| Sphere { center: Vec3::X * x, radius };
        for (one, other, radius, what) in [
            (sphere(0.0, 1.0), sphere(3.0, 1.0), 2.5, "apart"),
            (sphere(0.0, 2.0), sphere(2.0, 1.0), 2.5, "crossing"),
            (sphere(0.0, 2.0), sphere(0.5, 0.5), 2.0, "one inside the other, which then is the union"),
            (sphere(0.0, 1.0), sphere(0.0, 1.0), 1.0, "equal"),
        ] {
            assert_eq!(merge_distance(&one, &other), radius, "{what}");
            assert_eq!(merge_distance(&other, &one), radius, "{what}, the other way round");
            assert!((one.union(&other).radius - radius).abs() < 1e-5, "{what}: {:?}", one.union(&other));
        }
    }

    #[test]
    fn the_merge_distance_of_boxes_is_half_the_area_of_their_union() {
        let cube = |min: Vec3| Aabb { min, max: min + 1.0 };
        // The union of cubes at the origin and at (2, 1, 0) is 3 by 2 by 1: 6 + 2 + 3.
        assert_eq!(merge_distance(&cube(Vec3::ZERO), &cube(Vec3::new(2.0, 1.0, 0.0))), 11.0);
        assert_eq!(merge_distance(&cube(Vec3::ZERO), &cube(Vec3::new(0.0, 2.0, 1.0))), 11.0);
        assert_eq!(merge_distance(&cube(Vec3::ONE), &cube(Vec3::ONE)), 3.0);
    }
}
