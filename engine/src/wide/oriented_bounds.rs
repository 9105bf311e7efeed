//! Eight oriented boxes side by side.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use bytemuck::{Pod, Zeroable};
use fearless_simd::{Select, Simd, SimdBase, SimdFloat, f32x8, mask32x8};
use glam::Vec3;

use crate::geometry::{Aabb, FAR_SLACK, FARTHEST, ORIENTED_PAD, OrientedBox, PARALLEL_PAD, Ray};
use crate::kernel::each;
use crate::kernel::lanes::Lanes;
use crate::wide::bounds::{Whole, WideContainer};
use crate::wide::box_lanes::{BoxLanes, LaneTest};
use crate::wide::layout::WIDTH;
use crate::wide::ray_lanes::{OTHER_ROWS, RayLanes, RayRows, TriangleLanes};
use crate::wide::sphere_bounds::dot;

/// Eight oriented boxes. Rays are tested against the planes alone.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct OrientedLanes {
    /// For each pair of planes the coordinates of the direction across them.
    pub(crate) normals: [[[f32; WIDTH]; 3]; 3],
    /// For each pair the lower and the upper plane.
    pub(crate) planes: [[[f32; WIDTH]; 2]; 3],
    /// The boxes along the axes around what they enclose.
    pub(crate) boxes: BoxLanes,
}

/// A ray prepared for tests against eight oriented boxes.
pub struct OrientedLaneRay<S: Simd> {
    origin: [f32x8<S>; 3],
    direction: [f32x8<S>; 3],
    pad: f32x8<S>,
    t_min: f32x8<S>,
}

impl<S: Simd> LaneTest<S, OrientedLanes> for OrientedLaneRay<S> {
    /// With the rounding of [`Container::entry`](crate::tree::Container::entry) of [`OrientedBox`].
    #[inline(always)]
    fn intersect_lanes(&self, simd: S, bounds: &OrientedLanes, t_max: f32) -> (mask32x8<S>, f32x8<S>) {
        let (one, largest) = (f32x8::splat(simd, 1.0), f32x8::splat(simd, f32::MAX));
        let parallel_pad = self.pad + PARALLEL_PAD;
        let (mut entry, mut exit) = (self.t_min, largest);
        for at in 0..3 {
            let [x, y, z] = each!(axis => f32x8::load_array_ref(simd, &bounds.normals[at][axis]));
            let [low, high] = each_plane(simd, &bounds.planes[at]);
            let origin = x * self.origin[0] + y * self.origin[1] + z * self.origin[2];
            let reciprocal = one / (x * self.direction[0] + y * self.direction[1] + z * self.direction[2]);
            let crosses = reciprocal.abs().simd_le(largest);
            let inverse = crosses.select(reciprocal, largest);
            let pad = crosses.select(self.pad, parallel_pad);
            let (t0, t1) = ((low - (origin + pad)) * inverse, (high - (origin - pad)) * inverse);
            entry = entry.max(t0.min(t1));
            exit = exit.min(t0.max(t1));
        }
        let [low, high] = each_plane(simd, &bounds.planes[0]);
        // Empty boxes are inverted and must stay misses.
        let entered = entry.simd_le((exit * FAR_SLACK).min(f32x8::splat(simd, t_max))) & low.simd_le(high);
        (entered, entry)
    }
}

impl RayRows for OrientedBox {
    const OTHER_ROWS: usize = 7;

    /// Origin, direction and pad of an [`OrientedRay`](crate::geometry::OrientedRay).
    #[inline(always)]
    fn other_rows<S: Simd, V: Lanes<S>>(simd: S, origin: [V; 3], direction: [V; 3]) -> [V; OTHER_ROWS] {
        let (zero, size) = (V::splat(simd, 0.0), origin[0].abs() + origin[1].abs() + origin[2].abs());
        let is_bounded = size.simd_le(V::splat(simd, FARTHEST));
        let mut rows = [is_bounded.select(size * ORIENTED_PAD, V::splat(simd, f32::MAX)); OTHER_ROWS];
        for axis in 0..3 {
            rows[axis] = is_bounded.select(origin[axis], zero);
            rows[3 + axis] = is_bounded.select(direction[axis], zero);
        }
        rows
    }
}

