//! Triangles.

use glam::Vec3;

use super::aabb::Aabb;

/// A triangle: three corners in world space.
///
/// ```
/// use bvhscope_engine::Triangle;
/// use bvhscope_engine::glam::Vec3;
///
/// let triangle = Triangle { a: Vec3::ZERO, b: Vec3::X * 2.0, c: Vec3::Y };
/// assert_eq!(triangle.bounds().extent(), Vec3::new(2.0, 1.0, 0.0));
/// assert_eq!(0.5 * triangle.scaled_normal().length(), 1.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Triangle {
    /// First corner.
    pub a: Vec3,
    /// Second corner.
    pub b: Vec3,
    /// Third corner.
    pub c: Vec3,
}

impl Triangle {
    /// The smallest box around it.
    pub fn bounds(&self) -> Aabb {
        Aabb { min: self.a.min(self.b).min(self.c), max: self.a.max(self.b).max(self.c) }
    }

    /// Whether every coordinate is finite.
    pub fn is_finite(&self) -> bool {
        self.a.is_finite() && self.b.is_finite() && self.c.is_finite()
    }

    /// The normal, right-handed, with a length of twice the area.
    pub fn scaled_normal(&self) -> Vec3 {
        (self.b - self.a).cross(self.c - self.a)
    }
}
