//! Long and thin triangles, whose hits take double precision.
//!
//! The watertight test interpolates the distance of a hit from those of the corners, by weights whose errors grow as the
//! longest edge over the height. For needles the distance of the plane is taken instead, which their neighbours' hits agree with.

use fearless_simd::{Select, Simd, SimdBase, SimdMask, SimdNarrow, SimdWiden, f32x16, f64x8, mask32x16};
use glam::{DVec3, Vec3};

use super::ray::Ray;
use super::triangle::Triangle;

/// Square of an edge over twice the area, from which a triangle is a needle. Found by experiment: with 32 to 48 no hit in ellipsoids
/// along the axes was off by more than a millionth, with 64 some were; in architecture 6 % of all hits are then on needles.
pub(crate) const NEEDLE_ASPECT: f32 = 48.0;

/// The plane of a triangle as seen from the origin of rays.
pub(crate) struct ExactPlane {
    normal: DVec3,
    /// Distance of the origin from the plane, in lengths of the normal.
    offset: f64,
}

impl ExactPlane {
    /// The plane of `triangle`, seen from `origin`.
    #[inline(always)]
    pub(crate) fn new(triangle: &Triangle, origin: Vec3) -> Self {
        let [a, b, c] = [triangle.a, triangle.b, triangle.c].map(Vec3::as_dvec3);
        let normal = (b - a).cross(c - a);
        Self { normal, offset: normal.dot(a - origin.as_dvec3()) }
    }

    /// Distance of the plane in lengths of `direction`, unless that is parallel to it; `approximate` otherwise.
    #[inline(always)]
    pub(crate) fn distance(&self, direction: Vec3, approximate: f32) -> f32 {
        let along = self.normal.dot(direction.as_dvec3());
        if along == 0.0 { approximate } else { (self.offset / along) as f32 }
    }

    /// [`ExactPlane::distance`] for sixteen directions, given by axis.
    #[inline(always)]
    pub(crate) fn distances<S: Simd>(&self, simd: S, directions: [f32x16<S>; 3], approximate: f32x16<S>) -> f32x16<S> {
        let normal = self.normal.to_array().map(|part| f64x8::splat(simd, part));
        let [x, y, z] = directions.map(f32x16::widen);
        let along =
            [x.0 * normal[0] + y.0 * normal[1] + z.0 * normal[2], x.1 * normal[0] + y.1 * normal[1] + z.1 * normal[2]];
        let parallel = along.map(|along| along.simd_eq(f64x8::splat(simd, 0.0)).to_bitmask());
        let [low, high] = along.map(|along| f64x8::splat(simd, self.offset) / along);
        let parallel = mask32x16::from_bitmask(simd, parallel[0] | parallel[1] << 8);
        parallel.select(approximate, low.narrow(high))
    }
}

impl Triangle {
    /// Whether distances of hits are taken from the plane. Wide trees compute the same in [`write_leaf`](crate::wide::leaves::write_leaf).
    #[inline(always)]
    pub(crate) fn is_needle(&self) -> bool {
        let (ab, ac) = (self.b - self.a, self.c - self.a);
        let normal = ab.cross(ac).abs();
        let longest_squared = ab.length_squared().max(ac.length_squared());
        normal.max_element() * NEEDLE_ASPECT < longest_squared
    }

    /// Distance of its plane along `ray`, no nearer and no farther than the `depths` of its corners; see [`ExactPlane::distance`].
    #[inline(always)]
    pub(crate) fn needle_distance(&self, ray: &Ray, approximate: f32, depths: [f32; 2]) -> f32 {
        ExactPlane::new(self, ray.origin).distance(ray.direction, approximate).max(depths[0]).min(depths[1])
    }
}
