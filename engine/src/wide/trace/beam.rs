//! Tests of packets against eight containers: boxes by the interval of all directions, spheres by the pyramid around them.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, SimdMask, f32x8, f32x16, mask32x16};

use crate::geometry::{Aabb, FAR_SLACK, Sphere};
use crate::kernel::each;
use crate::tree::container::{SPHERE_ENTRY_ERROR, SPHERE_T_ERROR, SPHERE_TINY_RADIUS};
use crate::wide::bounds::WideContainer;
use crate::wide::bounds::{Boxes, Chord, Spheres, dot};
use crate::wide::layout::WIDTH;

/// Rays that are tested side by side.
pub const GROUP: usize = 16;
/// Groups of a packet.
pub const GROUPS: usize = 16;

/// Relative error allowed for in the planes around a packet: some twenty roundings.
const PYRAMID_ERROR: f32 = 4e-6;

/// Rays from one point whose directions agree in all signs.
pub struct Beam {
    pub(crate) origin: [f32; 3],
    pub(crate) t_min: f32,
    /// For each axis 0 where the lower planes of a box are near, 1 where the upper ones are.
    pub(crate) near: [usize; 3],
    /// Smallest and largest inverse direction on each axis.
    pub(crate) range: [[f32; 2]; 3],
    pub(crate) inverse: [[[f32; GROUP]; 3]; GROUPS],
}

/// How a node's children stand to a packet as a whole.
pub struct Interval<O> {
    /// One bit for each child that some ray may enter.
    pub(crate) some: u32,
    /// One bit for each child that all rays enter if nothing is nearer.
    pub(crate) all: u32,
    /// No ray enters earlier.
    pub(crate) entry: [f32; WIDTH],
    /// From the origin to each child.
    pub(crate) offsets: O,
}

/// A container that packets are tested against. No test fails a ray that [`WideContainer::entered`] lets in where it meets
/// something.
pub trait BeamContainer: WideContainer {
    /// What the tests need besides the [`Beam`].
    type More;
    /// From the origin to eight containers.
    type Offsets;
    /// From the origin to one container.
    type Offset<S: Simd>;
    /// To begin with.
    const NO_RAYS: Self::More;

    /// Adds the rays of a group with these directions, of which the last of `axes` is the longest one.
    fn add_rays<S: Simd>(simd: S, more: &mut Self::More, group: usize, directions: [f32x16<S>; 3], axes: [usize; 3]);
    /// Comes after all groups have been added.
    fn enclose(more: &mut Self::More, beam: &Beam, axes: [usize; 3]);
    /// Tests eight containers against all rays at once, which look no farther than `reach`.
    fn interval<S: Simd>(
        simd: S,
        bounds: &Self::Bounds,
        beam: &Beam,
        more: &Self::More,
        reach: f32,
    ) -> Interval<Self::Offsets>;
    /// The offset in a lane, for the tests of groups.
    fn spread<S: Simd>(simd: S, offsets: &Self::Offsets, lane: usize) -> Self::Offset<S>;
    /// The rays of a group that enter a container no farther than `t`.
    fn enters<S: Simd>(
        simd: S,
        offset: &Self::Offset<S>,
        beam: &Beam,
        more: &Self::More,
        group: usize,
        t: f32x16<S>,
    ) -> mask32x16<S>;
}

/// From the origin to each box's near and far plane on each axis.
pub struct PlaneOffsets {
    near: [[f32; WIDTH]; 3],
    far: [[f32; WIDTH]; 3],
}

impl BeamContainer for Aabb {
    type More = ();
    type Offsets = PlaneOffsets;
    type Offset<S: Simd> = [[f32x16<S>; 3]; 2];
    const NO_RAYS: () = ();

    #[inline(always)]
    fn add_rays<S: Simd>(_: S, (): &mut (), _: usize, _: [f32x16<S>; 3], _: [usize; 3]) {}

    fn enclose((): &mut (), _: &Beam, _: [usize; 3]) {}

