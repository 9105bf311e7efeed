//! A ray as few numbers: what the tests of wide trees spread over their lanes.

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, SimdMask, f32x8};

use super::WIDTH;
use super::block::{permuted_axes, permuted_axes_of};
use crate::geometry::{PARALLEL_PAD, PreparedRay, Ray};

/// What the tests of one ray need, one number each.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct PackedRay {
    /// As [`PreparedRay`] has them.
    pub(super) origin_low: [f32; 3],
    pub(super) origin_high: [f32; 3],
    pub(super) inverse: [f32; 3],
    /// For each axis 0 where the lower plane is near, [`WIDTH`] where the upper one is: so many numbers farther.
    pub(super) near: [u32; 3],
    pub(super) t_min: f32,
    pub(super) t_max: f32,
    /// The factors of [`Shear`](crate::geometry::Shear)'s rows.
    pub(super) factors: [f32; 3],
    /// The axes of the shear, the longest last.
    pub(super) axes: [u32; 3],
    /// The origin along these axes.
    pub(super) sheared_origin: [f32; 3],
    pub(super) origin: [f32; 3],
    pub(super) unit_direction: [f32; 3],
    pub(super) inverse_length: f32,
}

impl PackedRay {
    /// No ray at all.
    pub(super) const EMPTY: Self = Self {
        origin_low: [0.0; 3],
        origin_high: [0.0; 3],
        inverse: [0.0; 3],
        near: [0; 3],
        t_min: 0.0,
        t_max: 0.0,
        factors: [0.0; 3],
        axes: [0; 3],
        sheared_origin: [0.0; 3],
        origin: [0.0; 3],
        unit_direction: [0.0; 3],
        inverse_length: 0.0,
    };

    #[inline(always)]
    pub(super) fn new(ray: &PreparedRay) -> Self {
        let PreparedRay { ray, inverse_direction, origin_low, origin_high, unit_direction, inverse_length, .. } = *ray;
        let axes = permuted_axes(ray.direction);
        let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
        let along = direction[axes[2]];
        Self {
            origin_low: origin_low.to_array(),
            origin_high: origin_high.to_array(),
            inverse: inverse_direction.to_array(),
            near: each!(axis => u32::from(inverse_direction[axis] < 0.0) * WIDTH as u32),
            t_min: ray.t_min,
            t_max: ray.t_max,
            factors: [-direction[axes[0]] / along, -direction[axes[1]] / along, 1.0 / along],
            axes: each!(part => axes[part] as u32),
            sheared_origin: each!(part => origin[axes[part]]),
            origin,
            unit_direction: unit_direction.to_array(),
            inverse_length,
        }
    }
}

/// Rays that are packed side by side.
pub(super) const PACKED: usize = 8;

type Lanes = [f32; PACKED];

/// Up to eight rays, lane by lane: step by step what [`PreparedRay::new`] and [`PackedRay::new`] do for one.
pub(super) struct PackedRays {
    origin_low: [Lanes; 3],
    origin_high: [Lanes; 3],
    inverse: [Lanes; 3],
    t_min: Lanes,
    factors: [Lanes; 3],
    sheared_origin: [Lanes; 3],
    unit_direction: [Lanes; 3],
    inverse_length: Lanes,
    /// One bit for each ray: see [`permuted_axes_of`].
    x_is_longest: u32,
    y_before_z: u32,
    /// One bit for each ray with a negative direction on an axis.
    negative: [u32; 3],
    /// One bit for each ray that can hit something.
    pub(super) able: u32,
}

