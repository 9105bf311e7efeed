//! Spheres.

use glam::{DVec3, Vec3};

use super::aabb::Aabb;
use super::triangle::Triangle;

/// A bounding sphere. A negative radius marks the empty sphere.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Sphere {
    /// The centre.
    pub center: Vec3,
    /// The radius, in world units.
    pub radius: f32,
}

impl Sphere {
    /// The empty sphere; the neutral element of [`Sphere::union`].
    pub const EMPTY: Self = Self { center: Vec3::ZERO, radius: -1.0 };

    /// The smallest sphere around `triangle`: on its longest edge as diameter where it is right or obtuse, on its circumscribed
    /// circle where it is acute.
    pub fn around_triangle(triangle: &Triangle) -> Self {
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

    /// The smallest sphere around both, rounded outwards.
    #[must_use]
    #[inline]
    pub fn union(&self, other: &Self) -> Self {
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

    /// Whether the sphere contains no point.
    pub fn is_empty(&self) -> bool {
        self.radius < 0.0
    }

    /// The smallest box around it.
    pub fn bounds(&self) -> Aabb {
        if self.is_empty() {
            return Aabb::EMPTY;
        }
        let limit = Vec3::splat(f32::MAX);
        let radius = Vec3::splat(self.radius);
        Aabb { min: (self.center - radius).max(-limit), max: (self.center + radius).min(limit) }
    }

    /// Whether `other` lies inside, within `slack` in world units.
    pub fn contains(&self, other: &Self, slack: f32) -> bool {
        let distance = self.center.as_dvec3().distance(other.center.as_dvec3());
        other.is_empty()
            || !self.is_empty() && distance + f64::from(other.radius) <= f64::from(self.radius) + f64::from(slack)
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
pub(super) mod tests {
    use super::*;

    /// Scenes of any size, near and far, and rays of any length: size of what is hit, distance of the origin and length of the
    /// direction.
    pub(in crate::geometry) const SCALES: [(f32, f32, f32); 8] = [
        (1.0, 1.0, 1.0),
        (1.0, 1e3, 1.0),
        (1.0, 1e6, 1e-12),
        (1e-12, 1e-12, 1e16),
        (1e-21, 1e-20, 1e18),
        (1e-30, 1e-29, 1e18),
        (1e-12, 1.0, 1e-18),
        (1e15, 1e17, 1e18),
    ];

    /// A fixed sequence of numbers between -1 and 1.
    pub(in crate::geometry) fn numbers() -> impl FnMut() -> f32 {
        let mut state = 1_u32;
        move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        }
    }

    fn triangles(scale: f32, offset: f32) -> Vec<Triangle> {
        let mut number = numbers();
        let mut corner = || Vec3::new(number(), number(), number()) * scale + Vec3::splat(offset);
        (0..300).map(|_| Triangle { a: corner(), b: corner(), c: corner() }).collect()
    }

    #[test]
    fn a_triangles_sphere_holds_its_corners_and_is_small() {
        for (scale, offset) in [(1.0, 0.0), (1e-3, 100.0), (1e30, 0.0), (f32::MAX, 0.0), (1e-30, 0.0), (1e-42, 0.0)] {
            for triangle in triangles(scale, offset) {
                let sphere = Sphere::around_triangle(&triangle);
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
                    let sphere = Sphere::around_triangle(&Triangle { a, b, c });
                    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
                    assert!((sphere.radius - longest * 0.5).abs() < 1e-6, "{a} {b} {c} → {sphere:?}");
                }
            }
        }
    }

    #[test]
    fn a_union_holds_both_and_is_the_smallest() {
        for scale in [1.0, 1e-3, 1e30, 1e-30] {
            let spheres: Vec<Sphere> = triangles(scale, 0.0).iter().map(Sphere::around_triangle).collect();
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
}
