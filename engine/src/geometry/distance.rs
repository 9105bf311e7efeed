//! Lower bounds of the distance from a point to what a container encloses.
//!
//! Each returns the square of a distance that nothing inside is nearer than, but for the relative rounding that [`reach`] makes room for:
//! 0 inside the container, infinite where it is empty.

use glam::Vec3;

use super::aabb::Aabb;
use super::dop::{DIAGONAL_PAD, Dop14, along_diagonals};
use super::oriented::{ORIENTED_PAD, OrientedBox};
use super::ray_oriented::FARTHEST;
use super::ray_sphere::SPHERE_ENTRY_ERROR;
use super::sphere::Sphere;

/// Reciprocal of the length of a diagonal, √3, rounded down.
pub(crate) const PER_DIAGONAL: f32 = 0.577_35;

/// The largest bound of a container that may hold a point at the squared distance `nearest`: with room for the rounding of five
/// operations (2⁻²² together) and of squares that are no normal numbers.
pub(crate) fn reach(nearest: f64) -> f32 {
    (nearest * (1.0 + 2e-6) + 1e-43) as f32
}

impl Aabb {
    /// Square of the distance from `point` to the box.
    #[inline]
    pub(crate) fn distance_squared(&self, point: Vec3) -> f32 {
        let outside = (self.min - point).max(point - self.max).max(Vec3::ZERO);
        outside.length_squared()
    }
}

impl Sphere {
    /// Square of the distance from `point` to the sphere, less the error that rays have room for, too.
    #[inline]
    pub(crate) fn distance_squared(&self, point: Vec3) -> f32 {
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
}

impl Dop14 {
    /// Square of the largest distance from `point` to the box and to the planes along the diagonals.
    pub(crate) fn distance_squared(&self, point: Vec3) -> f32 {
        let pad = DIAGONAL_PAD * point.abs().element_sum();
        let mut farthest = 0.0_f32;
        for (at, along) in along_diagonals(point).into_iter().enumerate() {
            let outside = (self.low[at] - along).max(along - self.high[at]) - pad;
            farthest = farthest.max(if outside <= f32::MAX { outside * PER_DIAGONAL } else { 0.0 });
        }
        self.bounds.distance_squared(point).max(farthest * farthest)
    }
}

impl OrientedBox {
    /// Square of the largest distance from `point` to the box along the axes and to the planes.
    pub(crate) fn distance_squared(&self, point: Vec3) -> f32 {
        let size = point.abs().element_sum();
        let mut farthest = 0.0_f32;
        if size <= FARTHEST {
            for (at, normal) in self.normals.into_iter().enumerate() {
                let along = normal.dot(point);
                let outside = (self.low[at] - along).max(along - self.high[at]) - ORIENTED_PAD * size;
                let distance = outside / normal.length();
                // A direction too short for its length to be a normal number has no meaning.
                farthest = farthest.max(if distance <= f32::MAX { distance } else { 0.0 });
            }
        }
        self.bounds.distance_squared(point).max(farthest * farthest)
    }
}
