//! Eight boxes side by side, intersected with the same rounding as single ones.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Simd, SimdBase, f32x8, mask32x8};

use crate::geometry::{Aabb, FAR_SLACK, Ray};
use crate::kernel::each;
use crate::kernel::lanes::Lanes;
use crate::wide::bounds::WideContainer;
use crate::wide::box_lanes::{BoxLanes, LaneTest};
use crate::wide::compact::CompactBoxes;
use crate::wide::fused_box::FusedBoxRay;
use crate::wide::layout::WIDTH;
use crate::wide::ray_lanes::{OTHER_ROWS, RayLanes, RayRows, TriangleLanes};

/// A ray prepared for tests against eight boxes. The signs of the direction tell which planes are near, so that none
/// are compared.
pub struct BoxRay<S: Simd> {
    /// For each axis the offset of the near planes: 0 for the lower ones, [`WIDTH`] for the upper ones.
    near: [usize; 3],
    near_origin: [f32x8<S>; 3],
    far_origin: [f32x8<S>; 3],
    negative_inverse: [f32x8<S>; 3],
    t_min: f32x8<S>,
}

impl<S: Simd> LaneTest<S, BoxLanes> for BoxRay<S> {
    #[inline(always)]
    fn intersect_lanes(&self, simd: S, bounds: &BoxLanes, t_max: f32) -> (mask32x8<S>, f32x8<S>) {
        let (entry, exit) = self.between(simd, bounds);
        (entry.simd_le((exit * FAR_SLACK).min(f32x8::splat(simd, t_max))), entry)
    }
}

impl RayRows for Aabb {
    const OTHER_ROWS: usize = 0;

    #[inline(always)]
    fn other_rows<S: Simd, V: Lanes<S>>(simd: S, _: [V; 3], _: [V; 3]) -> [V; OTHER_ROWS] {
        [V::splat(simd, 0.0); OTHER_ROWS]
    }
}

#[allow(private_interfaces, reason = "only the kernels of wide trees prepare rays")]
impl WideContainer for Aabb {
    type Bounds = BoxLanes;
    const EMPTY_BOUNDS: BoxLanes = BoxLanes([[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3]);
    type Prepared<S: Simd> = BoxRay<S>;
    type Fused<S: Simd> = FusedBoxRay;
    type Compact = CompactBoxes;
    const HAS_COMPACT: bool = true;

    #[inline(always)]
    fn nonempty_area(&self) -> f32 {
        let [x, y, z] = each!(axis => self.max[axis] - self.min[axis]);
        x * (y + z) + y * z
    }

    #[inline(always)]
    fn store(&self, bounds: &mut BoxLanes, lane: usize) {
        for axis in 0..3 {
            bounds.0[axis][0][lane] = self.min[axis];
            bounds.0[axis][1][lane] = self.max[axis];
        }
    }

    fn load(bounds: &BoxLanes, lane: usize) -> Self {
        let [min, max] = [0, 1].map(|side| each!(axis => bounds.0[axis][side][lane]).into());
        Self { min, max }
    }

    #[inline(always)]
    fn prepare<S: Simd, const N: usize>(simd: S, rays: &RayLanes<N>, at: usize) -> BoxRay<S> {
        // Where the ray is parallel to an axis's planes the two origins differ, and the lower plane counts as near.
        BoxRay {
            near: each!(axis => rays.near[axis][at % N] as usize),
            near_origin: each!(axis => f32x8::splat(simd, rays.triangles.origin_low[axis][at % N])),
            far_origin: each!(axis => f32x8::splat(simd, rays.triangles.origin_high[axis][at % N])),
            negative_inverse: each!(axis => f32x8::splat(simd, rays.triangles.negative_inverse[axis][at % N])),
            t_min: f32x8::splat(simd, rays.triangles.t_min[at % N]),
        }
    }

    #[inline(always)]
    fn distances_squared<S: Simd>(simd: S, bounds: &BoxLanes, point: [f32x8<S>; 3]) -> f32x8<S> {
        let zero = f32x8::splat(simd, 0.0);
        let outside = each!(axis => {
            let low = f32x8::load_array_ref(simd, &bounds.0[axis][0]);
            let high = f32x8::load_array_ref(simd, &bounds.0[axis][1]);
            (low - point[axis]).max(point[axis] - high).max(zero)
        });
        outside[0] * outside[0] + outside[1] * outside[1] + outside[2] * outside[2]
    }

    #[inline(always)]
    fn prepare_fused<S: Simd>(simd: S, ray: &Ray) -> Option<(FusedBoxRay, TriangleLanes<1>)> {
        FusedBoxRay::new(simd, ray)
    }
}

impl<S: Simd> BoxRay<S> {
    /// A ray that enters boxes as if they were larger by `widening` on both sides of each axis; `None` if it cannot hit anything.
    #[inline(always)]
    pub(crate) fn widened(simd: S, ray: &Ray, widening: [f32; 3]) -> Option<Self> {
        let mut boxes = Aabb::prepare(simd, &RayLanes::single::<S, Aabb>(simd, ray)?, 0);
        for (axis, widening) in widening.into_iter().enumerate() {
            // Towards the near planes at the entry, away from the far ones at the exit.
            let pad = if boxes.near[axis] == 0 { widening } else { -widening };
            boxes.near_origin[axis] += pad;
            boxes.far_origin[axis] -= pad;
        }
        Some(boxes)
    }

    /// Distances at which the ray enters and leaves each box, the second without [`FAR_SLACK`].
    #[inline(always)]
    pub(crate) fn between(&self, simd: S, bounds: &BoxLanes) -> (f32x8<S>, f32x8<S>) {
        let coordinates: &[f32; 6 * WIDTH] = bytemuck::cast_ref(&bounds.0);
        let planes =
            |axis: usize, side: usize| f32x8::from_slice(simd, &coordinates[2 * WIDTH * axis + side..][..WIDTH]);
        let near = each!(axis => {
            (self.near_origin[axis] - planes(axis, self.near[axis] & WIDTH)) * self.negative_inverse[axis]
        });
        let far = each!(axis => {
            (self.far_origin[axis] - planes(axis, self.near[axis] & WIDTH ^ WIDTH)) * self.negative_inverse[axis]
        });
        let entry = near[0].max(near[1]).max(near[2].max(self.t_min));
        (entry, far[0].min(far[1]).min(far[2]))
    }
}
