//! Containers as agglomerative clustering sees them: fields in SIMD lanes, their union and their merge distance.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "several arrays are indexed by the same field")]

use std::ops::IndexMut;

use fearless_simd::Simd;

use crate::geometry::{Aabb, Container as _, Dop14, Sphere, half_area_between};
use crate::kernel::lanes::{Fields, Lanes};
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
    /// Fields of the smallest containers around two, lane by lane.
    fn unions<S: Simd, V: Lanes<S>>(simd: S, first: &Self::Fields<V>, second: &Self::Fields<V>) -> Self::Fields<V>;
    /// Fields of the smallest container around two, each in all lanes.
    #[inline(always)]
    fn union_fields<S: Simd, V: Lanes<S>>(
        simd: S,
        first: &Self::Fields<f32>,
        second: &Self::Fields<f32>,
    ) -> Self::Fields<V> {
        Self::unions(simd, &splat_fields::<Self, S, V>(simd, first), &splat_fields::<Self, S, V>(simd, second))
    }
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
    fn unions<S: Simd, V: Lanes<S>>(_: S, first: &[V; 6], second: &[V; 6]) -> [V; 6] {
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
    fn unions<S: Simd, V: Lanes<S>>(_: S, first: &[V; 6], second: &[V; 6]) -> [V; 6] {
        let mut unions = *first;
        for lane in 0..V::LEN {
            let [[ax, ay, az, ar, ..], [bx, by, bz, br, ..]] = [first, second];
            let a = Self { center: glam::Vec3::new(ax[lane], ay[lane], az[lane]), radius: ar[lane] };
            let b = Self { center: glam::Vec3::new(bx[lane], by[lane], bz[lane]), radius: br[lane] };
            let union = a.union(&b).fields();
            for field in 0..Self::USED_FIELDS {
                unions[field].as_mut_slice()[lane] = union[field];
            }
        }
        unions
    }

    /// Of one pair, as lane by lane takes as long for each.
    #[inline(always)]
    fn union_fields<S: Simd, V: Lanes<S>>(simd: S, first: &[f32; 6], second: &[f32; 6]) -> [V; 6] {
        splat_fields::<Self, S, V>(simd, &Self::from_fields(*first).union(&Self::from_fields(*second)).fields())
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
    fn unions<S: Simd, V: Lanes<S>>(_: S, first: &[V; 14], second: &[V; 14]) -> [V; 14] {
        let mut unions = *first;
        for field in 0..14 {
            let (a, b) = (first[field], second[field]);
            unions[field] = if matches!(field, 0..3 | 6..10) { a.min(b) } else { a.max(b) };
        }
        unions
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
            let [ax, ay, az, bx, by, bz, l0, l1, l2, l3, h0, h1, h2, h3] = Dop14::unions(simd, own, others);
            half_area_between!([ax, ay, az], [bx, by, bz], [l0, l1, l2, l3], [h0, h1, h2, h3], V::splat(simd, 0.0))
        },
    )
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
    use fearless_simd::{SimdBase as _, f32x4, f32x8};
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

    /// Containers of small triangles, some of them inside others.
    fn containers<C: ClusterContainer>(seed: u32) -> [C; 8] {
        let mut state = seed;
        let mut number = |below: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((state >> 16) % below) as f32 * 0.37
        };
        std::array::from_fn(|_| {
            let mut corner = || Vec3::new(number(9), number(7), number(5));
            C::of_triangle(&crate::geometry::Triangle { a: corner(), b: corner(), c: corner() })
        })
    }

    fn unions_are_those_of_pairs<C: ClusterContainer + std::fmt::Debug>() {
        for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
            for seed in 0..200 {
                let (first, second) = (containers::<C>(seed), containers::<C>(seed + 1000));
                dispatch!(level.level(), simd => {
                    let lanes = |containers: &[C; 8]| {
                        let mut lanes = C::Fields::splat(f32x8::splat(simd, 0.0));
                        for field in 0..C::USED_FIELDS {
                            lanes[field] = f32x8::from_fn(simd, |lane| containers[lane].fields()[field]);
                        }
                        lanes
                    };
                    let unions = C::unions(simd, &lanes(&first), &lanes(&second));
                    for lane in 0..8 {
                        let expected = first[lane].union(&second[lane]);
                        let pair = C::union_fields::<_, f32x4<_>>(simd, &first[lane].fields(), &second[lane].fields());
                        for field in 0..C::USED_FIELDS {
                            let all = [unions[field][lane], pair[field][0], pair[field][3]];
                            assert_eq!(all, [expected.fields()[field]; 3], "{expected:?}, {level:?}, field {field}");
                        }
                    }
                });
            }
        }
    }

    #[test]
    fn unions_lane_by_lane_are_those_of_single_pairs() {
        unions_are_those_of_pairs::<Aabb>();
        unions_are_those_of_pairs::<Sphere>();
        unions_are_those_of_pairs::<Dop14>();
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