impl PackedRays {
    /// Packs the first eight of `rays`.
    #[inline(always)]
    pub(super) fn new<S: Simd>(simd: S, rays: &[Ray]) -> Self {
        let mut lanes = [[0.0; PACKED]; 8];
        for (lane, ray) in rays.iter().take(PACKED).enumerate() {
            let (o, d) = (ray.origin, ray.direction);
            for (values, value) in lanes.iter_mut().zip([o.x, o.y, o.z, d.x, d.y, d.z, ray.t_min, ray.t_max]) {
                values[lane] = value;
            }
        }
        let load = |part: usize| f32x8::load_array_ref(simd, &lanes[part]);
        let splat = |value| f32x8::splat(simd, value);
        let (zero, one, largest) = (splat(0.0), splat(1.0), splat(f32::MAX));
        let (o, d) = (each!(axis => load(axis)), each!(axis => load(3 + axis)));
        let (given_t_min, t_max) = (load(6), load(7));
        let t_min = given_t_min.simd_gt(zero).select(given_t_min, zero);
        let squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        let able = squared.simd_ge(splat(f32::MIN_POSITIVE))
            & squared.simd_le(largest)
            & o[0].abs().simd_le(largest)
            & o[1].abs().simd_le(largest)
            & o[2].abs().simd_le(largest)
            & t_min.simd_le(t_max);
        let inverse_length = one / squared.sqrt();
        let inverse = each!(axis => one / d[axis]);
        let crosses = each!(axis => inverse[axis].abs().simd_le(largest));
        let pad = each!(axis => {
            crosses[axis].select(zero, o[axis].abs() * splat(2.0 * f32::EPSILON) + splat(PARALLEL_PAD))
        });
        let inverse = each!(axis => crosses[axis].select(inverse[axis], largest));
        let size = each!(axis => d[axis].abs());
        let x_is_longest = size[0].simd_ge(size[1]) & size[0].simd_ge(size[2]);
        let y_before_z = size[1].simd_ge(size[2]);
        // As `permuted_axes_of` has them.
        let permuted = |v: [f32x8<S>; 3]| {
            [
                x_is_longest.select(v[1], y_before_z.select(v[2], v[0])),
                x_is_longest.select(v[2], y_before_z.select(v[0], v[1])),
                x_is_longest.select(v[0], y_before_z.select(v[1], v[2])),
            ]
        };
        let [x, y, z] = permuted(d);
        let factors = [(zero - x) / z, (zero - y) / z, one / z];
        let sheared_origin = permuted(o);
        Self {
            origin_low: each!(axis => (o[axis] + pad[axis]).to_array()),
            origin_high: each!(axis => (o[axis] - pad[axis]).to_array()),
            inverse: each!(axis => inverse[axis].to_array()),
            t_min: t_min.to_array(),
            factors: each!(part => factors[part].to_array()),
            sheared_origin: each!(part => sheared_origin[part].to_array()),
            unit_direction: each!(axis => (d[axis] * inverse_length).to_array()),
            inverse_length: inverse_length.to_array(),
            x_is_longest: x_is_longest.to_bitmask() as u32,
            y_before_z: y_before_z.to_bitmask() as u32,
            negative: each!(axis => inverse[axis].simd_lt(zero).to_bitmask() as u32),
            able: able.to_bitmask() as u32 & !(u32::MAX << rays.len().min(PACKED)),
        }
    }

    /// The ray in a lane, which is `ray`.
    #[inline(always)]
    pub(super) fn get(&self, lane: usize, ray: &Ray) -> PackedRay {
        let lane = lane % PACKED;
        let axes = permuted_axes_of(self.x_is_longest >> lane & 1 != 0, self.y_before_z >> lane & 1 != 0);
        PackedRay {
            origin_low: each!(axis => self.origin_low[axis][lane]),
            origin_high: each!(axis => self.origin_high[axis][lane]),
            inverse: each!(axis => self.inverse[axis][lane]),
            near: each!(axis => (self.negative[axis] >> lane & 1) * WIDTH as u32),
            t_min: self.t_min[lane],
            t_max: ray.t_max,
            factors: each!(part => self.factors[part][lane]),
            axes: each!(part => axes[part] as u32),
            sheared_origin: each!(part => self.sheared_origin[part][lane]),
            origin: ray.origin.to_array(),
            unit_direction: each!(axis => self.unit_direction[axis][lane]),
            inverse_length: self.inverse_length[lane],
        }
    }
}
