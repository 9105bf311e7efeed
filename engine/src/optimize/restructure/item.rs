//! Items of a top-down build: the leaves of the tree that is rebuilt.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use bytemuck::{Pod, Zeroable};
use fearless_simd::{Bytes, Simd, SimdBase, SimdSplit, f32x4, f32x8, u32x4};

use crate::geometry::Aabb;
use crate::tree::Node;

/// A box with primitives in 32 bytes. The upper corner is negated, so that a union is a single minimum of eight lanes,
/// two of which are unused.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct Item {
    min: [f32; 3],
    /// Number of primitives.
    pub count: u32,
    neg_max: [f32; 3],
    /// Index of the first primitive or, with [`NEW_NODE`], of the first child among the new nodes.
    pub first: u32,
}

/// Bit of [`Item::first`] that marks an interior node. Without it the item is a leaf.
pub const NEW_NODE: u32 = 1 << 31;

impl Item {
    pub fn new(container: &Aabb, count: u32, first: u32) -> Self {
        Self { min: container.min.to_array(), count, neg_max: (-container.max).to_array(), first }
    }

    /// The node with this box, its `first` unchanged.
    #[inline(always)]
    pub fn node(&self) -> Node<Aabb> {
        let container = Aabb { min: self.min.into(), max: -glam::Vec3::from(self.neg_max) };
        Node { container, first: self.first, count: self.count }
    }

    /// The item with the box `bounds`.
    #[inline(always)]
    pub fn from_bounds<S: Simd>(bounds: f32x8<S>, count: u32, first: u32) -> Self {
        let mut item = Self::zeroed();
        bounds.store_slice(bytemuck::cast_mut::<_, [f32; 8]>(&mut item));
        Self { count, first, ..item }
    }

    /// The box in all eight lanes.
    #[inline(always)]
    pub fn bounds<S: Simd>(&self, simd: S) -> f32x8<S> {
        f32x8::from_slice(simd, bytemuck::cast_ref::<_, [f32; 8]>(self))
    }

    /// Twice the centre in the first three lanes, which suffices for comparisons; 0 in the last.
    #[inline(always)]
    pub fn doubled_centre<S: Simd>(&self, simd: S) -> f32x4<S> {
        let [min, neg_max] = finite_corners(simd, self.bounds(simd));
        min - neg_max
    }

    /// A coordinate of twice the centre.
    #[inline(always)]
    pub fn doubled_centre_along(&self, axis: usize) -> f32 {
        self.min[axis] - self.neg_max[axis]
    }
}

/// Half the surface areas of three boxes, infinite for empty ones. The last lane is 0.
#[inline(always)]
pub fn half_areas<S: Simd>(simd: S, boxes: &[f32x8<S>; 3]) -> f32x4<S> {
    let mut sizes = [0.0; 16];
    for (size, bounds) in sizes.chunks_exact_mut(4).zip(boxes) {
        let [min, neg_max] = finite_corners(simd, *bounds);
        // Both factors of each product are negated.
        (min + neg_max).store_slice(size);
    }
    let [x, y, z, _] = simd.load_four_interleaved_f32x4(&sizes);
    x * (y + z) + y * z
}

/// Both corners, with 0 in the last lanes, whose bits are not numbers.
#[inline(always)]
fn finite_corners<S: Simd>(simd: S, bounds: f32x8<S>) -> [f32x4<S>; 2] {
    let used = u32x4::from_slice(simd, &[u32::MAX, u32::MAX, u32::MAX, 0]);
    <[f32x4<S>; 2]>::from(bounds.split())
        .map(|v| f32x4::from_bytes((u32x4::from_bytes(v.to_bytes()) & used).to_bytes()))
}
