//! The containers of eight children side by side, intersected with the same rounding as single ones.

use std::fmt::Debug;

use bytemuck::{Pod, Zeroable};
use fearless_simd::{Select, Simd, SimdBase, SimdMask, f32x8, mask32x8};

use crate::geometry::{Aabb, FAR_SLACK, Sphere};
use crate::geometry::{SPHERE_ENTRY_ERROR, SPHERE_SQUARE_ERROR, SPHERE_T_ERROR, SPHERE_TINY_RADIUS};
use crate::kernel::each;
use crate::kernel::lanes;
use crate::tree::Container;
use crate::wide::box_lanes::{BoxLanes, LaneTest};
use crate::wide::fused_box::FusedBoxRay;
use crate::wide::layout::WIDTH;
use crate::wide::ray_lanes::RayLanes;

/// A container of which wide trees are made.
#[allow(private_interfaces, reason = "only the kernels of wide trees prepare rays")]
pub trait WideContainer: Container {
    /// Eight containers, one per lane.
    type Bounds: Pod + Send + Sync + PartialEq + Debug;
    /// Eight empty containers, which no ray enters.
    const EMPTY_BOUNDS: Self::Bounds;
    /// A ray prepared for tests against eight containers.
    type Prepared<S: Simd>: LaneTest<S, Self::Bounds>;
    /// A single ray prepared for tests that take fewer steps and may also enter what [`WideContainer::intersect`] just misses.
    type Fused<S: Simd>: LaneTest<S, Self::Bounds>;

    /// [`Container::relative_area`] of a container that is not empty, without checking.
    fn nonempty_area(&self) -> f32;
    /// Stores the container in a lane of `bounds`.
    fn store(&self, bounds: &mut Self::Bounds, lane: usize);
    /// The container in a lane of `bounds`.
    fn load(bounds: &Self::Bounds, lane: usize) -> Self;
    /// Prepares ray `at` of `rays`.
    fn prepare<S: Simd, const N: usize>(simd: S, rays: &RayLanes<N>, at: usize) -> Self::Prepared<S>;
    /// Prepares a single ray for the shorter test; `None` where only [`WideContainer::prepare`] will do.
    fn prepare_fused<S: Simd>(simd: S, ray: &RayLanes<1>) -> Option<Self::Fused<S>>;
    /// The lanes whose containers the ray enters up to `t_max`, and the distances of entry; see [`Container::entry`].
    fn intersect<S: Simd>(
        simd: S,
        bounds: &Self::Bounds,
        ray: &Self::Prepared<S>,
        t_max: f32,
    ) -> (mask32x8<S>, f32x8<S>);
}

/// How a wide node stores the containers of its children.
pub trait NodeBounds: Pod + Send + Sync + PartialEq + Debug {
    /// What contains a child.
    type Container: WideContainer;

    /// Stores the first `count` of eight containers, one to eight; the others are empty.
    fn pack(lanes: &Lanes<Self>, count: usize) -> Self;
    /// The containers as rays are tested against them; `space` is where they can be put.
    fn unpack<'a, S: Simd>(&'a self, simd: S, space: &'a mut Lanes<Self>) -> &'a Lanes<Self>;
    /// The container in a lane: that which was stored, or one that encloses it.
    fn load(&self, lane: usize) -> Self::Container;
    /// Whether a lane was made from `container`, as far as can be told.
    fn holds(&self, lane: usize, container: &Self::Container) -> bool;
    /// What `container`, which was loaded, and its parent's have in common, where what is stored is not exact.
    fn within(container: Self::Container, parent: &Self::Container) -> Self::Container;
}

/// Eight containers as rays are tested against them.
pub(crate) type Lanes<B> = <<B as NodeBounds>::Container as WideContainer>::Bounds;

/// Lanes that are stored as they are.
macro_rules! store_exactly {
    ($lanes:ty, $container:ty) => {
        impl NodeBounds for $lanes {
            type Container = $container;

            #[inline(always)]
            fn pack(lanes: &Self, _: usize) -> Self {
                *lanes
            }

            #[inline(always)]
            fn unpack<'a, S: Simd>(&'a self, _: S, _: &'a mut Self) -> &'a Self {
                self
            }

            fn load(&self, lane: usize) -> $container {
                <$container>::load(self, lane)
            }

            fn holds(&self, lane: usize, container: &$container) -> bool {
                self.load(lane) == *container
            }

            fn within(container: $container, _: &$container) -> $container {
                container
            }
        }
    };
}

store_exactly!(BoxLanes, Aabb);
store_exactly!(SphereLanes, Sphere);

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
    fn intersect(&self, simd: S, bounds: &BoxLanes, t_max: f32) -> (u32, [f32; WIDTH]) {
        let (entered, entry) = Aabb::intersect(simd, bounds, self, t_max);
        (entered.to_bitmask() as u32, entry.to_array())
    }
}