#[allow(private_interfaces, reason = "only the kernels of wide trees prepare rays")]
impl WideContainer for OrientedBox {
    type Bounds = OrientedLanes;
    const EMPTY_BOUNDS: OrientedLanes = OrientedLanes {
        normals: [
            [[1.0; WIDTH], [0.0; WIDTH], [0.0; WIDTH]],
            [[0.0; WIDTH], [1.0; WIDTH], [0.0; WIDTH]],
            [[0.0; WIDTH], [0.0; WIDTH], [1.0; WIDTH]],
        ],
        planes: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3],
        boxes: Aabb::EMPTY_BOUNDS,
    };
    type Prepared<S: Simd> = OrientedLaneRay<S>;
    type Fused<S: Simd> = OrientedLaneRay<S>;
    type Compact = Whole<OrientedLanes>;
    const HAS_COMPACT: bool = false;

    fn nonempty_area(&self) -> f32 {
        self.nonempty_half_area()
    }

    fn store(&self, bounds: &mut OrientedLanes, lane: usize) {
        self.bounds.store(&mut bounds.boxes, lane);
        for at in 0..3 {
            for axis in 0..3 {
                bounds.normals[at][axis][lane] = self.normals[at][axis];
            }
            (bounds.planes[at][0][lane], bounds.planes[at][1][lane]) = (self.low[at], self.high[at]);
        }
    }

    fn load(bounds: &OrientedLanes, lane: usize) -> Self {
        let [low, high] = [0, 1].map(|side| bounds.planes.map(|planes| planes[side][lane]));
        let normals = bounds.normals.map(|normal| Vec3::from(normal.map(|coordinates| coordinates[lane])));
        Self { bounds: Aabb::load(&bounds.boxes, lane), normals, low, high }
    }

    #[inline(always)]
    fn prepare<S: Simd, const N: usize>(simd: S, rays: &RayLanes<N>, at: usize) -> OrientedLaneRay<S> {
        OrientedLaneRay {
            origin: each!(axis => f32x8::splat(simd, rays.others[axis][at % N])),
            direction: each!(axis => f32x8::splat(simd, rays.others[3 + axis][at % N])),
            pad: f32x8::splat(simd, rays.others[6][at % N]),
            t_min: f32x8::splat(simd, rays.triangles.t_min[at % N]),
        }
    }

    #[inline(always)]
    fn distances_squared<S: Simd>(simd: S, bounds: &OrientedLanes, point: [f32x8<S>; 3]) -> f32x8<S> {
        let (mut farthest, largest) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, f32::MAX));
        let size = point[0].abs() + point[1].abs() + point[2].abs();
        let is_bounded = size.simd_le(f32x8::splat(simd, FARTHEST));
        for at in 0..3 {
            let normal = each!(axis => f32x8::load_array_ref(simd, &bounds.normals[at][axis]));
            let [low, high] = each_plane(simd, &bounds.planes[at]);
            let along = dot(normal, point);
            let outside = (low - along).max(along - high) - size * ORIENTED_PAD;
            let distance = outside / dot(normal, normal).sqrt();
            farthest = farthest.max((distance.simd_le(largest) & is_bounded).select(distance, farthest));
        }
        Aabb::distances_squared(simd, &bounds.boxes, point).max(farthest * farthest)
    }

    #[inline(always)]
    fn prepare_fused<S: Simd>(_: S, _: &Ray) -> Option<(OrientedLaneRay<S>, TriangleLanes<1>)> {
        None
    }
}

/// The lower and the upper planes of a pair.
#[inline(always)]
fn each_plane<S: Simd>(simd: S, [low, high]: &[[f32; WIDTH]; 2]) -> [f32x8<S>; 2] {
    [f32x8::load_array_ref(simd, low), f32x8::load_array_ref(simd, high)]
}
