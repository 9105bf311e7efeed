//! Ray-sphere intersection.

use super::prepared_ray::PreparedRay;
use super::sphere::Sphere;

/// Bound of the relative error of a ray-sphere test: about seven roundings.
pub(crate) const SPHERE_ENTRY_ERROR: f32 = 4e-7;
/// Bound of the absolute error of a difference of two squares, whose relative error is bounded only for normal numbers.
pub(crate) const SPHERE_SQUARE_ERROR: f32 = f32::MIN_POSITIVE;
/// Radius below which the square is no longer a normal number.
pub(crate) const SPHERE_TINY_RADIUS: f32 = 1e-18;
/// Bound of the absolute error of `t`, whose relative error is bounded only for normal numbers.
pub(crate) const SPHERE_T_ERROR: f32 = f32::MIN_POSITIVE;

impl Sphere {
    /// Entry distance of a ray, at least `t_min`; `None` where it misses or enters beyond `t_max`. Errs towards hits: a ray that
    /// meets anything inside the sphere enters it no later.
    #[inline(always)]
    pub fn entry(&self, ray: &PreparedRay, t_min: f32, t_max: f32) -> Option<f32> {
        if self.is_empty() {
            return None;
        }
        // The distance from the centre to the ray's nearest point, rather than the quadratic formula, stays exact for small
        // spheres far away (Haines et al., *Precision Improvements for Ray/Sphere Intersection*, Ray Tracing Gems, 2019).
        // In world units up to the end: in `t` they would underflow for long directions.
        let to_center = self.center - ray.ray.origin;
        let along = to_center.dot(ray.unit_direction);
        let nearest = to_center - ray.unit_direction * along;
        let radius = self.radius + SPHERE_ENTRY_ERROR * (to_center.abs().element_sum() + self.radius);
        let inside = radius * radius - nearest.length_squared() + SPHERE_SQUARE_ERROR;
        // Comparisons with NaN are false: it counts as a hit.
        if inside < 0.0 {
            return None;
        }
        let half_chord = if radius < SPHERE_TINY_RADIUS { radius } else { inside.sqrt() };
        let half_chord = half_chord + SPHERE_ENTRY_ERROR * (along.abs() + half_chord);
        let near = (along - half_chord) * ray.inverse_length - SPHERE_T_ERROR;
        let far = (along + half_chord) * ray.inverse_length + SPHERE_T_ERROR;
        // `f32::max` drops a NaN in favour of `t_min`.
        if far < t_min || near > t_max || t_min > t_max { None } else { Some(near.max(t_min)) }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::geometry::ray::Ray;
    use crate::geometry::sphere::tests::{SCALES, numbers};

    #[test]
    fn a_ray_to_a_point_inside_enters_before_it() {
        let mut number = numbers();
        for (size, distance, length) in SCALES {
            let mut point = |scale: f32| Vec3::new(number(), number(), number()) * scale;
            for _ in 0..2_000 {
                let sphere = Sphere { center: point(size), radius: point(size).x.abs() * 0.1 };
                let direction = point(1.0).normalize_or(Vec3::X);
                let inside = sphere.center + direction.any_orthonormal_vector() * sphere.radius * point(1.0).x;
                let from = inside + point(distance);
                let towards = (inside - from).normalize_or(Vec3::X) * length;
                let reached = from.distance(inside) / length * 1.000_001 + f32::MIN_POSITIVE;
                let ray = PreparedRay::new(Ray::new(from, towards));
                let entry = sphere.entry(&ray, 0.0, f32::INFINITY);
                assert!(entry.is_some_and(|t| (0.0..=reached).contains(&t)), "{sphere:?} {ray:?} → {entry:?}");
            }
        }
    }

    #[test]
    fn rays_beside_or_away_from_a_sphere_miss() {
        let sphere = Sphere { center: Vec3::new(5.0, 0.0, 0.0), radius: 1.0 };
        let ray = |direction: Vec3| PreparedRay::new(Ray::new(Vec3::ZERO, direction));
        let hit = sphere.entry(&ray(Vec3::X * 2.0), 0.0, 10.0);
        assert!(hit.is_some_and(|t| (t - 2.0).abs() < 1e-4), "{hit:?}");
        assert_eq!(sphere.entry(&ray(Vec3::NEG_X), 0.0, 100.0), None, "behind");
        assert_eq!(sphere.entry(&ray(Vec3::X), 0.0, 3.5), None, "too far");
        assert_eq!(sphere.entry(&ray(Vec3::X), 6.5, 10.0), None, "passed already");
        assert_eq!(sphere.entry(&ray(Vec3::new(5.0, 1.1, 0.0)), 0.0, 10.0), None, "beside");
        assert_eq!(Sphere::EMPTY.entry(&ray(Vec3::X), 0.0, 10.0), None, "empty");
        assert_eq!(sphere.entry(&PreparedRay::new(Ray::new(sphere.center, Vec3::X)), 0.25, 10.0), Some(0.25), "inside");
    }
}
