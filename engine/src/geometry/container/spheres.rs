//! Spheres as containers.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use super::{Container, ContainerKind, line_entering};
use crate::geometry::aabb::Aabb;
use crate::geometry::prepared_ray::PreparedRay;
use crate::geometry::ray::Ray;
use crate::geometry::sphere::{SPHERE_ENTRY_ERROR, SPHERE_SQUARE_ERROR, SPHERE_T_ERROR, SPHERE_TINY_RADIUS, Sphere};
use crate::geometry::triangle::Triangle;

impl Container for Sphere {
    const KIND: ContainerKind = ContainerKind::Sphere;
    type RayPart = ();
    const EMPTY: Self = Self { center: Vec3::ZERO, radius: -1.0 };

    /// On its longest edge as diameter where it is right or obtuse, on its circumscribed circle where it is acute.
    fn of_triangle(triangle: &Triangle) -> Self {
        let [a, b, c] = [triangle.a, triangle.b, triangle.c].map(Vec3::as_dvec3);
        let (ab, bc, ca) = ((b - a).length_squared(), (c - b).length_squared(), (a - c).length_squared());
        let longest = ab.max(bc).max(ca);
        let center = if 2.0 * longest >= ab + bc + ca {
            // Obtuse, right or degenerate: the longest edge is a diameter.
            if longest == ab {
                (a + b) * 0.5
            } else if longest == bc {
                (b + c) * 0.5
            } else {
                (c + a) * 0.5
            }
        } else {
            // Acute: barycentric weights of the circumcentre, all positive.
            let (wa, wb, wc) = (bc * (ab + ca - bc), ca * (ab + bc - ca), ab * (bc + ca - ab));
            (a * wa + b * wb + c * wc) / (wa + wb + wc)
        };
        let center = center.as_vec3();
        // Measured from the rounded centre, so that rounding cannot leave a corner outside.
        let exact = center.as_dvec3();
        let squared = exact.distance_squared(a).max(exact.distance_squared(b)).max(exact.distance_squared(c));
        Self { center, radius: round_up(squared.sqrt()) }
    }

    /// Rounded outwards.
    #[inline]
    fn union(&self, other: &Self) -> Self {
        let (large, small) = if self.radius >= other.radius { (self, other) } else { (other, self) };
        if small.is_empty() {
            return *large;
        }
        let offset = small.center - large.center;
        let squared = offset.length_squared();
        if !SAFE_SQUARES.contains(&squared) {
            return large.union_of_any(small);
        }
        let distance = squared.sqrt();
        if (distance + small.radius) * ROUND_UP <= large.radius {
            return *large;
        }
        // The far ends of both lie on the line through the centres.
        let radius = 0.5 * (distance + large.radius + small.radius);
        let center = large.center + offset * (0.5 + 0.5 * ((small.radius - large.radius) / distance));
        // Rounding leaves neither outside: the distances to the centre are off by less than 12 epsilons of the radius, and the
        // centre itself by half an epsilon of each coordinate. Measuring from the rounded centre would take twice as long.
        Self { center, radius: radius * ROUND_FAR_UP + center.abs().element_sum() * (0.625 * f32::EPSILON) }
    }

    #[inline]
    fn relative_area(&self) -> f32 {
        if self.is_empty() { 0.0 } else { self.radius * self.radius }
    }

    #[inline]
    fn scaled(&self, factor: f32) -> Self {
        Self { center: self.center * factor, radius: self.radius * factor }
    }

    #[inline(always)]
    fn ray_part(_: &PreparedRay) {}

