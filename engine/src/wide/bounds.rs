//! The containers of eight children side by side, tested with the same roundings as one.

use std::fmt::Debug;

use bytemuck::{Pod, Zeroable};
use fearless_simd::{Select, Simd, SimdBase, SimdMask, f32x8, mask32x8};

use crate::geometry::{Aabb, FAR_SLACK, Sphere};
use crate::kernel::each;
use crate::kernel::lanes::Lanes;
use crate::tree::Container;
use crate::tree::container::{SPHERE_ENTRY_ERROR, SPHERE_SQUARE_ERROR, SPHERE_T_ERROR, SPHERE_TINY_RADIUS};
use crate::wide::layout::WIDTH;
use crate::wide::ray_lanes::RayLanes;

/// A container that wide trees are made of.
#[allow(private_interfaces, reason = "only the kernels of wide trees prepare rays")]
pub trait WideContainer: Container {
    /// Eight of them, lane by lane.
    type Bounds: Pod + Send + Sync + PartialEq + Debug;
    /// Eight that nothing enters.
    const NOTHING: Self::Bounds;
    /// What a ray's tests share.
    type Prepared<S: Simd>;

    /// [`Container::relative_area`] of what is not empty, without a look.
    fn wide_area(&self) -> f32;
    /// Puts `self` into a lane.
    fn store(&self, bounds: &mut Self::Bounds, lane: usize);
    /// Spreads ray number `at` over the lanes for [`WideContainer::entries`].
    fn prepare<S: Simd, const N: usize>(simd: S, rays: &RayLanes<N>, at: usize) -> Self::Prepared<S>;
    /// The lanes that the ray enters up to `t_max`, and where; see [`Container::entry`].
    fn entered<S: Simd>(simd: S, bounds: &Self::Bounds, ray: &Self::Prepared<S>, t_max: f32)
    -> (mask32x8<S>, f32x8<S>);
    /// [`WideContainer::entered`], one bit for each lane.
    #[inline(always)]
    fn entries<S: Simd>(simd: S, bounds: &Self::Bounds, ray: &Self::Prepared<S>, t_max: f32) -> (u32, [f32; WIDTH]) {
        let (entered, entry) = Self::entered(simd, bounds, ray, t_max);
        (entered.to_bitmask() as u32, entry.to_array())
    }
}

/// Eight boxes: for each axis the lower planes and the upper ones.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Boxes(pub(crate) [[[f32; WIDTH]; 2]; 3]);

/// A ray against eight boxes. Which planes are near follows from the signs of the direction, so that nothing is compared.
pub struct BoxRay<S: Simd> {
    /// For each axis 0 where the lower plane is near, [`WIDTH`] where the upper one is.
    near: [usize; 3],
    near_origin: [f32x8<S>; 3],
    far_origin: [f32x8<S>; 3],
    inverse: [f32x8<S>; 3],
    t_min: f32x8<S>,
}

#[allow(private_interfaces, reason = "only the kernels of wide trees prepare rays")]
impl WideContainer for Aabb {
    type Bounds = Boxes;
    const NOTHING: Boxes = Boxes([[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3]);
    type Prepared<S: Simd> = BoxRay<S>;

    #[inline(always)]
    fn wide_area(&self) -> f32 {
        let [x, y, z] = each!(axis => self.max[axis] - self.min[axis]);
        x * (y + z) + y * z
    }

    #[inline(always)]
    fn store(&self, bounds: &mut Boxes, lane: usize) {
        for axis in 0..3 {
            bounds.0[axis][0][lane] = self.min[axis];
            bounds.0[axis][1][lane] = self.max[axis];
        }
    }

    #[inline(always)]
    fn prepare<S: Simd, const N: usize>(simd: S, rays: &RayLanes<N>, at: usize) -> BoxRay<S> {
        // The lower plane is near wherever the two origins differ, on axes that the ray runs along at no speed.
        BoxRay {
            near: each!(axis => rays.near[axis][at % N] as usize),
            near_origin: each!(axis => f32x8::splat(simd, rays.origin_low[axis][at % N])),
            far_origin: each!(axis => f32x8::splat(simd, rays.origin_high[axis][at % N])),
            inverse: each!(axis => f32x8::splat(simd, rays.inverse[axis][at % N])),
            t_min: f32x8::splat(simd, rays.t_min[at % N]),
        }
    }

    #[inline(always)]
    fn entered<S: Simd>(simd: S, bounds: &Boxes, ray: &BoxRay<S>, t_max: f32) -> (mask32x8<S>, f32x8<S>) {
        let numbers: &[f32; 6 * WIDTH] = bytemuck::cast_ref(&bounds.0);
        let planes = |axis: usize, side: usize| f32x8::from_slice(simd, &numbers[2 * WIDTH * axis + side..][..WIDTH]);
        let near = each!(axis => (planes(axis, ray.near[axis] & WIDTH) - ray.near_origin[axis]) * ray.inverse[axis]);
        let far =
            each!(axis => (planes(axis, ray.near[axis] & WIDTH ^ WIDTH) - ray.far_origin[axis]) * ray.inverse[axis]);
        let entry = near[0].max(near[1]).max(near[2].max(ray.t_min));
        let exit = far[0].min(far[1]).min(far[2]) * FAR_SLACK;
        (entry.simd_le(exit) & entry.simd_le(f32x8::splat(simd, t_max)), entry)
    }
}

/// Eight spheres.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Spheres {
    pub(crate) center: [[f32; WIDTH]; 3],
    /// Negative where there is none.
    pub(crate) radius: [f32; WIDTH],
}

