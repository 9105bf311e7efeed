//! Tests of ray packets against eight containers at once: boxes by interval arithmetic over all directions, spheres by
//! the frustum that encloses the rays.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, SimdMask, f32x8, f32x16, mask32x16};

use crate::geometry::{Aabb, FAR_SLACK, Sphere};
use crate::geometry::{SPHERE_ENTRY_ERROR, SPHERE_T_ERROR, SPHERE_TINY_RADIUS};
use crate::kernel::each;
use crate::wide::bounds::WideContainer;
use crate::wide::box_lanes::BoxLanes;
use crate::wide::layout::WIDTH;
use crate::wide::sphere_bounds::{Chord, SphereLanes, dot};

/// Number of rays in a group, which are tested side by side.
pub const GROUP: usize = 16;
/// Maximum number of groups in a packet.
pub const GROUPS: usize = 16;

/// Relative error allowed for the planes of a frustum: about twenty roundings.
const PLANE_ERROR: f32 = 4e-6;

/// Rays from one point whose directions have the same signs.
pub struct Beam {
    pub(crate) origin: [f32; 3],
    /// The origin as the near planes of boxes are tested, and as the far ones are: apart where boxes count as larger than they are.
    pub(crate) plane_origins: [[f32; 3]; 2],
    pub(crate) t_min: f32,
    /// For each axis 0 where the lower planes of a box are near, 1 where the upper ones are.
    pub(crate) near: [usize; 3],
    /// Smallest and largest inverse direction on each axis.
    pub(crate) range: [[f32; 2]; 3],
    /// Inverse directions by group, axis and lane.
    pub(crate) inverse: [[[f32; GROUP]; 3]; GROUPS],
}

/// Result of testing a packet as a whole against the eight children of a node.
pub struct BeamHits<O> {
    /// One bit for each child that some ray may enter.
    pub(crate) some: u32,
    /// One bit for each child that all rays enter unless they have a closer hit.
    pub(crate) all: u32,
    /// Lower bounds of the distances of entry.
    pub(crate) entry: [f32; WIDTH],
    /// Offsets from the origin to the children.
    pub(crate) offsets: O,
}

/// A container that packets are tested against. The tests are conservative: they never reject a ray that
/// [`WideContainer::Prepared`] accepts and that hits something inside.
pub trait BeamContainer: WideContainer {
    /// Bounds of the rays, and what else the tests need besides the [`Beam`].
    type Frustum;
    /// Offsets from the origin to eight containers.
    type Offsets;
    /// Offset from the origin to one container.
    type Offset<S: Simd>;
    /// Frustum of no rays, to add groups to.
    const EMPTY_FRUSTUM: Self::Frustum;

    /// Adds a group of rays with these directions; the last of `axes` is the longest.
    fn add_group<S: Simd>(
        simd: S,
        frustum: &mut Self::Frustum,
        group: usize,
        directions: [f32x16<S>; 3],
        axes: [usize; 3],
    );
    /// Completes the frustum after all groups have been added.
    fn finish(frustum: &mut Self::Frustum, beam: &Beam, axes: [usize; 3]);
    /// Tests eight containers against all rays at once, up to `t_max`.
    fn intersect_beam<S: Simd>(
        simd: S,
        bounds: &Self::Bounds,
        beam: &Beam,
        frustum: &Self::Frustum,
        t_max: f32,
    ) -> BeamHits<Self::Offsets>;
    /// Broadcasts the offset in a lane for [`BeamContainer::intersect_group`].
    fn splat_offset<S: Simd>(simd: S, offsets: &Self::Offsets, lane: usize) -> Self::Offset<S>;
    /// The rays of a group that enter a container up to `t`.
    fn intersect_group<S: Simd>(
        simd: S,
        offset: &Self::Offset<S>,
        beam: &Beam,
        frustum: &Self::Frustum,
        group: usize,
        t: f32x16<S>,
    ) -> mask32x16<S>;
}

/// Offsets from the origin to the near and far planes of each box, by axis.
pub struct PlaneOffsets {
    near: [[f32; WIDTH]; 3],
    far: [[f32; WIDTH]; 3],
}

impl BeamContainer for Aabb {
    type Frustum = ();
    type Offsets = PlaneOffsets;
    type Offset<S: Simd> = [[f32x16<S>; 3]; 2];
    const EMPTY_FRUSTUM: () = ();

    #[inline(always)]
    fn add_group<S: Simd>(_: S, (): &mut (), _: usize, _: [f32x16<S>; 3], _: [usize; 3]) {}

    fn finish((): &mut (), _: &Beam, _: [usize; 3]) {}

