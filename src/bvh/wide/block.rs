//! Four triangles side by side, tested as [`Triangle::intersect`] tests one.

use bytemuck::{Pod, Zeroable};
use fearless_simd::{Simd, SimdBase, SimdMask, f32x4};
use glam::Vec3;

use crate::geometry::{EDGE_MAX, EDGE_MIN, PreparedRay, Ray, Shear, Triangle, TriangleHit};

/// Triangles of a block.
pub const BLOCK: usize = 4;

/// Up to four triangles; lanes beyond the last one repeat it.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct TriangleBlock {
    /// Corner, axis, lane.
    pub(super) corners: [[[f32; BLOCK]; 3]; 3],
    /// Each lane's index in the list that the tree was built from; the highest bit of the first one marks the last block
    /// of its leaf.
    indices: [u32; BLOCK],
}

/// Marks the last block of a leaf.
const LAST: u32 = 1 << 31;

impl TriangleBlock {
    /// A block of those of `triangles` that have the given indices, one to four.
    #[inline]
    pub(super) fn new(triangles: &[Triangle], indices: &[u32], is_last: bool) -> Self {
        let last = indices.len() - 1;
        let indices = [indices[0], indices[last.min(1)], indices[last.min(2)], indices[last]];
        let of = |lane: usize| &triangles[indices[lane] as usize];
        let (a, b, c, d) = (of(0), of(1), of(2), of(3));
        let row = |corner: fn(&Triangle) -> Vec3, axis: usize| {
            [corner(a)[axis], corner(b)[axis], corner(c)[axis], corner(d)[axis]]
        };
        let mark = if is_last { LAST } else { 0 };
        Self {
            corners: [
                each!(axis => row(|triangle| triangle.a, axis)),
                each!(axis => row(|triangle| triangle.b, axis)),
                each!(axis => row(|triangle| triangle.c, axis)),
            ],
            indices: [indices[0] | mark, indices[1], indices[2], indices[3]],
        }
    }

    /// Whether its leaf ends with it.
    #[inline(always)]
    pub(super) fn is_last(&self) -> bool {
        self.indices[0] & LAST != 0
    }

    /// The index of a lane's triangle in the list that the tree was built from.
    #[inline(always)]
    pub fn primitive_index(&self, lane: usize) -> u32 {
        self.indices[lane % BLOCK] & !LAST
    }

    /// A lane's triangle.
    #[inline]
    pub fn triangle(&self, lane: usize) -> Triangle {
        let corner = |corner: usize| Vec3::from_array(self.corners[corner].map(|axis| axis[lane % BLOCK]));
        Triangle { a: corner(0), b: corner(1), c: corner(2) }
    }
}

/// The axis along which rays in direction `d` are sheared, as [`Shear::new`] chooses it, after the two others.
#[inline(always)]
pub(super) fn permuted_axes(d: Vec3) -> [usize; 3] {
    let size = d.abs();
    if size.x >= size.y && size.x >= size.z {
        [1, 2, 0]
    } else if size.y >= size.z {
        [2, 0, 1]
    } else {
        [0, 1, 2]
    }
}

/// What a single ray's tests against blocks share.
pub(super) struct BlockRay<S: Simd> {
    axes: [usize; 3],
    origin: [f32x4<S>; 3],
    /// The factors of [`Shear`]'s rows.
    factors: [f32x4<S>; 3],
}

impl<S: Simd> BlockRay<S> {
    #[inline(always)]
    pub(super) fn new(simd: S, ray: &Ray) -> Self {
        let d = ray.direction;
        let axes = permuted_axes(d);
        let along = d[axes[2]];
        let factors = [-d[axes[0]] / along, -d[axes[1]] / along, 1.0 / along];
        Self {
            axes,
            origin: each!(part => f32x4::splat(simd, ray.origin[axes[part]])),
            factors: each!(part => f32x4::splat(simd, factors[part])),
        }
    }

    /// Offers each triangle of `block` that the ray meets up to `t_max()` to `found`, which returns whether to go on.
    #[inline(always)]
    pub(super) fn test(
        &self,
        simd: S,
        block: &TriangleBlock,
        ray: &PreparedRay,
        t_max: f32,
        mut found: impl FnMut(TriangleHit, u32),
    ) {
        let [x, y, z] = each!(part => each!(corner => {
            f32x4::load_array_ref(simd, &block.corners[corner][self.axes[part]]) - self.origin[part]
        }));
        let x = each!(corner => z[corner] * self.factors[0] + x[corner]);
        let y = each!(corner => z[corner] * self.factors[1] + y[corner]);
        let weights = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
        let zero = f32x4::splat(simd, 0.0);
        let least = weights[0].min(weights[1]).min(weights[2]);
        let most = weights[0].max(weights[1]).max(weights[2]);
        let candidates = !(least.simd_lt(zero) & most.simd_gt(zero));
        if !candidates.any_true() {
            return;
        }
        let size = each!(corner => weights[corner].abs());
        let smallest = size[0].min(size[1]).min(size[2]);
        let largest = size[0].max(size[1]).max(size[2]);
        let exact = smallest.simd_gt(f32x4::splat(simd, EDGE_MIN)) & largest.simd_lt(f32x4::splat(simd, EDGE_MAX));
        let scale = f32x4::splat(simd, 1.0) / (weights[0] + weights[1] + weights[2]);
        let shares = each!(corner => weights[corner] * scale);
        let depth = each!(corner => z[corner] * self.factors[2]);
        let t = shares[0] * depth[0] + shares[1] * depth[1] + shares[2] * depth[2];
        let within = t.simd_ge(f32x4::splat(simd, ray.ray.t_min)) & t.simd_le(f32x4::splat(simd, t_max));
        let unclear = candidates & !exact;
        let mut hits = (candidates & (within | unclear)).to_bitmask() as u32;
        if hits == 0 {
            return;
        }
        let unclear = unclear.to_bitmask() as u32;
        let (t, u, v) = (t.to_array(), shares[1].to_array(), shares[2].to_array());
        while hits != 0 {
            let lane = hits.trailing_zeros() as usize % BLOCK;
            hits &= hits - 1;
            let triangle = block.triangle(lane);
            let hit = if unclear >> lane & 1 != 0 {
                triangle.intersect(ray, &Shear::new(ray.ray.direction), t_max)
            } else {
                triangle.hit_in_box(ray, TriangleHit { t: t[lane], u: u[lane], v: v[lane] }, t_max)
            };
            if let Some(hit) = hit {
                found(hit, block.primitive_index(lane));
            }
        }
    }
}
