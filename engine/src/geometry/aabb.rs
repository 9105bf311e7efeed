//! Axis-aligned boxes.

use glam::Vec3;

/// An axis-aligned bounding box. Empty where `min` exceeds `max` on any axis.
///
/// ```
/// use bvhscope_engine::Aabb;
/// use bvhscope_engine::glam::Vec3;
///
/// let unit = Aabb::around([Vec3::ZERO, Vec3::ONE]);
/// let beside = Aabb { min: Vec3::X, max: Vec3::new(2.0, 1.0, 1.0) };
/// assert_eq!(unit.union(&beside).extent(), Vec3::new(2.0, 1.0, 1.0));
/// assert_eq!(unit.half_area(), 3.0);
/// assert_eq!(Aabb::EMPTY.union(&unit), unit);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Aabb {
    /// The corner with the smallest coordinates.
    pub min: Vec3,
    /// The corner with the largest coordinates.
    pub max: Vec3,
}

impl Aabb {
    /// The empty box; the neutral element of [`Aabb::union`].
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The smallest box around `points`; [`Aabb::EMPTY`] for none.
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Self {
        points
            .into_iter()
            .fold(Self::EMPTY, |bounds, point| Self { min: bounds.min.min(point), max: bounds.max.max(point) })
    }

    /// The smallest box around both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The intersection of both; empty where they do not touch.
    #[must_use]
    pub fn intersection(&self, other: &Self) -> Self {
        Self { min: self.min.max(other.min), max: self.max.min(other.max) }
    }

    /// Whether the box contains no point.
    pub fn is_empty(&self) -> bool {
        !(self.min.cmple(self.max).all())
    }

    /// The centre of the box.
    pub fn center(&self) -> Vec3 {
        (self.min + self.max) * 0.5
    }

    /// Edge lengths; zero for the empty box.
    pub fn extent(&self) -> Vec3 {
        if self.is_empty() { Vec3::ZERO } else { self.max - self.min }
    }

    /// Half of the surface area, which is enough where only ratios matter. Zero for the empty box.
    pub fn half_area(&self) -> f32 {
        let d = self.extent();
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    /// Whether `other` lies inside, within `slack` in world units.
    pub fn contains(&self, other: &Self, slack: f32) -> bool {
        other.is_empty()
            || (self.min - Vec3::splat(slack)).cmple(other.min).all()
                && (self.max + Vec3::splat(slack)).cmpge(other.max).all()
    }
}
