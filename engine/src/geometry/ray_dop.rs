//! Intersection of rays with polytopes.

use glam::Vec4;

use super::dop::{DIAGONAL_PAD, Dop14, along_diagonals};
use super::intersect::FAR_SLACK;
use super::prepared_ray::{PARALLEL_PAD, PreparedRay};

/// A ray as tests against the planes along the diagonals need it.
#[derive(Debug, Clone, Copy)]
pub struct DiagonalRay {
    /// Origin along each diagonal for tests against the lower planes, moved up by a pad.
    low: Vec4,
    /// The same against the upper planes, moved down.
    high: Vec4,
    /// Reciprocals of the direction along each diagonal; the largest number where that is 0.
    inverse: Vec4,
}

impl DiagonalRay {
    /// The part of `ray`.
    pub fn new(ray: &PreparedRay) -> Self {
        let [origin, direction] = [ray.ray.origin, ray.ray.direction].map(along_diagonals).map(Vec4::from_array);
        let reciprocal = direction.recip();
        let parallel = !reciprocal.is_finite_mask();
        let inverse = Vec4::select(parallel, Vec4::MAX, reciprocal);
        // The sums are rounded. At the point that a ray hits, its distance times the error of its direction is no more than the rounding
        // of that point's coordinates and of the origin's.
        let pad = DIAGONAL_PAD * ray.ray.origin.abs().element_sum();
        let pad = Vec4::splat(if parallel.any() { pad + PARALLEL_PAD } else { pad });
        Self { low: origin + pad, high: origin - pad, inverse }
    }
}

impl Dop14 {
    /// [`Container::entry`](super::Container::entry), inlined for the one place where a call would cost.
    #[inline(always)]
    pub(crate) fn entry_inlined(
        &self,
        ray: &PreparedRay,
        diagonals: &DiagonalRay,
        t_min: f32,
        t_max: f32,
    ) -> Option<f32> {
        let t0 = (Vec4::from_array(self.low) - diagonals.low) * diagonals.inverse;
        let t1 = (Vec4::from_array(self.high) - diagonals.high) * diagonals.inverse;
        let near = t0.min(t1).max_element();
        let far = t0.max(t1).min_element() * FAR_SLACK;
        let entry = self.bounds.entry(ray, if near > t_min { near } else { t_min }, t_max)?;
        (entry <= far).then_some(entry)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::geometry::sphere::tests::{SCALES, numbers};
    use crate::geometry::{Container as _, Ray, Triangle};

    fn entry(polytope: &Dop14, ray: Ray, t_min: f32, t_max: f32) -> Option<f32> {
        let ray = PreparedRay::new(ray);
        polytope.entry(&ray, &DiagonalRay::new(&ray), t_min, t_max)
    }

    #[test]
    fn a_ray_to_a_point_of_a_triangle_enters_before_it() {
        let mut number = numbers();
        for (size, distance, length) in SCALES {
            let mut point = |scale: f32| Vec3::new(number(), number(), number()) * scale;
            for case in 0..2_000 {
                let a = point(size);
                let thin = if case % 2 == 0 { 1.0 } else { 1e-3 };
                let triangle = Triangle { a, b: point(size), c: a + point(size) * thin };
                let polytope = Dop14::of_triangle(&triangle);
                let weights = point(1.0).abs();
                let weights = weights / weights.element_sum();
                let inside = triangle.a * weights.x + triangle.b * weights.y + triangle.c * weights.z;
                // Some rays lie in a plane of the polytope.
                let offset = point(distance);
                let offset = if case % 3 == 0 { offset.with_z(offset.x + offset.y) } else { offset };
                let from = inside + offset;
                let towards = (inside - from).normalize_or(Vec3::X) * length;
                let reached = from.distance(inside) / length * 1.000_001 + f32::MIN_POSITIVE;
                let found = entry(&polytope, Ray::new(from, towards), 0.0, f32::INFINITY);
                // The box is exact, and its points are where the arithmetic above left them.
                let in_box = polytope.bounds.entry(&PreparedRay::new(Ray::new(from, towards)), 0.0, f32::INFINITY);
                assert!(
                    in_box.is_none() || found.is_some_and(|t| (0.0..=reached).contains(&t)),
                    "{triangle:?} {from} {towards} → {found:?}"
                );
            }
        }
    }

    #[test]
    fn rays_beside_or_away_from_a_polytope_miss() {
        // An octahedron around (5, 0, 0).
        let at = Vec3::X * 5.0;
        let polytope = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| Triangle { a: at - axis, b: at + axis, c: at });
        let polytope = polytope.map(|triangle| Dop14::of_triangle(&triangle));
        let polytope = polytope.iter().fold(Dop14::EMPTY, |all, one| all.union(one));
        let ray = |direction: Vec3| Ray::new(Vec3::ZERO, direction);
        let hit = entry(&polytope, ray(Vec3::X * 2.0), 0.0, 10.0);
        assert!(hit.is_some_and(|t| (t - 2.0).abs() < 1e-4), "{hit:?}");
        let askew = Ray::new(Vec3::new(0.0, 0.5, 0.0), Vec3::X);
        let hit = entry(&polytope, askew, 0.0, 10.0);
        assert!(hit.is_some_and(|t| (t - 4.5).abs() < 1e-4), "through a slanted face: {hit:?}");
        assert_eq!(entry(&polytope, ray(Vec3::NEG_X), 0.0, 100.0), None, "behind");
        assert_eq!(entry(&polytope, ray(Vec3::X), 0.0, 3.5), None, "too far");
        assert_eq!(entry(&polytope, ray(Vec3::X), 6.5, 10.0), None, "passed already");
        let past_a_corner = Ray::new(Vec3::new(0.0, 0.7, 0.7), Vec3::X);
        assert_eq!(entry(&polytope, past_a_corner, 0.0, 10.0), None, "through the box's corner");
        assert!(polytope.bounds.entry(&PreparedRay::new(past_a_corner), 0.0, 10.0).is_some());
        assert_eq!(entry(&Dop14::EMPTY, ray(Vec3::X), 0.0, 10.0), None, "empty");
        assert_eq!(entry(&polytope, Ray::new(at, Vec3::X), 0.25, 10.0), Some(0.25), "inside");
        let along_a_face = Ray::new(Vec3::new(4.5, 0.5, 0.0), Vec3::new(1.0, -1.0, 0.0));
        assert!(entry(&polytope, along_a_face, 0.0, 10.0).is_some(), "in the plane of a face");
    }
}