    /// Exact bounds of the values that single rays compute, because rounding is monotone.
    #[inline(always)]
    fn intersect_beam<S: Simd>(simd: S, bounds: &BoxLanes, beam: &Beam, (): &(), t_max: f32) -> BeamHits<PlaneOffsets> {
        let planes = &bounds.0;
        let from = |side: usize, axis: usize| f32x8::splat(simd, beam.plane_origins[side][axis]);
        let near = each!(axis => f32x8::load_array_ref(simd, &planes[axis][beam.near[axis] & 1]) - from(0, axis));
        let far = each!(axis => f32x8::load_array_ref(simd, &planes[axis][beam.near[axis] & 1 ^ 1]) - from(1, axis));
        // Distances for the smallest and the largest inverse direction, in ascending order.
        let range = &beam.range;
        let near_t = each!(axis => {
            let [a, b] = [near[axis] * range[axis][0], near[axis] * range[axis][1]];
            [a.min(b), a.max(b)]
        });
        let far_t = each!(axis => {
            let [a, b] = [far[axis] * range[axis][0], far[axis] * range[axis][1]];
            [a.min(b), a.max(b)]
        });
        let t_min = f32x8::splat(simd, beam.t_min);
        let entry = near_t[0][0].max(near_t[1][0]).max(near_t[2][0].max(t_min));
        let exit = far_t[0][1].min(far_t[1][1]).min(far_t[2][1]) * FAR_SLACK;
        let some = entry.simd_le(exit) & entry.simd_le(f32x8::splat(simd, t_max));
        let latest_entry = near_t[0][1].max(near_t[1][1]).max(near_t[2][1].max(t_min));
        let earliest_exit = far_t[0][0].min(far_t[1][0]).min(far_t[2][0]) * FAR_SLACK;
        let all = latest_entry.simd_le(earliest_exit);
        BeamHits {
            some: some.to_bitmask() as u32,
            all: all.to_bitmask() as u32,
            entry: entry.to_array(),
            offsets: PlaneOffsets {
                near: each!(axis => near[axis].to_array()),
                far: each!(axis => far[axis].to_array()),
            },
        }
    }

    #[inline(always)]
    fn splat_offset<S: Simd>(simd: S, offsets: &PlaneOffsets, lane: usize) -> [[f32x16<S>; 3]; 2] {
        let lane = lane % WIDTH;
        [
            each!(axis => f32x16::splat(simd, offsets.near[axis][lane])),
            each!(axis => f32x16::splat(simd, offsets.far[axis][lane])),
        ]
    }

    #[inline(always)]
    fn intersect_group<S: Simd>(
        simd: S,
        [near, far]: &[[f32x16<S>; 3]; 2],
        beam: &Beam,
        (): &(),
        group: usize,
        t: f32x16<S>,
    ) -> mask32x16<S> {
        let inverse = &beam.inverse[group];
        let inverse = each!(axis => f32x16::load_array_ref(simd, &inverse[axis]));
        let t_min = f32x16::splat(simd, beam.t_min);
        let entry = (near[0] * inverse[0]).max(near[1] * inverse[1]).max((near[2] * inverse[2]).max(t_min));
        let exit = (far[0] * inverse[0]).min(far[1] * inverse[1]).min(far[2] * inverse[2]) * FAR_SLACK;
        entry.simd_le(exit) & entry.simd_le(t)
    }
}

/// Ray data for tests against spheres.
pub struct SphereFrustum {
    unit_direction: [[[f32; GROUP]; 3]; GROUPS],
    inverse_length: [[f32; GROUP]; GROUPS],
    least_inverse_length: f32,
    /// Outward unit normals of the four planes through the origin that enclose all rays.
    normals: [[f32; 3]; 4],
    /// Smallest and largest direction on the two shorter axes, relative to the longest one.
    slopes: [[f32; 2]; 2],
}

/// Offsets from the origin to the centre of each sphere.
pub struct CenterOffsets {
    to: [[f32; WIDTH]; 3],
    /// Radius padded for rounding errors.
    reach: [f32; WIDTH],
}

impl BeamContainer for Sphere {
    type Frustum = SphereFrustum;
    type Offsets = CenterOffsets;
    type Offset<S: Simd> = ([f32x16<S>; 3], f32);
    const EMPTY_FRUSTUM: SphereFrustum = SphereFrustum {
        unit_direction: [[[0.0; GROUP]; 3]; GROUPS],
        inverse_length: [[0.0; GROUP]; GROUPS],
        least_inverse_length: f32::INFINITY,
        normals: [[0.0; 3]; 4],
        slopes: [[f32::INFINITY, f32::NEG_INFINITY]; 2],
    };

