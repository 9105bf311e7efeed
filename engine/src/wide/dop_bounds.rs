//! Eight polytopes side by side, intersected with the same rounding as single ones.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use bytemuck::{Pod, Zeroable};
use fearless_simd::{Select, Simd, SimdBase, f32x8, mask32x8};

use crate::geometry::{Aabb, DIAGONAL_PAD, Dop14, FAR_SLACK, PARALLEL_PAD, PER_DIAGONAL, Ray};
use crate::kernel::each;
use crate::kernel::lanes::Lanes;
use crate::wide::bounds::{Whole, WideContainer};
use crate::wide::box_bounds::BoxRay;
use crate::wide::box_lanes::{BoxLanes, LaneTest};
use crate::wide::layout::WIDTH;
use crate::wide::ray_lanes::{OTHER_ROWS, RayLanes, RayRows, TriangleLanes};

/// Number of diagonals.
const DIAGONALS: usize = 4;

/// Eight polytopes: their boxes, and for each diagonal the lower and the upper planes.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct DopLanes {
    pub(crate) boxes: BoxLanes,
    pub(crate) planes: [[[f32; WIDTH]; 2]; DIAGONALS],
}

/// A ray prepared for tests against eight polytopes.
pub struct DopRay<S: Simd> {
    boxes: BoxRay<S>,
    /// For each diagonal the offset of the near planes: 0 for the lower ones, 1 for the upper ones.
    near: [usize; DIAGONALS],
    near_origin: [f32x8<S>; DIAGONALS],
    far_origin: [f32x8<S>; DIAGONALS],
    negative_inverse: [f32x8<S>; DIAGONALS],
}

impl<S: Simd> LaneTest<S, DopLanes> for DopRay<S> {
    #[inline(always)]
    fn intersect_lanes(&self, simd: S, bounds: &DopLanes, t_max: f32) -> (mask32x8<S>, f32x8<S>) {
        let (mut entry, mut exit) = self.boxes.between(simd, &bounds.boxes);
        for diagonal in 0..DIAGONALS {
            let near = f32x8::load_array_ref(simd, &bounds.planes[diagonal][self.near[diagonal] & 1]);
            let far = f32x8::load_array_ref(simd, &bounds.planes[diagonal][self.near[diagonal] & 1 ^ 1]);
            entry = entry.max((self.near_origin[diagonal] - near) * self.negative_inverse[diagonal]);
            exit = exit.min((self.far_origin[diagonal] - far) * self.negative_inverse[diagonal]);
        }
        (entry.simd_le((exit * FAR_SLACK).min(f32x8::splat(simd, t_max))), entry)
    }
}

impl RayRows for Dop14 {
    const OTHER_ROWS: usize = 3 * DIAGONALS;

    /// Along each diagonal the origin for tests against near planes, that for tests against far ones, and the negative reciprocal of the
    /// direction; see [`DiagonalRay`](crate::geometry::DiagonalRay).
    #[inline(always)]
    fn other_rows<S: Simd, V: Lanes<S>>(simd: S, origin: [V; 3], direction: [V; 3]) -> [V; OTHER_ROWS] {
        let (zero, one, largest) = (V::splat(simd, 0.0), V::splat(simd, 1.0), V::splat(simd, f32::MAX));
        let origins = along_diagonals(origin);
        let mut inverses = along_diagonals(direction);
        let mut parallel_pad = zero;
        for inverse in &mut inverses {
            let reciprocal = one / *inverse;
            let crosses = reciprocal.abs().simd_le(largest);
            *inverse = crosses.select(reciprocal, largest);
            parallel_pad = crosses.select(parallel_pad, V::splat(simd, PARALLEL_PAD));
        }
        let pad = (origin[0].abs() + origin[1].abs() + origin[2].abs()) * DIAGONAL_PAD + parallel_pad;
        let mut rows = [zero; OTHER_ROWS];
        for diagonal in 0..DIAGONALS {
            let inwards = inverses[diagonal].simd_lt(zero).select(zero - pad, pad);
            rows[diagonal] = origins[diagonal] + inwards;
            rows[DIAGONALS + diagonal] = origins[diagonal] - inwards;
            rows[2 * DIAGONALS + diagonal] = -inverses[diagonal];
        }
        rows
    }
}

