//! What a top-down tree is built of.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use bytemuck::{Pod, Zeroable};
use fearless_simd::{Bytes, Simd, SimdBase, SimdSplit, f32x4, f32x8, u32x4};

use crate::geometry::Aabb;

/// A box and what stands in it: 32 bytes that are moved about as a whole. The upper corner is negated, so that a union is one
/// minimum of eight lanes, two of which do not matter.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct Item {
    min: [f32; 3],
    /// Number of primitives.
    pub count: u32,
    neg_max: [f32; 3],
    /// What it stands for; see [`NEW`].
    pub link: u32,
}

/// In [`Item::link`], beside the number of the new pair below it. Without it the item is a leaf, and its first primitive is there.
pub const NEW: u32 = 1 << 31;

impl Item {
    pub fn new(container: &Aabb, count: u32, link: u32) -> Self {
        Self { min: container.min.to_array(), count, neg_max: (-container.max).to_array(), link }
    }

    pub fn container(&self) -> Aabb {
        Aabb { min: self.min.into(), max: -glam::Vec3::from(self.neg_max) }
    }

    /// The item of `bounds`.
    #[inline(always)]
    pub fn of<S: Simd>(bounds: f32x8<S>, count: u32, link: u32) -> Self {
        let mut item = Self::zeroed();
        bounds.store_slice(bytemuck::cast_mut::<_, [f32; 8]>(&mut item));
        Self { count, link, ..item }
    }

    /// All eight lanes.
    #[inline(always)]
    pub fn bounds<S: Simd>(&self, simd: S) -> f32x8<S> {
        f32x8::from_slice(simd, bytemuck::cast_ref::<_, [f32; 8]>(self))
    }

    /// Twice the middle, which is enough to compare by, in the first three lanes; 0 in the last.
    #[inline(always)]
    pub fn middle<S: Simd>(&self, simd: S) -> f32x4<S> {
        // The last lanes are no numbers to calculate with.
        let [min, neg_max] = <[f32x4<S>; 2]>::from(self.bounds(simd).split());
        let used = u32x4::from_slice(simd, &[u32::MAX, u32::MAX, u32::MAX, 0]);
        let lanes = |v: f32x4<S>| f32x4::from_bytes((u32x4::from_bytes(v.to_bytes()) & used).to_bytes());
        lanes(min) - lanes(neg_max)
    }

    /// One coordinate of twice the middle.
    #[inline(always)]
    pub fn middle_along(&self, axis: usize) -> f32 {
        self.min[axis] - self.neg_max[axis]
    }

    pub fn half_area(&self) -> f32 {
        let [x, y, z] = [0, 1, 2].map(|axis| -(self.min[axis] + self.neg_max[axis]));
        x * (y + z) + y * z
    }
}

/// Half the surface area of the box whose corners are in `bounds`; must not be asked of an empty one.
#[inline(always)]
pub fn half_area<S: Simd>(bounds: f32x8<S>) -> f32 {
    let (min, neg_max) = bounds.split();
    let mut size = [0.0; 4];
    // Negated twice in each product.
    (min + neg_max).store_slice(&mut size);
    size[0] * (size[1] + size[2]) + size[1] * size[2]
}