#[allow(private_interfaces, reason = "only the kernels of wide trees prepare rays")]
impl WideContainer for Aabb {
    type Bounds = BoxLanes;
    const EMPTY_BOUNDS: BoxLanes = BoxLanes([[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3]);
    type Prepared<S: Simd> = BoxRay<S>;
    type Fused<S: Simd> = FusedBoxRay<S>;

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
            near_origin: each!(axis => f32x8::splat(simd, rays.origin_low[axis][at % N])),
            far_origin: each!(axis => f32x8::splat(simd, rays.origin_high[axis][at % N])),
            negative_inverse: each!(axis => f32x8::splat(simd, rays.negative_inverse[axis][at % N])),
            t_min: f32x8::splat(simd, rays.t_min[at % N]),
        }
    }

    #[inline(always)]
    fn prepare_fused<S: Simd>(simd: S, ray: &RayLanes<1>) -> Option<FusedBoxRay<S>> {
        FusedBoxRay::new(simd, ray)
    }

    #[inline(always)]
    fn intersect<S: Simd>(simd: S, bounds: &BoxLanes, ray: &BoxRay<S>, t_max: f32) -> (mask32x8<S>, f32x8<S>) {
        let coordinates: &[f32; 6 * WIDTH] = bytemuck::cast_ref(&bounds.0);
        let planes =
            |axis: usize, side: usize| f32x8::from_slice(simd, &coordinates[2 * WIDTH * axis + side..][..WIDTH]);
        let near = each!(axis => {
            (ray.near_origin[axis] - planes(axis, ray.near[axis] & WIDTH)) * ray.negative_inverse[axis]
        });
        let far = each!(axis => {
            (ray.far_origin[axis] - planes(axis, ray.near[axis] & WIDTH ^ WIDTH)) * ray.negative_inverse[axis]
        });
        let entry = near[0].max(near[1]).max(near[2].max(ray.t_min));
        let exit = far[0].min(far[1]).min(far[2]) * FAR_SLACK;
        (entry.simd_le(exit.min(f32x8::splat(simd, t_max))), entry)
    }
}

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
    fn intersect(&self, simd: S, bounds: &SphereLanes, t_max: f32) -> (u32, [f32; WIDTH]) {
        let (entered, entry) = Sphere::intersect(simd, bounds, self, t_max);
        (entered.to_bitmask() as u32, entry.to_array())
    }
}

#[allow(private_interfaces, reason = "only the kernels of wide trees prepare rays")]
impl WideContainer for Sphere {
    type Bounds = SphereLanes;
    const EMPTY_BOUNDS: SphereLanes = SphereLanes { center: [[0.0; WIDTH]; 3], radius: [-1.0; WIDTH] };
    type Prepared<S: Simd> = SphereRay<S>;
    type Fused<S: Simd> = SphereRay<S>;

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
            origin: each!(axis => f32x8::splat(simd, rays.origin[axis][at % N])),
            unit_direction: each!(axis => f32x8::splat(simd, rays.unit_direction[axis][at % N])),
            inverse_length: f32x8::splat(simd, rays.inverse_length[at % N]),
            t_min: f32x8::splat(simd, rays.t_min[at % N]),
        }
    }

    #[inline(always)]
    fn prepare_fused<S: Simd>(_: S, _: &RayLanes<1>) -> Option<SphereRay<S>> {
        None
    }

    #[inline(always)]
    fn intersect<S: Simd>(simd: S, bounds: &SphereLanes, ray: &SphereRay<S>, t_max: f32) -> (mask32x8<S>, f32x8<S>) {
        let zero = f32x8::splat(simd, 0.0);
        let radius = f32x8::load_array_ref(simd, &bounds.radius);
        let to = each!(axis => f32x8::load_array_ref(simd, &bounds.center[axis]) - ray.origin[axis]);
        let reach = radius + (to[0].abs() + to[1].abs() + to[2].abs() + radius) * SPHERE_ENTRY_ERROR;
        let Chord { inside, near, far } = Chord::new(simd, to, reach, ray.unit_direction, ray.inverse_length);
        // Negated comparisons, so that NaN counts as a hit.
        let missed = inside.simd_lt(zero)
            | far.simd_lt(ray.t_min)
            | near.simd_gt(f32x8::splat(simd, t_max))
            | radius.simd_lt(zero);
        // NaN fails the comparison, which leaves `t_min`.
        let entry = near.simd_gt(ray.t_min).select(near, ray.t_min);
        (!missed, entry)
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
