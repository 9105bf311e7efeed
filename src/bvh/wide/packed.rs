//! Rays as few numbers: what the tests of wide trees spread over their lanes.

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, SimdMask, f32x8, u32x8};

use super::WIDTH;
use super::block::BLOCK;
use crate::bvh::{Container, ContainerKind};
use crate::geometry::{PARALLEL_PAD, Ray};

/// Rays that are prepared side by side.
pub(super) const PACKED: usize = 8;

/// What the tests of `N` rays need, a multiple of [`PACKED`], number by number: as
/// [`PreparedRay`](crate::geometry::PreparedRay) and [`Shear`](crate::geometry::Shear) have it, with the same roundings.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct PackedRays<const N: usize> {
    pub(super) origin_low: [[f32; N]; 3],
    pub(super) origin_high: [[f32; N]; 3],
    pub(super) inverse: [[f32; N]; 3],
    /// For each axis 0 where the lower plane is near, [`WIDTH`] where the upper one is: so many numbers farther.
    pub(super) near: [[u32; N]; 3],
    pub(super) t_min: [f32; N],
    /// The factors of the shear's rows.
    pub(super) factors: [[f32; N]; 3],
    /// Where in a corner's numbers the axes of the shear begin, the longest last.
    pub(super) axes: [[u32; N]; 3],
    /// The origin along these axes.
    pub(super) sheared_origin: [[f32; N]; 3],
    /// From here on for spheres alone.
    pub(super) origin: [[f32; N]; 3],
    pub(super) unit_direction: [[f32; N]; 3],
    pub(super) inverse_length: [f32; N],
}

impl<const N: usize> PackedRays<N> {
    /// No ray at all.
    pub(super) const EMPTY: Self = Self {
        origin_low: [[0.0; N]; 3],
        origin_high: [[0.0; N]; 3],
        inverse: [[0.0; N]; 3],
        near: [[0; N]; 3],
        t_min: [0.0; N],
        factors: [[0.0; N]; 3],
        axes: [[0; N]; 3],
        sheared_origin: [[0.0; N]; 3],
        origin: [[0.0; N]; 3],
        unit_direction: [[0.0; N]; 3],
        inverse_length: [0.0; N],
    };

    /// Takes the first eight of `rays`, for tests against these containers, as numbers `first` and on, a multiple of
    /// [`PACKED`]. One bit for each that can hit something.
    #[inline(always)]
    pub(super) fn set<S: Simd, C: Container>(&mut self, simd: S, first: usize, rays: &[Ray]) -> u32 {
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
        // As `permuted_axes` has them.
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
        let row = |axis: usize| u32x8::splat(simd, (axis * BLOCK) as u32);
        let axes = [
            x_is_longest.select(row(1), y_before_z.select(row(2), row(0))),
            x_is_longest.select(row(2), y_before_z.select(row(0), row(1))),
            x_is_longest.select(row(0), y_before_z.select(row(1), row(2))),
        ];
        let (low_side, high_side) = (u32x8::splat(simd, 0), u32x8::splat(simd, WIDTH as u32));
        let first = first % N;
        let put = |list: &mut [f32; N], values: f32x8<S>| {
            list[first..][..PACKED].copy_from_slice(values.as_slice());
        };
        for axis in 0..3 {
            put(&mut self.origin_low[axis], o[axis] + pad[axis]);
            put(&mut self.origin_high[axis], o[axis] - pad[axis]);
            put(&mut self.inverse[axis], inverse[axis]);
            put(&mut self.factors[axis], factors[axis]);
            put(&mut self.sheared_origin[axis], sheared_origin[axis]);
            if C::KIND == ContainerKind::Sphere {
                put(&mut self.origin[axis], o[axis]);
                put(&mut self.unit_direction[axis], d[axis] * inverse_length);
            }
            let near = inverse[axis].simd_lt(zero).select(high_side, low_side);
            self.near[axis][first..][..PACKED].copy_from_slice(near.as_slice());
            self.axes[axis][first..][..PACKED].copy_from_slice(axes[axis].as_slice());
        }
        put(&mut self.t_min, t_min);
        if C::KIND == ContainerKind::Sphere {
            put(&mut self.inverse_length, inverse_length);
        }
        able.to_bitmask() as u32 & !(u32::MAX << rays.len().min(PACKED))
    }
}
