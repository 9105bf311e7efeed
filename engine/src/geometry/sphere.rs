//! Spheres.

use glam::{DVec3, Vec3};

use crate::geometry::{Aabb, Triangle};

/// A sphere. A negative radius marks the empty sphere.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Sphere {
    /// The middle.
    pub center: Vec3,
    /// The distance from the middle to the surface, in world units.
    pub radius: f32,
}

impl Sphere {
    /// The sphere that holds nothing; the neutral element of [`Sphere::union`].
    pub const EMPTY: Self = Self { center: Vec3::ZERO, radius: -1.0 };

    /// The smallest sphere around `triangle`: that of its longest edge where it is right or obtuse, of its circumscribed
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
        // From the rounded middle, so that rounding cannot leave a corner outside.
        let exact = center.as_dvec3();
        let squared = exact.distance_squared(a).max(exact.distance_squared(b)).max(exact.distance_squared(c));
        Self { center, radius: round_up(squared.sqrt()) }
    }

    /// The smallest sphere around both, up to rounding: never smaller.
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
        // The far ends of both lie on the line through the middles.
        let radius = 0.5 * (distance + large.radius + small.radius);
        let center = large.center + offset * (0.5 + 0.5 * ((small.radius - large.radius) / distance));
        // Rounding leaves neither outside: the distances to the middle are off by less than 12 epsilons of the radius, and the
        // middle itself by half an epsilon of each coordinate. Measuring them from there would take twice as long.
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

    /// Whether the sphere holds no point.
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

/// Squared lengths whose roots are as exact as numbers of their size, also where a tenth of the length is squared again.
const SAFE_SQUARES: std::ops::Range<f32> = 1e-16..1e30;
/// More than a difference, its length, a sum and this product round by.
const ROUND_UP: f32 = 1.0 + 3.0 * f32::EPSILON;
/// More than all of a union's arithmetic rounds by: two distances, a division, three sums and products.
const ROUND_FAR_UP: f32 = 1.0 + 20.0 * f32::EPSILON;

/// The next larger `f32`, saturating at the largest finite one. A point stays one: the next would be denormal, and sums
/// with those take many times as long.
#[inline]
fn round_up(radius: f64) -> f32 {
    if radius == 0.0 { 0.0 } else { (radius as f32).next_up().min(f32::MAX) }
}
