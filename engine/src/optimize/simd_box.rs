//! A box in SIMD registers, and what passes over trees need of one: so that a node may have a box in each of several poses.

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

/// A box, or the boxes of a node in several poses, in SIMD registers.
pub trait Bounds: Copy {
    /// Around nothing.
    const EMPTY: Self;
    /// Around both.
    fn union(&self, other: &Self) -> Self;
    /// Half the surface area; must not be empty. Of several boxes their mean.
    fn half_area(&self) -> f32;
}

impl Bounds for SimdBox {
    const EMPTY: Self = Self::EMPTY;

    #[inline(always)]
    fn union(&self, other: &Self) -> Self {
        Self::union(self, other)
    }

    #[inline(always)]
    fn half_area(&self) -> f32 {
        Self::half_area(self)
    }
}

impl<const K: usize> Bounds for [SimdBox; K] {
    const EMPTY: Self = [SimdBox::EMPTY; K];

    #[inline(always)]
    fn union(&self, other: &Self) -> Self {
        std::array::from_fn(|pose| self[pose].union(&other[pose]))
    }

    #[inline(always)]
    fn half_area(&self) -> f32 {
        self.iter().map(SimdBox::half_area).sum::<f32>() / K as f32
    }
}

/// The container of a node as it is kept: a box, or one for each of several poses.
pub trait NodeBounds: Copy + Send + Sync + PartialEq {
    /// The same in SIMD registers.
    type Simd: Bounds;

    fn to_simd(&self) -> Self::Simd;
    fn of_simd(bounds: &Self::Simd) -> Self;

    /// Around both.
    #[inline(always)]
    fn around(&self, other: &Self) -> Self {
        Self::of_simd(&self.to_simd().union(&other.to_simd()))
    }

    /// Half the surface area; of several boxes their mean.
    #[inline(always)]
    fn mean_half_area(&self) -> f32 {
        self.to_simd().half_area()
    }
}

impl NodeBounds for Aabb {
    type Simd = SimdBox;

    #[inline(always)]
    fn to_simd(&self) -> SimdBox {
        SimdBox::new(self)
    }

    #[inline(always)]
    fn of_simd(bounds: &SimdBox) -> Self {
        Self { min: bounds.min.into(), max: bounds.max.into() }
    }

    #[inline(always)]
    fn around(&self, other: &Self) -> Self {
        self.union(other)
    }

    #[inline(always)]
    fn mean_half_area(&self) -> f32 {
        self.half_area()
    }
}

impl<const K: usize> NodeBounds for [Aabb; K] {
    type Simd = [SimdBox; K];

    #[inline(always)]
    fn to_simd(&self) -> Self::Simd {
        self.map(|bounds| SimdBox::new(&bounds))
    }

    #[inline(always)]
    fn of_simd(bounds: &Self::Simd) -> Self {
        bounds.map(|bounds| Aabb::of_simd(&bounds))
    }
}
