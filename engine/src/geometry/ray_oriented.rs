//! Intersection of rays with oriented boxes.

use glam::Vec3;

use super::oriented::ORIENTED_PAD;
use super::prepared_ray::PreparedRay;
use super::ray::Ray;

/// Sum of an origin's absolute coordinates above which dot products with it may leave the range of single precision.
pub(crate) const FARTHEST: f32 = 1e37;

/// A ray as tests against planes askew need it.
#[derive(Debug, Clone, Copy)]
pub struct OrientedRay {
    pub(crate) origin: Vec3,
    pub(crate) direction: Vec3,
    /// Distance by which the origin is moved between the planes, in lengths of their directions.
    pub(crate) pad: f32,
}

impl OrientedRay {
    /// The part of `ray`. One from so far away that dot products could overflow enters every box.
    pub fn new(ray: &PreparedRay) -> Self {
        let Ray { origin, direction, .. } = ray.ray;
        let size = origin.abs().element_sum();
        if size <= FARTHEST {
            return Self { origin, direction, pad: ORIENTED_PAD * size };
        }
        Self { origin: Vec3::ZERO, direction: Vec3::ZERO, pad: f32::MAX }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::sphere::tests::{SCALES, numbers};
    use crate::geometry::{Aabb, Container as _, Extremes, OrientedBox, OrientedKind, Ray, Triangle, intervals};

    fn entry(container: &OrientedBox, ray: Ray, t_min: f32, t_max: f32) -> Option<f32> {
        let ray = PreparedRay::new(ray);
        container.entry(&ray, &OrientedRay::new(&ray), t_min, t_max)
    }

    fn around(points: &[Vec3]) -> OrientedBox {
        let extremes = Extremes::around(points.iter().copied()).expect("there are points");
        let bounds = Aabb::around(points.iter().copied());
        OrientedBox::choose(bounds, &extremes, true, |normals| intervals(points.iter().copied(), normals))
    }

    #[test]
    fn a_ray_to_a_point_of_a_triangle_enters_before_it() {
        let mut number = numbers();
        let mut kinds = [0; 3];
        // Some too small to be turned, some so far away that rays enter every box.
        let scales = SCALES.into_iter().chain([(1e-19, 1e-18, 1e18), (1.0, 1e37, 1.0), (1.0, 2e38, 1.0)]);
        for (size, distance, length) in scales {
            let mut point = |scale: f32| Vec3::new(number(), number(), number()) * scale;
            for case in 0..3_000 {
                let a = point(size);
                let thin = if case % 2 == 0 { 1.0 } else { 1e-3 };
                let mut triangle = Triangle { a, b: point(size), c: a + point(size) * thin };
                let mut container = OrientedBox::of_triangle(&triangle);
                if case % 5 == 0 {
                    // One in a skewed box.
                    let [u, v, w] = point(size).to_array();
                    let edges = [Vec3::X * u, Vec3::new(v, v, 0.0), Vec3::new(w, 0.0, w)];
                    let corner =
                        |at: usize| (0..3).filter(|edge| at >> edge & 1 == 1).map(|edge| edges[edge]).sum::<Vec3>() + a;
                    let corners: [Vec3; 8] = std::array::from_fn(corner);
                    container = around(&corners);
                    triangle = Triangle {
                        a: corners[case / 5 % 8],
                        b: corners[(case / 5 + 3) % 8],
                        c: corners[(case / 5 + 6) % 8],
                    };
                }
                kinds[container.kind() as usize] += 1;
                let weights = point(1.0).abs();
                let weights = weights / weights.element_sum();
                let inside = triangle.a * weights.x + triangle.b * weights.y + triangle.c * weights.z;
                // Some rays lie in a plane of the box, where they come from rounding alone.
                let offset = point(distance);
                let normal = container.normals[case % 3].normalize();
                let offset = if case % 3 == 0 { offset - normal * offset.dot(normal) } else { offset };
                let from = inside + offset;
                let towards = (inside - from).normalize_or(Vec3::X) * length;
                let reached = from.distance(inside) / length * 1.000_001 + f32::MIN_POSITIVE;
                let found = entry(&container, Ray::new(from, towards), 0.0, f32::INFINITY);
                // The plain box is exact, and its points are where the arithmetic above left them.
                let in_box = container.bounds.entry(&PreparedRay::new(Ray::new(from, towards)), 0.0, f32::INFINITY);
                let is_early = found.is_some_and(|t| (0.0..=reached).contains(&t));
                assert!(in_box.is_none() || is_early, "{triangle:?} {container:?} {from} {towards} → {found:?}");
            }
        }
        assert!(kinds[OrientedKind::Fitted as usize].min(kinds[OrientedKind::Skewed as usize]) > 1_000, "{kinds:?}");
    }

    #[test]
    fn rays_beside_or_away_from_a_box_miss() {
        // A rod along the diagonal of the x-y plane.
        let ends = [Vec3::ZERO, Vec3::new(4.0, 4.0, 0.0)];
        let rod = Triangle { a: ends[0], b: ends[1], c: ends[0] + Vec3::Z * 0.1 };
        let container = OrientedBox::of_triangle(&rod);
        let ray = |from: Vec3, direction: Vec3| Ray::new(from, direction);
        let through = ray(Vec3::new(3.0, 0.0, 0.02), Vec3::Y);
        let hit = entry(&container, through, 0.0, 10.0);
        assert!(hit.is_some_and(|t| (t - 3.0).abs() < 1e-2), "{hit:?}");
        assert_eq!(entry(&container, through, 0.0, 2.5), None, "too far");
        assert_eq!(entry(&container, through, 3.5, 10.0), None, "passed already");
        assert_eq!(entry(&container, ray(Vec3::new(3.0, 0.0, 0.02), Vec3::NEG_Y), 0.0, 10.0), None, "behind");
        let beside = ray(Vec3::new(3.0, 1.0, -1.0), Vec3::Z);
        assert_eq!(entry(&container, beside, 0.0, 10.0), None, "through the plain box alone");
        assert!(container.bounds.entry(&PreparedRay::new(beside), 0.0, 10.0).is_some());
        assert_eq!(entry(&container, ray(Vec3::ONE * 2.0, Vec3::new(1.0, 1.0, 0.0)), 0.0, 10.0), None, "parallel");
        assert!(entry(&container, ray(Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, 1.0, 0.0)), 0.0, 10.0).is_some());
        assert_eq!(entry(&OrientedBox::EMPTY, through, 0.0, 10.0), None, "empty");
        // A flat plain box is exact: the origin must be moved off its plane for a ray in it.
        let flat = OrientedBox::plain(Aabb { min: Vec3::new(1.0, -1.0, 0.0), max: Vec3::new(2.0, 1.0, 0.0) });
        assert_eq!(entry(&flat, ray(Vec3::ZERO, Vec3::X), 0.0, 10.0), Some(1.0), "in the plane of a flat box");
        let far = ray(Vec3::splat(2e38), Vec3::NEG_ONE);
        assert_eq!(entry(&OrientedBox::EMPTY, far, 0.0, 10.0), None, "empty, from afar");
        assert_eq!(entry(&container, far, 0.5, 10.0), Some(0.5), "from afar every box is entered");
    }
}
