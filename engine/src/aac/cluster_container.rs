//! Containers as agglomerative clustering sees them: fields in SIMD lanes, their union and their merge distance.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "several arrays are indexed by the same field")]

use std::ops::IndexMut;

use fearless_simd::{Simd, SimdBase as _, f32x8};

use crate::geometry::{Aabb, Container as _, Dop14, Sphere, half_area_between};
use crate::kernel::lanes::{Fields, LANES, Lanes};
use crate::order::PrimitiveContainer;
use crate::tree::Tree;

/// A container whose merge distance to many others can be computed at once.
pub trait ClusterContainer: PrimitiveContainer {
    /// Number of fields in use.
    const USED_FIELDS: usize;
    /// Longest list that is clustered by a matrix of distances, which is compiled for each length, see
    /// [`combine_short`](super::combine_short::combine_short).
    const LONGEST_SHORT_LIST: usize = 32;
    /// A list of numbers for each field.
    type Columns: Default + Send + IndexMut<usize, Output = Vec<f32>>;
    /// Fields of a stand-in for no cluster, whose distance to every container is infinite.
    const INFINITELY_FAR: Self::Fields<f32>;
    /// Its fields: a box's minimum and maximum corner, a sphere's centre and radius, a polytope's box and then the lower and the upper
    /// planes along the diagonals.
    fn fields(&self) -> Self::Fields<f32>;
    /// The container with these `fields`.
    fn from_fields(fields: Self::Fields<f32>) -> Self;
    /// `tree` where it is one of boxes, for the passes that need them.
    fn boxes_of(_: &mut Tree<Self>) -> Option<&mut Tree<Aabb>> {
        None
    }
    /// Fields of the smallest container around two, each in all lanes.
    fn union_fields<S: Simd, V: Lanes<S>>(
        simd: S,
        first: &Self::Fields<f32>,
        second: &Self::Fields<f32>,
    ) -> Self::Fields<V>;
    /// Fields of the smallest containers around two, lane by lane.
    fn unions<S: Simd>(simd: S, first: &Self::Fields<f32x8<S>>, second: &Self::Fields<f32x8<S>>) -> Self::Fields<f32x8<S>>;
    /// d(`own`, other) for each lane of `others`: surface area of the union, or a value that increases with it.
    fn merge_distances<S: Simd, V: Lanes<S>>(simd: S, own: &Self::Fields<V>, others: &Self::Fields<V>) -> V;
    /// [`Container::relative_area`](crate::tree::Container::relative_area) of the union of two at a merge distance.
    #[inline(always)]
    fn area_of_distance<S: Simd, V: Lanes<S>>(distance: V) -> V {
        distance
    }
}

impl ClusterContainer for Aabb {
    fn boxes_of(tree: &mut Tree<Self>) -> Option<&mut Tree<Aabb>> {
        Some(tree)
    }

    const USED_FIELDS: usize = 6;
    type Columns = [Vec<f32>; 6];
    const INFINITELY_FAR: [f32; 6] =
        [-f32::INFINITY, -f32::INFINITY, -f32::INFINITY, f32::INFINITY, f32::INFINITY, f32::INFINITY];
    #[inline(always)]
    fn fields(&self) -> [f32; 6] {
        [self.min.x, self.min.y, self.min.z, self.max.x, self.max.y, self.max.z]
    }

    #[inline(always)]
    fn from_fields([ax, ay, az, bx, by, bz]: [f32; 6]) -> Self {
        Self { min: glam::Vec3::new(ax, ay, az), max: glam::Vec3::new(bx, by, bz) }
    }

    #[inline(always)]
    fn union_fields<S: Simd, V: Lanes<S>>(simd: S, first: &[f32; 6], second: &[f32; 6]) -> [V; 6] {
        let mut union = [V::splat(simd, 0.0); 6];
        for field in 0..6 {
            let (a, b) = (V::splat(simd, first[field]), V::splat(simd, second[field]));
            union[field] = if field < 3 { a.min(b) } else { a.max(b) };
        }
        union
    }

