//! Rays and what they hit.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A half line with the interval of `t` in which hits count. `t` is the distance along `direction`, in multiples of its
/// length; camera rays have unit length.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Where it goes; need not have unit length.
    pub direction: Vec3,
    /// Hits nearer than this do not count.
    pub t_min: f32,
    /// Hits farther than this do not count, nor do those at an infinite distance.
    pub t_max: f32,
}

impl Ray {
    /// A ray without limits in front of its origin.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
    }

    /// The point at `t`.
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}

/// The nearest intersection of a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the ray.
    pub t: f32,
    /// The triangle, as an index into the list that the tree was built from.
    pub primitive_index: u32,
    /// Weight of the triangle's second corner.
    pub u: f32,
    /// Weight of the triangle's third corner.
    pub v: f32,
}
