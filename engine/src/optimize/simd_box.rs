//! A box in SIMD registers.

use glam::Vec3A;

use crate::geometry::Aabb;

/// A box in SIMD registers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimdBox {
    pub min: Vec3A,
    pub max: Vec3A,
}

impl SimdBox {
    /// The empty box.
    pub const EMPTY: Self = Self { min: Vec3A::INFINITY, max: Vec3A::NEG_INFINITY };

    #[inline(always)]
    pub fn new(container: &Aabb) -> Self {
        Self { min: container.min.into(), max: container.max.into() }
    }

    #[inline(always)]
    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Half the surface area; the box must not be empty.
    #[inline(always)]
    pub fn half_area(&self) -> f32 {
        let d = self.max - self.min;
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}