    #[inline(always)]
    fn unions<S: Simd>(_: S, first: &[f32x8<S>; 6], second: &[f32x8<S>; 6]) -> [f32x8<S>; 6] {
        let mut unions = *first;
        for field in 0..6 {
            let (a, b) = (first[field], second[field]);
            unions[field] = if field < 3 { a.min(b) } else { a.max(b) };
        }
        unions
    }

    #[inline(always)]
    fn merge_distances<S: Simd, V: Lanes<S>>(_: S, own: &[V; 6], others: &[V; 6]) -> V {
        let x = own[3].max(others[3]) - own[0].min(others[0]);
        let y = own[4].max(others[4]) - own[1].min(others[1]);
        let z = own[5].max(others[5]) - own[2].min(others[2]);
        x * (y + z) + y * z
    }
}

impl ClusterContainer for Sphere {
    const USED_FIELDS: usize = 4;
    type Columns = [Vec<f32>; 6];
    const INFINITELY_FAR: [f32; 6] = [0.0, 0.0, 0.0, f32::INFINITY, 0.0, 0.0];
    #[inline(always)]
    fn fields(&self) -> [f32; 6] {
        [self.center.x, self.center.y, self.center.z, self.radius, 0.0, 0.0]
    }

    #[inline(always)]
    fn from_fields([x, y, z, radius, ..]: [f32; 6]) -> Self {
        Self { center: glam::Vec3::new(x, y, z), radius }
    }

    #[inline(always)]
    fn union_fields<S: Simd, V: Lanes<S>>(simd: S, first: &[f32; 6], second: &[f32; 6]) -> [V; 6] {
        splat_fields::<Self, S, V>(simd, &Self::from_fields(*first).union(&Self::from_fields(*second)).fields())
    }

    #[inline(always)]
    fn unions<S: Simd>(simd: S, first: &[f32x8<S>; 6], second: &[f32x8<S>; 6]) -> [f32x8<S>; 6] {
        let mut unions = [f32x8::splat(simd, 0.0); 6];
        for lane in 0..LANES {
            let [[ax, ay, az, ar, ..], [bx, by, bz, br, ..]] = [first, second];
            let a = Self { center: glam::Vec3::new(ax[lane], ay[lane], az[lane]), radius: ar[lane] };
            let b = Self { center: glam::Vec3::new(bx[lane], by[lane], bz[lane]), radius: br[lane] };
            let union = a.union(&b).fields();
            for field in 0..Self::USED_FIELDS {
                unions[field][lane] = union[field];
            }
        }
        unions
    }

    #[inline(always)]
    fn merge_distances<S: Simd, V: Lanes<S>>(_: S, own: &[V; 6], others: &[V; 6]) -> V {
        let (x, y, z) = (own[0] - others[0], own[1] - others[1], own[2] - others[2]);
        let reach = ((x * x + y * y + z * z).sqrt() + (own[3] + others[3])) * 0.5;
        // The radius increases with the area; a sphere inside the other does not enlarge it.
        reach.max(own[3]).max(others[3])
    }

    #[inline(always)]
    fn area_of_distance<S: Simd, V: Lanes<S>>(radius: V) -> V {
        radius * radius
    }
}

impl ClusterContainer for Dop14 {
    const USED_FIELDS: usize = 14;
    // For lists of presets for fast builds. Where distances take most of the time, little else can be saved.
    const LONGEST_SHORT_LIST: usize = 8;
    type Columns = [Vec<f32>; 14];
    // So large that the area overflows, with planes along the diagonals beyond the corners: infinite ones would give no number.
    const INFINITELY_FAR: [f32; 14] = {
        const FAR: f32 = 1e25;
        let (low, high) = (-4.0 * FAR, 4.0 * FAR);
        [-FAR, -FAR, -FAR, FAR, FAR, FAR, low, low, low, low, high, high, high, high]
    };

    #[inline(always)]
    fn fields(&self) -> [f32; 14] {
        bytemuck::cast(*self)
    }

    #[inline(always)]
    fn from_fields(fields: [f32; 14]) -> Self {
        bytemuck::cast(fields)
    }