/// A ray against eight spheres.
pub struct SphereRay<S: Simd> {
    origin: [f32x8<S>; 3],
    unit_direction: [f32x8<S>; 3],
    inverse_length: f32x8<S>,
    t_min: f32x8<S>,
}

#[allow(private_interfaces, reason = "only the kernels of wide trees prepare rays")]
impl WideContainer for Sphere {
    type Bounds = Spheres;
    const NOTHING: Spheres = Spheres { center: [[0.0; WIDTH]; 3], radius: [-1.0; WIDTH] };
    type Prepared<S: Simd> = SphereRay<S>;

    #[inline(always)]
    fn wide_area(&self) -> f32 {
        self.radius * self.radius
    }

    #[inline(always)]
    fn store(&self, bounds: &mut Spheres, lane: usize) {
        for axis in 0..3 {
            bounds.center[axis][lane] = self.center[axis];
        }
        bounds.radius[lane] = self.radius;
    }

    #[inline(always)]
    fn prepare<S: Simd, const N: usize>(simd: S, rays: &RayLanes<N>, at: usize) -> SphereRay<S> {
        SphereRay {
            origin: each!(axis => f32x8::splat(simd, rays.origin[axis][at % N])),
            unit_direction: each!(axis => f32x8::splat(simd, rays.unit_direction[axis][at % N])),
            inverse_length: f32x8::splat(simd, rays.inverse_length[at % N]),
            t_min: f32x8::splat(simd, rays.t_min[at % N]),
        }
    }

    #[inline(always)]
    fn entered<S: Simd>(simd: S, bounds: &Spheres, ray: &SphereRay<S>, t_max: f32) -> (mask32x8<S>, f32x8<S>) {
        let zero = f32x8::splat(simd, 0.0);
        let radius = f32x8::load_array_ref(simd, &bounds.radius);
        let to = each!(axis => f32x8::load_array_ref(simd, &bounds.center[axis]) - ray.origin[axis]);
        let reach = radius + (to[0].abs() + to[1].abs() + to[2].abs() + radius) * SPHERE_ENTRY_ERROR;
        let Chord { inside, near, far } = Chord::new(simd, to, reach, ray.unit_direction, ray.inverse_length);
        // Negated comparisons: a NaN counts as a hit.
        let missed = inside.simd_lt(zero)
            | far.simd_lt(ray.t_min)
            | near.simd_gt(f32x8::splat(simd, t_max))
            | radius.simd_lt(zero);
        // NaN fails the comparison, which leaves t_min.
        let entry = near.simd_gt(ray.t_min).select(near, ray.t_min);
        (!missed, entry)
    }
}

/// Where rays pass through spheres: step by step what [`Container::entry`] does.
pub(crate) struct Chord<V> {
    /// Less than 0 where the ray passes by.
    pub(crate) inside: V,
    /// Where it enters, and where it leaves.
    pub(crate) near: V,
    pub(crate) far: V,
}

impl<V> Chord<V> {
    /// From the origin `to` the middle of a sphere, with a radius and what may be lost by rounding as its `reach`.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(simd: S, to: [V; 3], reach: V, unit_direction: [V; 3], inverse_length: V) -> Self
    where
        V: Lanes<S>,
    {
        let middle = dot(to, unit_direction);
        let nearest = each!(axis => to[axis] - unit_direction[axis] * middle);
        let inside = reach * reach - dot(nearest, nearest) + SPHERE_SQUARE_ERROR;
        let half_chord = reach.simd_lt(V::splat(simd, SPHERE_TINY_RADIUS)).select(reach, inside.sqrt());
        let half_chord = half_chord + (middle.abs() + half_chord) * SPHERE_ENTRY_ERROR;
        let near = (middle - half_chord) * inverse_length - SPHERE_T_ERROR;
        let far = (middle + half_chord) * inverse_length + SPHERE_T_ERROR;
        Self { inside, near, far }
    }
}

#[inline(always)]
pub(crate) fn dot<S: Simd, V: Lanes<S>>(a: [V; 3], b: [V; 3]) -> V {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
