//! Triangles.

use glam::Vec3;

use super::aabb::Aabb;

/// Edges whose fourth powers are normal numbers in single precision.
const SHORTEST: f32 = 1e-7;
const LONGEST: f32 = 1e9;

/// A triangle: three corners in world space.
///
/// ```
/// use bvhscope_engine::Triangle;
/// use bvhscope_engine::glam::Vec3;
///
/// let triangle = Triangle { a: Vec3::ZERO, b: Vec3::X * 2.0, c: Vec3::Y };
/// assert_eq!(triangle.bounds().extent(), Vec3::new(2.0, 1.0, 0.0));
/// assert_eq!(triangle.area(), 1.0);
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
    /// The triangle between two opposite corners of a box, which has that very box: its stand-in where a tree is built over boxes.
    pub fn across(bounds: &Aabb) -> Self {
        Self { a: bounds.min, b: bounds.max, c: bounds.min }
    }

    /// The smallest box around it.
    pub fn bounds(&self) -> Aabb {
        Aabb { min: self.a.min(self.b).min(self.c), max: self.a.max(self.b).max(self.c) }
    }

    /// Whether every coordinate is finite.
    pub fn is_finite(&self) -> bool {
        self.a.is_finite() && self.b.is_finite() && self.c.is_finite()
    }

    /// The surface area; in double precision where edges are so short or long that squares of their products leave the range of single
    /// precision.
    pub fn area(&self) -> f64 {
        let size = self.bounds().extent().max_element();
        if (SHORTEST..LONGEST).contains(&size) {
            return f64::from(self.scaled_normal().length()) * 0.5;
        }
        let [a, b, c] = [self.a, self.b, self.c].map(Vec3::as_dvec3);
        (b - a).cross(c - a).length() * 0.5
    }

    /// The normal, right-handed, with a length of twice the area.
    pub fn scaled_normal(&self) -> Vec3 {
        (self.b - self.a).cross(self.c - self.a)
    }
}