    #[inline(always)]
    fn union_fields<S: Simd, V: Lanes<S>>(simd: S, first: &[f32; 14], second: &[f32; 14]) -> [V; 14] {
        let (first, second) = (splat_fields::<Self, S, V>(simd, first), splat_fields::<Self, S, V>(simd, second));
        union_lanes(simd, &first, &second)
    }

    #[inline(always)]
    fn unions<S: Simd>(simd: S, first: &[f32x8<S>; 14], second: &[f32x8<S>; 14]) -> [f32x8<S>; 14] {
        union_lanes(simd, first, second)
    }

    #[inline(always)]
    fn merge_distances<S: Simd, V: Lanes<S>>(simd: S, own: &[V; 14], others: &[V; 14]) -> V {
        areas_of_unions(simd, own, others)
    }
}

/// Half of the surface areas of the smallest polytopes around two, lane by lane. Not inlined: a hundred and fifty instructions, several
/// times for narrow vectors, at each of many places would take longer to compile than all of clustering.
#[inline(never)]
fn areas_of_unions<S: Simd, V: Lanes<S>>(simd: S, own: &[V; 14], others: &[V; 14]) -> V {
    simd.vectorize(
        #[inline(always)]
        || {
            let [ax, ay, az, bx, by, bz, l0, l1, l2, l3, h0, h1, h2, h3] = union_lanes(simd, own, others);
            half_area_between!([ax, ay, az], [bx, by, bz], [l0, l1, l2, l3], [h0, h1, h2, h3], V::splat(simd, 0.0))
        },
    )
}

/// Fields of the smallest polytopes around two, lane by lane.
#[inline(always)]
fn union_lanes<S: Simd, V: Lanes<S>>(simd: S, first: &[V; 14], second: &[V; 14]) -> [V; 14] {
    let mut union = [V::splat(simd, 0.0); 14];
    for field in 0..14 {
        let (a, b) = (first[field], second[field]);
        union[field] = if matches!(field, 0..3 | 6..10) { a.min(b) } else { a.max(b) };
    }
    union
}

/// Copies each of `fields` to all lanes. No closure: one that is not inlined would lack the vector instructions.
#[inline(always)]
pub fn splat_fields<C: ClusterContainer, S: Simd, V: Lanes<S>>(simd: S, fields: &C::Fields<f32>) -> C::Fields<V> {
    let mut lanes = C::Fields::splat(V::splat(simd, 0.0));
    for field in 0..C::USED_FIELDS {
        lanes[field] = V::splat(simd, fields[field]);
    }
    lanes
}

#[cfg(test)]
mod tests {
    use fearless_simd::f32x4;
    use glam::Vec3;

    use super::*;
    use crate::kernel::SimdLevel;
    use crate::kernel::simd::dispatch;

    fn merge_distance<C: ClusterContainer>(own: &C, other: &C) -> f32 {
        dispatch!(SimdLevel::Sse2.level(), simd => {
            let [own, other] = [own, other].map(|container| splat_fields::<C, _, f32x4<_>>(simd, &container.fields()));
            C::merge_distances(simd, &own, &other)[0]
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
    fn the_merge_distance_of_polytopes_is_half_the_area_of_their_union() {
        let point = |point: Vec3| Dop14::of_triangle(&crate::geometry::Triangle { a: point, b: point, c: point });
        let (origin, corner) = (point(Vec3::ZERO), point(Vec3::new(1.0, 1.0, 0.0)));
        // Three pairs of planes run along the diagonal of a square.
        assert!(merge_distance(&origin, &corner) < 1e-4);
        let other = point(Vec3::new(1.0, 0.0, 0.0)).union(&point(Vec3::new(0.0, 1.0, 1.0)));
        let all = origin.union(&corner).union(&other);
        assert_eq!(merge_distance(&origin.union(&corner), &other), all.half_area());
        assert_eq!(merge_distance(&other, &origin.union(&corner)), all.half_area());
        let far = Dop14::from_fields(Dop14::INFINITELY_FAR);
        for near in [origin, all, all.scaled(1e15), all.scaled(1e-15)] {
            assert_eq!(merge_distance(&near, &far), f32::INFINITY, "{near:?}");
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
