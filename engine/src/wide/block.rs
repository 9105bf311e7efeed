//! Four triangles side by side, tested as [`Triangle::intersect`] tests one.

use bytemuck::{Pod, Zeroable};
use fearless_simd::{Simd, SimdBase, SimdMask, f32x4, mask32x4};
use glam::Vec3;

use crate::geometry::{EDGE_MAX, EDGE_MIN, FAR_SLACK, PreparedRay, Ray, Shear, Triangle, TriangleHit};
use crate::kernel::each;
use crate::tree::traverse::Nearest;
use crate::wide::layout::BLOCK;
use crate::wide::ray_lanes::RayLanes;

/// Up to four triangles; lanes beyond the last one repeat it.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct TriangleBlock {
    /// Corner, axis, lane.
    pub(crate) corners: [[[f32; BLOCK]; 3]; 3],
    /// Each lane's index in the list that the tree was built from; the highest bit of the first one marks the last block
    /// of its leaf.
    indices: [u32; BLOCK],
}

/// Marks the last block of a leaf.
const LAST: u32 = 1 << 31;

impl TriangleBlock {
    /// A block of those of `triangles` that have the given indices, one to four.
    #[inline]
    pub(crate) fn new(triangles: &[Triangle], indices: &[u32], is_last: bool) -> Self {
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
    pub(crate) fn is_last(&self) -> bool {
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
pub(crate) fn permuted_axes(d: Vec3) -> [usize; 3] {
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
pub(crate) struct BlockRay<'a, S: Simd, const N: usize> {
    rays: &'a RayLanes<N>,
    /// The ray's number.
    at: usize,
    /// Where in a corner's numbers each axis of the shear begins.
    axes: [usize; 3],
    origin: [f32x4<S>; 3],
    /// The factors of [`Shear`]'s rows.
    factors: [f32x4<S>; 3],
    t_min: f32x4<S>,
}

impl<'a, S: Simd, const N: usize> BlockRay<'a, S, N> {
    /// Ray number `at`.
    #[inline(always)]
    pub(crate) fn new(simd: S, rays: &'a RayLanes<N>, at: usize) -> Self {
        let at = at % N;
        Self {
            rays,
            at,
            axes: each!(part => rays.axes[part][at] as usize),
            origin: each!(part => f32x4::splat(simd, rays.sheared_origin[part][at])),
            factors: each!(part => f32x4::splat(simd, rays.factors[part][at])),
            t_min: f32x4::splat(simd, rays.t_min[at]),
        }
    }

    /// Offers each triangle of `block` that the ray meets to `nearest`. `whole_ray` is what it was made of.
    #[inline(always)]
    pub(crate) fn test(&self, simd: S, block: &TriangleBlock, whole_ray: &Ray, nearest: &mut Nearest) {
        let t_max = nearest.t();
        let Some(meeting) = self.meeting(simd, block, t_max) else { return };
        let (entered, entry) = self.enters(simd, block, t_max);
        let mut hits = (meeting.certain & entered).to_bitmask() as u32;
        let mut unclear = meeting.unclear.to_bitmask() as u32;
        if hits != 0 {
            let t = meeting.t.max(entry).to_array();
            let [u, v] = [meeting.shares[1].to_array(), meeting.shares[2].to_array()];
            while hits != 0 {
                let lane = hits.trailing_zeros() as usize % BLOCK;
                hits &= hits - 1;
                nearest.offer(TriangleHit { t: t[lane], u: u[lane], v: v[lane] }, block.primitive_index(lane));
            }
        }
        while unclear != 0 {
            let lane = unclear.trailing_zeros() as usize % BLOCK;
            unclear &= unclear - 1;
            if let Some(hit) = unclear_hit(block, lane, whole_ray, t_max) {
                nearest.offer(hit, block.primitive_index(lane));
            }
        }
    }

    /// Whether the ray meets any triangle of `block` up to `t_max`. `whole_ray` is what it was made of.
    #[inline(always)]
    pub(crate) fn meets(&self, simd: S, block: &TriangleBlock, whole_ray: &Ray, t_max: f32) -> bool {
        let Some(meeting) = self.meeting(simd, block, t_max) else { return false };
        if (meeting.certain & self.enters(simd, block, t_max).0).any_true() {
            return true;
        }
        let unclear = meeting.unclear.to_bitmask() as u32;
        unclear != 0
            && (0..BLOCK).any(|lane| unclear >> lane & 1 != 0 && unclear_hit(block, lane, whole_ray, t_max).is_some())
    }

    /// Where the ray meets the triangles' planes; `None` where it passes all triangles.
    #[inline(always)]
    fn meeting(&self, simd: S, block: &TriangleBlock, t_max: f32) -> Option<Meeting<S>> {
        let splat = |value| f32x4::splat(simd, value);
        let numbers: &[f32; 10 * BLOCK] = bytemuck::cast_ref(block);
        let [x, y, z] = each!(part => each!(corner => {
            let at = 3 * BLOCK * corner + (self.axes[part] & (3 * BLOCK));
            f32x4::from_slice(simd, &numbers[at..][..BLOCK]) - self.origin[part]
        }));
        let x = each!(corner => z[corner] * self.factors[0] + x[corner]);
        let y = each!(corner => z[corner] * self.factors[1] + y[corner]);
        let weights = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
        let least = weights[0].min(weights[1]).min(weights[2]);
        let most = weights[0].max(weights[1]).max(weights[2]);
        let candidates = !(least.simd_lt(splat(0.0)) & most.simd_gt(splat(0.0)));
        if !candidates.any_true() {
            return None;
        }
        let size = each!(corner => weights[corner].abs());
        let smallest = size[0].min(size[1]).min(size[2]);
        let largest = size[0].max(size[1]).max(size[2]);
        let exact = smallest.simd_gt(splat(EDGE_MIN)) & largest.simd_lt(splat(EDGE_MAX));
        let scale = splat(1.0) / (weights[0] + weights[1] + weights[2]);
        let shares = each!(corner => weights[corner] * scale);
        let depth = each!(corner => z[corner] * self.factors[2]);
        let t = shares[0] * depth[0] + shares[1] * depth[1] + shares[2] * depth[2];
        let within = t.simd_ge(self.t_min) & t.simd_le(splat(t_max));
        Some(Meeting { t, shares, certain: candidates & exact & within, unclear: candidates & !exact })
    }

    /// The triangles of a block whose own box the ray enters up to `t_max`, and where: [`Triangle::hit_in_box`].
    #[inline(always)]
    fn enters(&self, simd: S, block: &TriangleBlock, t_max: f32) -> (mask32x4<S>, f32x4<S>) {
        let splat = |value| f32x4::splat(simd, value);
        let corner = |corner: usize, axis: usize| f32x4::load_array_ref(simd, &block.corners[corner][axis]);
        let low = each!(axis => {
            let least = corner(0, axis).min(corner(1, axis)).min(corner(2, axis));
            (least - splat(self.rays.origin_low[axis][self.at])) * splat(self.rays.inverse[axis][self.at])
        });
        let high = each!(axis => {
            let most = corner(0, axis).max(corner(1, axis)).max(corner(2, axis));
            (most - splat(self.rays.origin_high[axis][self.at])) * splat(self.rays.inverse[axis][self.at])
        });
        let near = each!(axis => low[axis].min(high[axis]));
        let far = each!(axis => low[axis].max(high[axis]));
        let entry = near[0].max(near[1]).max(near[2].max(self.t_min));
        let exit = far[0].min(far[1]).min(far[2]) * FAR_SLACK;
        (entry.simd_le(exit) & entry.simd_le(splat(t_max)), entry)
    }
}

/// Where a ray meets the triangles of a block.
struct Meeting<S: Simd> {
    /// Distance along the ray.
    t: f32x4<S>,
    /// Each corner's weight.
    shares: [f32x4<S>; 3],
    /// Triangles that are met within the interval.
    certain: mask32x4<S>,
    /// Triangles for which single precision cannot tell.
    unclear: mask32x4<S>,
}

/// Where the ray meets a triangle of `block` in double precision.
#[cold]
#[inline(never)]
fn unclear_hit(block: &TriangleBlock, lane: usize, ray: &Ray, t_max: f32) -> Option<TriangleHit> {
    block.triangle(lane).intersect(&PreparedRay::new(*ray), &Shear::new(ray.direction), t_max)
}
