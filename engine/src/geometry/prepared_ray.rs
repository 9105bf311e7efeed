//! Per-ray values that every container and triangle test needs, computed once.

use glam::Vec3;

use super::ray::Ray;

/// Distance, in world units, by which a ray parallel to a slab is moved between its planes where the origin is zero. Multiplied
/// by the largest number it still exceeds the distance of any hit.
pub(crate) const PARALLEL_PAD: f32 = 1e-14;

/// A ray with precomputed reciprocals, for container and triangle tests.
#[derive(Debug, Clone, Copy)]
pub struct PreparedRay {
    /// The ray itself. A negative `t_min` counts as 0; a ray that cannot hit anything (see [`PreparedRay::can_hit`])
    /// has an empty interval.
    pub ray: Ray,
    /// 1 / direction, per axis. Always finite: the largest number where the direction is zero, so that no slab test ever
    /// computes 0·∞.
    pub inverse_direction: Vec3,
    /// Origin for tests against the lower planes of slabs: moved up a little on axes where the direction is zero, so that a ray
    /// in the very plane of a face lies between the planes.
    pub origin_low: Vec3,
    /// Origin for tests against the upper planes of slabs: moved down a little on axes where the direction is zero.
    pub origin_high: Vec3,
    /// The direction scaled to length 1. Spheres are tested with it, so that products with long or short directions stay within
    /// the range of `f32`.
    pub unit_direction: Vec3,
    /// 1 / length of the direction; converts world units into `t`.
    pub inverse_length: f32,
    /// Origins in the lane order of [`Container::entry_pair`](crate::geometry::Container::entry_pair), for two boxes at once: low (x, x, y, y),
    /// low and high (z, z, x, x), high (y, y, z, z).
    pub(crate) pair_origins: [[f32; 4]; 3],
    /// The inverse direction in the same lane order.
    pub(crate) pair_inverses: [[f32; 4]; 3],
}

impl PreparedRay {
    /// Prepares `ray`. A direction of zero, NaN or infinite length, an origin that is not finite and an interval that is
    /// empty or ends at NaN all give a ray that misses everything; one that begins at NaN begins at 0.
    #[inline]
    pub fn new(ray: Ray) -> Self {
        Self::widened(ray, Vec3::ZERO)
    }

    /// [`PreparedRay::new`] for a ray that enters slabs as if they were wider by `widening` on both sides of each axis.
    #[inline]
    pub(crate) fn widened(ray: Ray, widening: Vec3) -> Self {
        // A hit has a finite distance. NaN passes through.
        let t_max = if ray.t_max > f32::MAX { f32::MAX } else { ray.t_max };
        let mut ray = Ray { t_min: ray.t_min.max(0.0), t_max, ..ray };
        let direction_squared = ray.direction.length_squared();
        // NaN fails each comparison.
        let usable = direction_squared.is_normal() && ray.origin.is_finite() && ray.t_min <= ray.t_max;
        if !usable {
            ray.t_min = 0.0;
            ray.t_max = f32::NEG_INFINITY;
        }
        let d = ray.direction;
        let reciprocal = d.recip();
        let parallel = !reciprocal.is_finite_mask();
        let inverse_direction = Vec3::select(parallel, Vec3::MAX, reciprocal);
        let pad = Vec3::select(parallel, ray.origin.abs() * (2.0 * f32::EPSILON) + PARALLEL_PAD, Vec3::ZERO) + widening;
        let inverse_length = direction_squared.sqrt().recip();
        let (origin_low, origin_high) = (ray.origin + pad, ray.origin - pad);
        let (l, h, i) = (origin_low, origin_high, inverse_direction);
        Self {
            ray,
            inverse_direction,
            origin_low,
            origin_high,
            unit_direction: d * inverse_length,
            inverse_length,
            pair_origins: [[l.x, l.x, l.y, l.y], [l.z, l.z, h.x, h.x], [h.y, h.y, h.z, h.z]],
            pair_inverses: [[i.x, i.x, i.y, i.y], [i.z, i.z, i.x, i.x], [i.y, i.y, i.z, i.z]],
        }
    }

    /// Whether it can hit anything: direction and origin are finite, the direction's square neither 0 nor too small for a
    /// normal number, and `t_min <= t_max`.
    pub fn can_hit(&self) -> bool {
        self.ray.t_min <= self.ray.t_max
    }
}

/// The matrix that turns a ray into the z axis (Woop, Benthin, Wald: *Watertight Ray/Triangle Intersection*, JCGT 2013,
/// section 3): a shear along the longest axis of the direction. Apart from [`PreparedRay`] because most rays that miss
/// never need it.
#[derive(Debug, Clone, Copy)]
pub struct Shear {
    /// Each row has a one, a factor and a zero, so that a dot product with it rounds as the paper's permuted form does.
    pub rows: [Vec3; 3],
}

impl Shear {
    /// The shear of rays in direction `d`.
    #[inline]
    pub fn new(d: Vec3) -> Self {
        let size = d.abs();
        let rows = if size.x >= size.y && size.x >= size.z {
            [Vec3::new(-d.y / d.x, 1.0, 0.0), Vec3::new(-d.z / d.x, 0.0, 1.0), Vec3::new(1.0 / d.x, 0.0, 0.0)]
        } else if size.y >= size.z {
            [Vec3::new(0.0, -d.z / d.y, 1.0), Vec3::new(1.0, -d.x / d.y, 0.0), Vec3::new(0.0, 1.0 / d.y, 0.0)]
        } else {
            [Vec3::new(1.0, 0.0, -d.x / d.z), Vec3::new(0.0, 1.0, -d.y / d.z), Vec3::new(0.0, 0.0, 1.0 / d.z)]
        };
        Self { rows }
    }
}
