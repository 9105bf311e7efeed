//! What a top-down tree is built of.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use bytemuck::{Pod, Zeroable};
use fearless_simd::{Bytes, Simd, SimdBase, SimdSplit, f32x4, f32x8, u32x4};

use crate::geometry::Aabb;
use crate::tree::Node;

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

/// In [`Item::link`], beside the number of the first of the new nodes below it. Without it the item is a leaf, and its first primitive
/// is there.
pub const NEW: u32 = 1 << 31;

impl Item {
    pub fn new(container: &Aabb, count: u32, link: u32) -> Self {
        Self { min: container.min.to_array(), count, neg_max: (-container.max).to_array(), link }
    }

    /// The node with this box; `first` is the link as it is.
    #[inline(always)]
    pub fn node(&self) -> Node<Aabb> {
        let container = Aabb { min: self.min.into(), max: -glam::Vec3::from(self.neg_max) };
        Node { container, first: self.link, count: self.count }
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
        let [min, neg_max] = numbers(simd, self.bounds(simd));
        min - neg_max
    }

    /// One coordinate of twice the middle.
    #[inline(always)]
    pub fn middle_along(&self, axis: usize) -> f32 {
        self.min[axis] - self.neg_max[axis]
    }
}

/// Half the surface areas of three boxes; of empty ones infinite. The last lane is 0.
#[inline(always)]
pub fn half_areas<S: Simd>(simd: S, boxes: &[f32x8<S>; 3]) -> f32x4<S> {
    let mut sizes = [0.0; 16];
    for (size, bounds) in sizes.chunks_exact_mut(4).zip(boxes) {
        let [min, neg_max] = numbers(simd, *bounds);
        // Negated twice in each product.
        (min + neg_max).store_slice(size);
    }
    let [x, y, z, _] = simd.load_four_interleaved_f32x4(&sizes);
    x * (y + z) + y * z
}

/// Both halves of `bounds`, with 0 in the last lanes, which are no numbers to calculate with.
#[inline(always)]
fn numbers<S: Simd>(simd: S, bounds: f32x8<S>) -> [f32x4<S>; 2] {
    let used = u32x4::from_slice(simd, &[u32::MAX, u32::MAX, u32::MAX, 0]);
    <[f32x4<S>; 2]>::from(bounds.split())
        .map(|v| f32x4::from_bytes((u32x4::from_bytes(v.to_bytes()) & used).to_bytes()))
}
