//! Eight spheres side by side, intersected with the same rounding as single ones.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use bytemuck::{Pod, Zeroable};
use fearless_simd::{Select, Simd, SimdBase, SimdFloat, f32x8, mask32x8};

use crate::geometry::{Ray, SPHERE_ENTRY_ERROR, SPHERE_SQUARE_ERROR, SPHERE_T_ERROR, SPHERE_TINY_RADIUS, Sphere};
use crate::kernel::each;
use crate::kernel::lanes;
use crate::wide::bounds::{Whole, WideContainer};
use crate::wide::box_lanes::LaneTest;
use crate::wide::layout::WIDTH;
use crate::wide::ray_lanes::{OTHER_ROWS, RayLanes, RayRows, TriangleLanes};

/// Eight spheres.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SphereLanes {
    pub(crate) center: [[f32; WIDTH]; 3],
    /// Negative in unused lanes.
    pub(crate) radius: [f32; WIDTH],
}

/// A ray prepared for tests against eight spheres.
pub struct SphereRay<S: Simd> {
    origin: [f32x8<S>; 3],
    unit_direction: [f32x8<S>; 3],
    inverse_length: f32x8<S>,
    t_min: f32x8<S>,
}

impl<S: Simd> LaneTest<S, SphereLanes> for SphereRay<S> {
    #[inline(always)]
    fn intersect_lanes(&self, simd: S, bounds: &SphereLanes, t_max: f32) -> (mask32x8<S>, f32x8<S>) {
        let zero = f32x8::splat(simd, 0.0);
        let radius = f32x8::load_array_ref(simd, &bounds.radius);
        let to = each!(axis => f32x8::load_array_ref(simd, &bounds.center[axis]) - self.origin[axis]);
        let reach = radius + (to[0].abs() + to[1].abs() + to[2].abs() + radius) * SPHERE_ENTRY_ERROR;
        let Chord { inside, near, far } = Chord::new(simd, to, reach, self.unit_direction, self.inverse_length);
        // Negated comparisons, so that NaN counts as a hit.
        let missed = inside.simd_lt(zero)
            | far.simd_lt(self.t_min)
            | near.simd_gt(f32x8::splat(simd, t_max))
            | radius.simd_lt(zero);
        // NaN fails the comparison, which leaves `t_min`.
        let entry = near.simd_gt(self.t_min).select(near, self.t_min);
        (!missed, entry)
    }
}

impl RayRows for Sphere {
    const OTHER_ROWS: usize = 7;

    /// Origin, direction scaled to length 1, and 1 / length.
    #[inline(always)]
    fn other_rows<S: Simd, V: lanes::Lanes<S>>(simd: S, origin: [V; 3], direction: [V; 3]) -> [V; OTHER_ROWS] {
        let inverse_length = V::splat(simd, 1.0) / dot(direction, direction).sqrt();
        let mut rows = [inverse_length; OTHER_ROWS];
        for axis in 0..3 {
            (rows[axis], rows[3 + axis]) = (origin[axis], direction[axis] * inverse_length);
        }
        rows
    }
}

#[allow(private_interfaces, reason = "only the kernels of wide trees prepare rays")]
impl WideContainer for Sphere {
    type Bounds = SphereLanes;
    const EMPTY_BOUNDS: SphereLanes = SphereLanes { center: [[0.0; WIDTH]; 3], radius: [-1.0; WIDTH] };
    type Prepared<S: Simd> = SphereRay<S>;
    type Fused<S: Simd> = SphereRay<S>;
    type Compact = Whole<SphereLanes>;
    const HAS_COMPACT: bool = false;

    #[inline(always)]
    fn nonempty_area(&self) -> f32 {
        self.radius * self.radius
    }

    #[inline(always)]
    fn store(&self, bounds: &mut SphereLanes, lane: usize) {
        for axis in 0..3 {
            bounds.center[axis][lane] = self.center[axis];
        }
        bounds.radius[lane] = self.radius;
    }

    fn load(bounds: &SphereLanes, lane: usize) -> Self {
        Self { center: each!(axis => bounds.center[axis][lane]).into(), radius: bounds.radius[lane] }
    }

    #[inline(always)]
    fn prepare<S: Simd, const N: usize>(simd: S, rays: &RayLanes<N>, at: usize) -> SphereRay<S> {
        SphereRay {
            origin: each!(axis => f32x8::splat(simd, rays.others[axis][at % N])),
            unit_direction: each!(axis => f32x8::splat(simd, rays.others[3 + axis][at % N])),
            inverse_length: f32x8::splat(simd, rays.others[6][at % N]),
            t_min: f32x8::splat(simd, rays.triangles.t_min[at % N]),
        }
    }

    #[inline(always)]
    fn distances_squared<S: Simd>(simd: S, bounds: &SphereLanes, point: [f32x8<S>; 3]) -> f32x8<S> {
        let (zero, largest) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, f32::MAX));
        let radius = f32x8::load_array_ref(simd, &bounds.radius);
        let to = each!(axis => f32x8::load_array_ref(simd, &bounds.center[axis]) - point[axis]);
        let distance = dot(to, to).sqrt();
        let error = (to[0].abs() + to[1].abs() + to[2].abs() + radius) * SPHERE_ENTRY_ERROR;
        let outside = (distance - radius - error).max(zero);
        let bound = distance.simd_le(largest).select(outside * outside, zero);
        radius.simd_lt(zero).select(f32x8::splat(simd, f32::INFINITY), bound)
    }

    #[inline(always)]
    fn prepare_fused<S: Simd>(_: S, _: &Ray) -> Option<(SphereRay<S>, TriangleLanes<1>)> {
        None
    }
}

/// Distances at which a ray enters and leaves a sphere, with the same rounding as [`Container::entry`].
pub(crate) struct Chord<V> {
    /// Negative where the ray misses.
    pub(crate) inside: V,
    /// Distances of entry and exit.
    pub(crate) near: V,
    pub(crate) far: V,
}

impl<V> Chord<V> {
    /// The chord of a sphere whose centre is `to` from the origin; `reach` is the radius padded for rounding errors.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(simd: S, to: [V; 3], reach: V, unit_direction: [V; 3], inverse_length: V) -> Self
    where
        V: lanes::Lanes<S>,
    {
        let along = dot(to, unit_direction);
        let nearest = each!(axis => to[axis] - unit_direction[axis] * along);
        let inside = reach * reach - dot(nearest, nearest) + SPHERE_SQUARE_ERROR;
        let half_chord = reach.simd_lt(V::splat(simd, SPHERE_TINY_RADIUS)).select(reach, inside.sqrt());
        let half_chord = half_chord + (along.abs() + half_chord) * SPHERE_ENTRY_ERROR;
        let near = (along - half_chord) * inverse_length - SPHERE_T_ERROR;
        let far = (along + half_chord) * inverse_length + SPHERE_T_ERROR;
        Self { inside, near, far }
    }
}

#[inline(always)]
pub(crate) fn dot<S: Simd, V: lanes::Lanes<S>>(a: [V; 3], b: [V; 3]) -> V {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