    #[inline(always)]
    fn add_group<S: Simd>(simd: S, frustum: &mut SphereFrustum, group: usize, d: [f32x16<S>; 3], axes: [usize; 3]) {
        let inverse_length = f32x16::splat(simd, 1.0) / dot(d, d).sqrt();
        frustum.unit_direction[group] = each!(axis => (d[axis] * inverse_length).to_array());
        frustum.inverse_length[group] = inverse_length.to_array();
        frustum.least_inverse_length = frustum.least_inverse_length.min(inverse_length.reduce_min());
        for ([low, high], &axis) in frustum.slopes.iter_mut().zip(&axes) {
            let slope = d[axis] / d[axes[2]];
            (*low, *high) = (low.min(slope.reduce_min()), high.max(slope.reduce_max()));
        }
    }

    fn finish(frustum: &mut SphereFrustum, beam: &Beam, axes: [usize; 3]) {
        let sign = if beam.near[axes[2]] == 1 { -1.0 } else { 1.0 };
        for (side, [low, high]) in frustum.slopes.into_iter().enumerate() {
            let axis = axes[side];
            for (normal, (slope, outward)) in frustum.normals[2 * side..].iter_mut().zip([(low, -sign), (high, sign)]) {
                let length = (1.0 + slope * slope).sqrt();
                (normal[axis], normal[axes[2]]) = (outward / length, -outward * slope / length);
            }
        }
    }

    #[inline(always)]
    fn intersect_beam<S: Simd>(
        simd: S,
        bounds: &SphereLanes,
        beam: &Beam,
        frustum: &SphereFrustum,
        t_max: f32,
    ) -> BeamHits<CenterOffsets> {
        let splat = |value| f32x8::splat(simd, value);
        let radius = f32x8::load_array_ref(simd, &bounds.radius);
        let to = each!(axis => f32x8::load_array_ref(simd, &bounds.center[axis]) - splat(beam.origin[axis]));
        let size = to[0].abs() + to[1].abs() + to[2].abs() + radius;
        let padded = radius + size * SPHERE_ENTRY_ERROR;
        let loose = radius + size * PLANE_ERROR;
        let mut outside = radius.simd_lt(splat(0.0));
        for normal in &frustum.normals {
            let above = to[0] * normal[0] + to[1] * normal[1] + to[2] * normal[2];
            outside |= above.simd_gt(loose);
        }
        let squared = dot(to, to);
        let t_min = splat(beam.t_min);
        let near = (squared.sqrt() - loose) * frustum.least_inverse_length - SPHERE_T_ERROR;
        // Squares that are not normal numbers are useless.
        let is_reliable =
            squared.simd_ge(splat(SPHERE_TINY_RADIUS * SPHERE_TINY_RADIUS)) & squared.simd_le(splat(f32::MAX));
        let entry = (is_reliable & near.simd_gt(t_min)).select(near, t_min);
        let some = !(outside | entry.simd_gt(splat(t_max)));
        // True where the origin lies inside.
        let all = is_reliable & squared.simd_lt(radius * radius);
        BeamHits {
            some: some.to_bitmask() as u32,
            all: all.to_bitmask() as u32,
            entry: entry.to_array(),
            offsets: CenterOffsets { to: each!(axis => to[axis].to_array()), reach: padded.to_array() },
        }
    }

    #[inline(always)]
    fn splat_offset<S: Simd>(simd: S, offsets: &CenterOffsets, lane: usize) -> ([f32x16<S>; 3], f32) {
        let lane = lane % WIDTH;
        (each!(axis => f32x16::splat(simd, offsets.to[axis][lane])), offsets.reach[lane])
    }

    #[inline(always)]
    fn intersect_group<S: Simd>(
        simd: S,
        (to, reach): &([f32x16<S>; 3], f32),
        beam: &Beam,
        frustum: &SphereFrustum,
        group: usize,
        t: f32x16<S>,
    ) -> mask32x16<S> {
        let unit_direction = &frustum.unit_direction[group];
        let unit_direction = each!(axis => f32x16::load_array_ref(simd, &unit_direction[axis]));
        let inverse_length = f32x16::load_array_ref(simd, &frustum.inverse_length[group]);
        let reach = f32x16::splat(simd, *reach);
        let Chord { inside, near, far } = Chord::new(simd, *to, reach, unit_direction, inverse_length);
        // Negated comparisons, so that NaN counts as a hit.
        !(inside.simd_lt(f32x16::splat(simd, 0.0)) | far.simd_lt(f32x16::splat(simd, beam.t_min)) | near.simd_gt(t))
    }
}