    /// Exact bounds of what the single rays compute, because rounding is monotone.
    #[inline(always)]
    fn interval<S: Simd>(simd: S, bounds: &Boxes, beam: &Beam, (): &(), reach: f32) -> Interval<PlaneOffsets> {
        let planes = &bounds.0;
        let origin = each!(axis => f32x8::splat(simd, beam.origin[axis]));
        let near = each!(axis => f32x8::load_array_ref(simd, &planes[axis][beam.near[axis] & 1]) - origin[axis]);
        let far = each!(axis => f32x8::load_array_ref(simd, &planes[axis][beam.near[axis] & 1 ^ 1]) - origin[axis]);
        // Each distance times the smallest and times the largest inverse direction, in the order of their size.
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
        let some = entry.simd_le(exit) & entry.simd_le(f32x8::splat(simd, reach));
        let latest_entry = near_t[0][1].max(near_t[1][1]).max(near_t[2][1].max(t_min));
        let earliest_exit = far_t[0][0].min(far_t[1][0]).min(far_t[2][0]) * FAR_SLACK;
        let all = latest_entry.simd_le(earliest_exit);
        Interval {
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
    fn spread<S: Simd>(simd: S, offsets: &PlaneOffsets, lane: usize) -> [[f32x16<S>; 3]; 2] {
        let lane = lane % WIDTH;
        [
            each!(axis => f32x16::splat(simd, offsets.near[axis][lane])),
            each!(axis => f32x16::splat(simd, offsets.far[axis][lane])),
        ]
    }

    #[inline(always)]
    fn enters<S: Simd>(
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

/// Rays as the tests of spheres need them.
pub struct Pyramid {
    unit_direction: [[[f32; GROUP]; 3]; GROUPS],
    inverse_length: [[f32; GROUP]; GROUPS],
    least_inverse_length: f32,
    /// The four planes through the origin that hold all rays between them: unit normals, outward.
    normals: [[f32; 3]; 4],
    /// Smallest and largest direction on the two shorter axes, as shares of the longest one.
    slopes: [[f32; 2]; 2],
}

/// From the origin to each sphere's middle.
pub struct CenterOffsets {
    to: [[f32; WIDTH]; 3],
    /// The radius and what may be lost by rounding.
    reach: [f32; WIDTH],
}

impl BeamContainer for Sphere {
    type More = Pyramid;
    type Offsets = CenterOffsets;
    type Offset<S: Simd> = ([f32x16<S>; 3], f32);
    const NO_RAYS: Pyramid = Pyramid {
        unit_direction: [[[0.0; GROUP]; 3]; GROUPS],
        inverse_length: [[0.0; GROUP]; GROUPS],
        least_inverse_length: f32::INFINITY,
        normals: [[0.0; 3]; 4],
        slopes: [[f32::INFINITY, f32::NEG_INFINITY]; 2],
    };

    #[inline(always)]
    fn add_rays<S: Simd>(simd: S, more: &mut Pyramid, group: usize, d: [f32x16<S>; 3], axes: [usize; 3]) {
        let inverse_length = f32x16::splat(simd, 1.0) / dot(d, d).sqrt();
        more.unit_direction[group] = each!(axis => (d[axis] * inverse_length).to_array());
        more.inverse_length[group] = inverse_length.to_array();
        more.least_inverse_length = more.least_inverse_length.min(inverse_length.reduce_min());
        for ([low, high], &axis) in more.slopes.iter_mut().zip(&axes) {
            let slope = d[axis] / d[axes[2]];
            (*low, *high) = (low.min(slope.reduce_min()), high.max(slope.reduce_max()));
        }
    }

    fn enclose(more: &mut Pyramid, beam: &Beam, axes: [usize; 3]) {
        let sign = if beam.near[axes[2]] == 1 { -1.0 } else { 1.0 };
        for (side, [low, high]) in more.slopes.into_iter().enumerate() {
            let axis = axes[side];
            for (normal, (slope, outward)) in more.normals[2 * side..].iter_mut().zip([(low, -sign), (high, sign)]) {
                let length = (1.0 + slope * slope).sqrt();
                (normal[axis], normal[axes[2]]) = (outward / length, -outward * slope / length);
            }
        }
    }

    #[inline(always)]
    fn interval<S: Simd>(
        simd: S,
        bounds: &Spheres,
        beam: &Beam,
        more: &Pyramid,
        reach: f32,
    ) -> Interval<CenterOffsets> {
        let splat = |value| f32x8::splat(simd, value);
        let radius = f32x8::load_array_ref(simd, &bounds.radius);
        let to = each!(axis => f32x8::load_array_ref(simd, &bounds.center[axis]) - splat(beam.origin[axis]));
        let size = to[0].abs() + to[1].abs() + to[2].abs() + radius;
        let padded = radius + size * SPHERE_ENTRY_ERROR;
        let loose = radius + size * PYRAMID_ERROR;
        let mut outside = radius.simd_lt(splat(0.0));
        for normal in &more.normals {
            let above = to[0] * normal[0] + to[1] * normal[1] + to[2] * normal[2];
            outside |= above.simd_gt(loose);
        }
        let squared = dot(to, to);
        let t_min = splat(beam.t_min);
        let near = (squared.sqrt() - loose) * more.least_inverse_length - SPHERE_T_ERROR;
        // Squares that are not normal numbers tell nothing.
        let is_told =
            squared.simd_ge(splat(SPHERE_TINY_RADIUS * SPHERE_TINY_RADIUS)) & squared.simd_le(splat(f32::MAX));
        let entry = (is_told & near.simd_gt(t_min)).select(near, t_min);
        let some = !(outside | entry.simd_gt(splat(reach)));
        // The origin lies within.
        let all = is_told & squared.simd_lt(radius * radius);
        Interval {
            some: some.to_bitmask() as u32,
            all: all.to_bitmask() as u32,
            entry: entry.to_array(),
            offsets: CenterOffsets { to: each!(axis => to[axis].to_array()), reach: padded.to_array() },
        }
    }

    #[inline(always)]
    fn spread<S: Simd>(simd: S, offsets: &CenterOffsets, lane: usize) -> ([f32x16<S>; 3], f32) {
        let lane = lane % WIDTH;
        (each!(axis => f32x16::splat(simd, offsets.to[axis][lane])), offsets.reach[lane])
    }

    #[inline(always)]
    fn enters<S: Simd>(
        simd: S,
        (to, reach): &([f32x16<S>; 3], f32),
        beam: &Beam,
        more: &Pyramid,
        group: usize,
        t: f32x16<S>,
    ) -> mask32x16<S> {
        let unit_direction = &more.unit_direction[group];
        let unit_direction = each!(axis => f32x16::load_array_ref(simd, &unit_direction[axis]));
        let inverse_length = f32x16::load_array_ref(simd, &more.inverse_length[group]);
        let reach = f32x16::splat(simd, *reach);
        let Chord { inside, near, far } = Chord::new(simd, *to, reach, unit_direction, inverse_length);
        // Negated comparisons: a NaN counts as a hit.
        !(inside.simd_lt(f32x16::splat(simd, 0.0)) | far.simd_lt(f32x16::splat(simd, beam.t_min)) | near.simd_gt(t))
    }
}