#[allow(private_interfaces, reason = "only the kernels of wide trees prepare rays")]
impl WideContainer for Dop14 {
    type Bounds = DopLanes;
    const EMPTY_BOUNDS: DopLanes = DopLanes {
        boxes: Aabb::EMPTY_BOUNDS,
        planes: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; DIAGONALS],
    };
    type Prepared<S: Simd> = DopRay<S>;
    type Fused<S: Simd> = DopRay<S>;
    type Compact = Whole<DopLanes>;
    const HAS_COMPACT: bool = false;

    #[inline(always)]
    fn nonempty_area(&self) -> f32 {
        self.nonempty_half_area()
    }

    #[inline(always)]
    fn store(&self, bounds: &mut DopLanes, lane: usize) {
        self.bounds.store(&mut bounds.boxes, lane);
        for (diagonal, [low, high]) in bounds.planes.iter_mut().enumerate() {
            (low[lane], high[lane]) = (self.low[diagonal], self.high[diagonal]);
        }
    }

    fn load(bounds: &DopLanes, lane: usize) -> Self {
        let [low, high] = [0, 1].map(|side| bounds.planes.map(|planes| planes[side][lane]));
        Self { bounds: Aabb::load(&bounds.boxes, lane), low, high }
    }

    #[inline(always)]
    fn prepare<S: Simd, const N: usize>(simd: S, rays: &RayLanes<N>, at: usize) -> DopRay<S> {
        let zero = f32x8::splat(simd, 0.0);
        let mut ray = DopRay {
            boxes: Aabb::prepare(simd, rays, at),
            near: [0; DIAGONALS],
            near_origin: [zero; DIAGONALS],
            far_origin: [zero; DIAGONALS],
            negative_inverse: [zero; DIAGONALS],
        };
        for diagonal in 0..DIAGONALS {
            let [near, far, inverse] = each!(part => rays.others[part * DIAGONALS + diagonal][at % N]);
            // The lower planes are near where the direction is positive, which makes the negative reciprocal negative.
            ray.near[diagonal] = (inverse.to_bits() >> 31 ^ 1) as usize;
            ray.near_origin[diagonal] = f32x8::splat(simd, near);
            ray.far_origin[diagonal] = f32x8::splat(simd, far);
            ray.negative_inverse[diagonal] = f32x8::splat(simd, inverse);
        }
        ray
    }

    #[inline(always)]
    fn distances_squared<S: Simd>(simd: S, bounds: &DopLanes, point: [f32x8<S>; 3]) -> f32x8<S> {
        let (mut farthest, largest) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, f32::MAX));
        let pad = (point[0].abs() + point[1].abs() + point[2].abs()) * DIAGONAL_PAD;
        for (along, [low, high]) in along_diagonals(point).into_iter().zip(&bounds.planes) {
            let [low, high] = [f32x8::load_array_ref(simd, low), f32x8::load_array_ref(simd, high)];
            let outside = (low - along).max(along - high) - pad;
            farthest = farthest.max(outside.simd_le(largest).select(outside * PER_DIAGONAL, farthest));
        }
        Aabb::distances_squared(simd, &bounds.boxes, point).max(farthest * farthest)
    }

    #[inline(always)]
    fn prepare_fused<S: Simd>(_: S, _: &Ray) -> Option<(DopRay<S>, TriangleLanes<1>)> {
        None
    }
}

/// The dot products of a vector with the diagonals, by lanes.
#[inline(always)]
fn along_diagonals<S: Simd, V: Lanes<S>>([x, y, z]: [V; 3]) -> [V; DIAGONALS] {
    let (sum, difference) = (x + y, x - y);
    [sum + z, sum - z, difference + z, difference - z]
}
