//! Rays and their hits. A miss is `None` wherever a hit is returned, and an infinite distance within the traversals.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A ray with the interval of `t` in which hits count. `t` is the distance along `direction`, in multiples of its length.
///
/// ```
/// use bvhscope_engine::Ray;
/// use bvhscope_engine::glam::Vec3;
///
/// let shadow = Ray { t_min: 1e-4, t_max: 1.0, ..Ray::new(Vec3::ZERO, Vec3::new(0.0, 3.0, 0.0)) };
/// assert_eq!(shadow.at(shadow.t_max), Vec3::new(0.0, 3.0, 0.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Ray {
    /// Start of the ray.
    pub origin: Vec3,
    /// Direction of the ray, of any length.
    pub direction: Vec3,
    /// Smallest distance at which hits count; negative values and NaN mean 0.
    pub t_min: f32,
    /// Largest distance at which hits count. Hits at an infinite distance never do.
    pub t_max: f32,
}

impl Ray {
    /// A ray from `origin` to infinity.
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
    /// Distance along the ray, in lengths of its direction.
    pub t: f32,
    /// Index of the triangle in the list that the tree was built from.
    pub primitive_index: u32,
    /// Barycentric weight of the triangle's second corner.
    pub u: f32,
    /// Barycentric weight of the triangle's third corner.
    pub v: f32,
}