    /// Errs towards hits: a ray that meets anything inside the sphere enters it no later.
    #[inline(always)]
    fn entry(&self, ray: &PreparedRay, (): &(), t_min: f32, t_max: f32) -> Option<f32> {
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

    /// Less the error that rays have room for, too.
    #[inline]
    fn distance_squared(&self, point: Vec3) -> f32 {
        if self.is_empty() {
            return f32::INFINITY;
        }
        let to_center = self.center - point;
        let distance = to_center.length();
        // Squares that leave the range of single precision say nothing.
        if distance > f32::MAX {
            return 0.0;
        }
        let outside = distance - self.radius - SPHERE_ENTRY_ERROR * (to_center.abs().element_sum() + self.radius);
        outside.max(0.0) * outside.max(0.0)
    }

    fn bounds(&self) -> Aabb {
        if self.is_empty() {
            return Aabb::EMPTY;
        }
        let limit = Vec3::splat(f32::MAX);
        let radius = Vec3::splat(self.radius);
        Aabb { min: (self.center - radius).max(-limit), max: (self.center + radius).min(limit) }
    }

    fn contains_point(&self, point: Vec3, slack: f32) -> bool {
        self.contains(&Sphere { center: point, radius: 0.0 }, slack)
    }

    fn contains(&self, other: &Self, slack: f32) -> bool {
        let distance = self.center.as_dvec3().distance(other.center.as_dvec3());
        other.is_empty()
            || !self.is_empty() && distance + f64::from(other.radius) <= f64::from(self.radius) + f64::from(slack)
    }

    fn intersection_area(&self, other: &Self) -> f32 {
        self.lens(other).map_or(0.0, |lens| (lens.area / (4.0 * PI)) as f32)
    }

    fn intersection_bounds(&self, other: &Self) -> Self {
        self.lens(other).map_or(Self::EMPTY, |lens| lens.bounds)
    }

    fn random_line(&self, mut random: impl FnMut() -> f64) -> Ray {
        let radius = f64::from(self.radius.max(0.0));
        let (z, angle) = (2.0 * random() - 1.0, TAU * random());
        let (sin, cos) = angle.sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        let outward = DVec3::new(r * cos, r * sin, z);
        line_entering(self.center.as_dvec3() + outward * radius, -outward, 2.0 * radius, random)
    }
}

impl Sphere {
    /// [`Sphere::union`] where squares of distances leave the range of `f32`; `self` is not smaller than `small`.
    #[cold]
    fn union_of_any(&self, small: &Self) -> Self {
        let (large_center, small_center) = (self.center.as_dvec3(), small.center.as_dvec3());
        let (large_radius, small_radius) = (f64::from(self.radius), f64::from(small.radius));
        let offset: DVec3 = small_center - large_center;
        let distance = offset.length();
        if distance + small_radius <= large_radius {
            return *self;
        }
        let radius = 0.5 * (distance + large_radius + small_radius);
        let center = (large_center + offset * ((radius - large_radius) / distance)).as_vec3();
        let exact = center.as_dvec3();
        let reach = (exact.distance(large_center) + large_radius).max(exact.distance(small_center) + small_radius);
        Self { center, radius: round_up(reach) }
    }
}

/// Squared lengths whose square roots have full precision, also where a tenth of the length is squared again.
const SAFE_SQUARES: std::ops::Range<f32> = 1e-16..1e30;
/// Bound of the rounding of a difference, its length, a sum and this product.
const ROUND_UP: f32 = 1.0 + 3.0 * f32::EPSILON;
/// Bound of the rounding of a union's arithmetic: two distances, a division, three sums and products.
const ROUND_FAR_UP: f32 = 1.0 + 20.0 * f32::EPSILON;

/// The next larger `f32`, saturating at the largest finite one. Zero stays zero: the next number would be denormal, and sums with
/// those take many times as long.
#[inline]
fn round_up(radius: f64) -> f32 {
    if radius == 0.0 { 0.0 } else { (radius as f32).next_up().min(f32::MAX) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::sphere::tests::{SCALES, numbers};

    fn triangles(scale: f32, offset: f32) -> Vec<Triangle> {
        let mut number = numbers();
        let mut corner = || Vec3::new(number(), number(), number()) * scale + Vec3::splat(offset);
        (0..300).map(|_| Triangle { a: corner(), b: corner(), c: corner() }).collect()
    }

    #[test]
    fn a_triangles_sphere_holds_its_corners_and_is_small() {
        for (scale, offset) in [(1.0, 0.0), (1e-3, 100.0), (1e30, 0.0), (f32::MAX, 0.0), (1e-30, 0.0), (1e-42, 0.0)] {
            for triangle in triangles(scale, offset) {
                let sphere = Sphere::of_triangle(&triangle);
                assert!(sphere.center.is_finite() && sphere.radius.is_finite(), "{triangle:?} → {sphere:?}");
                for corner in [triangle.a, triangle.b, triangle.c] {
                    assert!(
                        sphere.contains(&Sphere { center: corner, radius: 0.0 }, 0.0) || sphere.radius == f32::MAX,
                        "{triangle:?} → {sphere:?}"
                    );
                }
                if scale == 1.0 {
                    let [a, b, c] =
                        [triangle.a - triangle.b, triangle.b - triangle.c, triangle.c - triangle.a].map(Vec3::length);
                    // Jung: no smallest circle is larger than this.
                    assert!(sphere.radius <= a.max(b).max(c) / 3.0_f32.sqrt() * 1.0001, "{triangle:?} → {sphere:?}");
                }
            }
        }
    }

    #[test]
    fn flat_triangles_have_finite_spheres() {
        let points = [Vec3::ZERO, Vec3::X, Vec3::X * 2.0, Vec3::NEG_X];
        for a in points {
            for b in points {
                for c in points {
                    let sphere = Sphere::of_triangle(&Triangle { a, b, c });
                    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
                    assert!((sphere.radius - longest * 0.5).abs() < 1e-6, "{a} {b} {c} → {sphere:?}");
                }
            }
        }
    }

    #[test]
    fn a_union_holds_both_and_is_the_smallest() {
        for scale in [1.0, 1e-3, 1e30, 1e-30] {
            let spheres: Vec<Sphere> = triangles(scale, 0.0).iter().map(Sphere::of_triangle).collect();
            for pair in spheres.windows(2) {
                let union = pair[0].union(&pair[1]);
                assert!(union.contains(&pair[0], 0.0) && union.contains(&pair[1], 0.0), "{pair:?} → {union:?}");
                let (a, b) = (pair[0], pair[1]);
                let distance = a.center.as_dvec3().distance(b.center.as_dvec3());
                let (ra, rb) = (f64::from(a.radius), f64::from(b.radius));
                let exact = (0.5 * (distance + ra + rb)).max(ra).max(rb);
                // The bound of what rounding may have done is some twenty epsilons.
                assert!(f64::from(union.radius) <= exact * 1.000_003, "{pair:?} → {union:?}");
                assert_eq!(union, pair[1].union(&pair[0]), "the order does not matter");
            }
            assert_eq!(spheres[0].union(&Sphere::EMPTY), spheres[0]);
            assert_eq!(Sphere::EMPTY.union(&spheres[0]), spheres[0]);
            assert_eq!(spheres[0].union(&spheres[0]), spheres[0]);
        }
    }

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
                let entry = sphere.entry(&ray, &(), 0.0, f32::INFINITY);
                assert!(entry.is_some_and(|t| (0.0..=reached).contains(&t)), "{sphere:?} {ray:?} → {entry:?}");
            }
        }
    }

    #[test]
    fn rays_beside_or_away_from_a_sphere_miss() {
        let sphere = Sphere { center: Vec3::new(5.0, 0.0, 0.0), radius: 1.0 };
        let ray = |direction: Vec3| PreparedRay::new(Ray::new(Vec3::ZERO, direction));
        let hit = sphere.entry(&ray(Vec3::X * 2.0), &(), 0.0, 10.0);
        assert!(hit.is_some_and(|t| (t - 2.0).abs() < 1e-4), "{hit:?}");
        assert_eq!(sphere.entry(&ray(Vec3::NEG_X), &(), 0.0, 100.0), None, "behind");
        assert_eq!(sphere.entry(&ray(Vec3::X), &(), 0.0, 3.5), None, "too far");
        assert_eq!(sphere.entry(&ray(Vec3::X), &(), 6.5, 10.0), None, "passed already");
        assert_eq!(sphere.entry(&ray(Vec3::new(5.0, 1.1, 0.0)), &(), 0.0, 10.0), None, "beside");
        assert_eq!(Sphere::EMPTY.entry(&ray(Vec3::X), &(), 0.0, 10.0), None, "empty");
        assert_eq!(
            sphere.entry(&PreparedRay::new(Ray::new(sphere.center, Vec3::X)), &(), 0.25, 10.0),
            Some(0.25),
            "inside"
        );
    }
}
