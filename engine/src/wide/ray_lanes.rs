//! Rays in structure-of-arrays layout, prepared for the tests of wide trees.

use fearless_simd::{Select, Simd, SimdBase, SimdMask, f32x4, f32x8, mask32x8, u32x8};
use glam::Vec3;

use crate::geometry::{PARALLEL_PAD, Ray};
use crate::kernel::each;
use crate::kernel::lanes::Lanes;
use crate::wide::layout::WIDTH;

/// Number of rays that are prepared at a time.
pub(crate) const RAY_LANES: usize = 8;

/// The bits of three axes.
pub(crate) const AXES: u64 = 0b111;

/// The axes of the shear for rays in direction `d`, as chosen by [`Shear::new`](crate::geometry::Shear::new); the one along which rays
/// are sheared comes last.
pub(crate) fn permuted_axes(d: Vec3) -> [usize; 3] {
    let size = d.abs();
    if size.x >= size.y && size.x >= size.z {
        [1, 2, 0]
    } else if size.y >= size.z {
        [2, 0, 1]
    } else {
        [0, 1, 2]
    }
}

/// The same axes as [`permuted_axes`] of a direction, times eight, for rays that are so different from each other that the processor
/// predicts no branch. The fourth lane does not matter.
#[inline(always)]
fn shear_axes<S: Simd>(direction: f32x4<S>) -> [u32; 3] {
    /// The axes by the comparisons x >= y, y >= z and x >= z, the lowest bit first.
    const BY_COMPARISONS: [[u8; 4]; 8] = {
        const X: [u8; 4] = [8, 16, 0, 0];
        const Y: [u8; 4] = [16, 0, 8, 0];
        const Z: [u8; 4] = [0, 8, 16, 0];
        [Z, Z, Y, Y, Z, X, Y, X]
    };
    let size = direction.abs();
    let [next, last] = [size.slide::<1>(size), size.slide::<2>(size)];
    let comparisons = size.simd_ge(next).to_bitmask() & 3 | (size.simd_ge(last).to_bitmask() & 1) << 2;
    let axes = BY_COMPARISONS[comparisons as usize % 8];
    each!(part => u32::from(axes[part]))
}

/// `N` rays as tests against triangles need them, with the values of [`PreparedRay`](crate::geometry::PreparedRay) and
/// [`Shear`](crate::geometry::Shear), rounded alike.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub(crate) struct TriangleLanes<const N: usize> {
    pub(crate) origin_low: [[f32; N]; 3],
    pub(crate) origin_high: [[f32; N]; 3],
    /// Times origin - plane it is the distance of a plane: that order lets x86 load and subtract the plane in one instruction.
    pub(crate) negative_inverse: [[f32; N]; 3],
    pub(crate) t_min: [f32; N],
    /// Factors of the rows of the shear.
    pub(crate) factors: [[f32; N]; 3],
    /// Eight times the axes of the shear; the longest axis comes last.
    pub(crate) axes: [[u32; N]; 3],
    /// Origin in the order of these axes.
    pub(crate) sheared_origin: [[f32; N]; 3],
}

/// `N` rays, one or a multiple of [`RAY_LANES`], prepared for all tests.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct RayLanes<const N: usize> {
    pub(crate) triangles: TriangleLanes<N>,
    /// For each axis the offset of the near planes: 0 for the lower ones, [`WIDTH`] for the upper ones.
    pub(crate) near: [[u32; N]; 3],
    /// Values that only tests of other containers than boxes use, see [`RayRows`].
    pub(crate) others: [[f32; N]; OTHER_ROWS],
}

/// Number of rows of [`RayLanes::others`].
pub(crate) const OTHER_ROWS: usize = 12;

/// A container whose tests use rows of their own of [`RayLanes::others`].
pub trait RayRows {
    /// Number of these rows.
    const OTHER_ROWS: usize;
    /// Their values for rays with these origins and directions, one ray in each lane.
    fn other_rows<S: Simd, V: Lanes<S>>(simd: S, origin: [V; 3], direction: [V; 3]) -> [V; OTHER_ROWS];
}

impl RayLanes<1> {
    /// A single ray for containers of type `C`; `None` if it cannot hit anything.
    #[inline(always)]
    pub(crate) fn single<S: Simd, C: RayRows>(simd: S, ray: &Ray) -> Option<Self> {
        let splat = |value| f32x4::splat(simd, value);
        let (zero, one, largest) = (splat(0.0), splat(1.0), splat(f32::MAX));
        let [o, d] = origin_and_direction(simd, ray);
        let t_min = ray.t_min.max(0.0);
        let squared = ray.direction.length_squared();
        let origin_is_finite = o.abs().simd_le(largest).to_bitmask() & AXES == AXES;
        // NaN fails each comparison.
        if !(squared.is_normal() && origin_is_finite && t_min <= ray.t_max && t_min <= f32::MAX) {
            return None;
        }
        let inverse = one / d;
        let crosses = inverse.abs().simd_le(largest);
        let pad = crosses.select(zero, o.abs() * splat(2.0 * f32::EPSILON) + splat(PARALLEL_PAD));
        let inverse = crosses.select(inverse, largest);
        let is_negative = inverse.simd_lt(zero).to_bitmask() as u32;
        let mut others = [[0.0]; OTHER_ROWS];
        if C::OTHER_ROWS > 0 {
            let rows =
                C::other_rows(simd, each!(axis => splat(ray.origin[axis])), each!(axis => splat(ray.direction[axis])));
            for (other, row) in others.iter_mut().zip(rows) {
                *other = [row[0]];
            }
        }
        Some(Self {
            triangles: TriangleLanes::new(simd, ray, d, [o + pad, o - pad], inverse, t_min),
            near: each!(axis => [(is_negative >> axis & 1) * WIDTH as u32]),
            others,
        })
    }
}

/// Origin and direction of `ray` in the first three lanes of a vector each; the fourth is not used.
#[inline(always)]
pub(crate) fn origin_and_direction<S: Simd>(simd: S, ray: &Ray) -> [f32x4<S>; 2] {
    let fields: &[f32; 8] = bytemuck::cast_ref(ray);
    [f32x4::from_slice(simd, &fields[..4]), f32x4::from_slice(simd, &fields[3..7])]
}

/// The first three lanes.
#[inline(always)]
fn column<S: Simd>(vector: f32x4<S>) -> [[f32; 1]; 3] {
    let lanes = vector.to_array();
    each!(axis => [lanes[axis]])
}

impl TriangleLanes<1> {
    /// A single `ray`, `inverse` being the reciprocals of its `direction`, `origins` its origin for tests against lower and upper planes.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(
        simd: S,
        ray: &Ray,
        direction: f32x4<S>,
        origins: [f32x4<S>; 2],
        inverse: f32x4<S>,
        t_min: f32,
    ) -> Self {
        let fields: &[f32; 8] = bytemuck::cast_ref(ray);
        let axes = shear_axes(direction);
        let [x, y, z] = axes.map(|axis| fields[3 + axis as usize / 8 % 4]);
        let numerators = f32x4::load_array_ref(simd, &[-x, -y, 1.0, 1.0]);
        Self {
            origin_low: column(origins[0]),
            origin_high: column(origins[1]),
            negative_inverse: column(-inverse),
            t_min: [t_min],
            factors: column(numerators / f32x4::splat(simd, z)),
            axes: axes.map(|axis| [axis]),
            sheared_origin: axes.map(|axis| [fields[axis as usize / 8 % 4]]),
        }
    }
}

impl<const N: usize> TriangleLanes<N> {
    /// No rays.
    const EMPTY: Self = Self {
        origin_low: [[0.0; N]; 3],
        origin_high: [[0.0; N]; 3],
        negative_inverse: [[0.0; N]; 3],
        t_min: [0.0; N],
        factors: [[0.0; N]; 3],
        axes: [[0; N]; 3],
        sheared_origin: [[0.0; N]; 3],
    };
}

impl<const N: usize> RayLanes<N> {
    /// No rays.
    pub(crate) const EMPTY: Self =
        Self { triangles: TriangleLanes::EMPTY, near: [[0; N]; 3], others: [[0.0; N]; OTHER_ROWS] };

    /// Prepares the first eight of `rays` for containers of type `C` and stores them from index `first` on, a multiple
    /// of [`RAY_LANES`]. Returns a mask of the rays that can hit anything.
    #[inline(always)]
    pub(crate) fn set<S: Simd, C: RayRows>(&mut self, simd: S, first: usize, rays: &[Ray]) -> u32 {
        if rays.is_empty() {
            return 0;
        }
        let [ox, oy, oz, dx, dy, dz, t_min, t_max] = transposed(simd, rays);
        let (o, d) = ([ox, oy, oz], [dx, dy, dz]);
        let first = first % N;
        let can_hit = self.set_slabs(
            simd,
            first,
            [o, d],
            [t_min, t_max],
            #[inline(always)]
            |_, pad, _| pad,
        );
        self.set_shear(simd, first, [o, d]);
        if C::OTHER_ROWS > 0 {
            for (other, row) in self.others.iter_mut().zip(C::other_rows(simd, o, d)).take(C::OTHER_ROWS) {
                put(other, first, row);
            }
        }
        can_hit.to_bitmask() as u32 & !(u32::MAX << rays.len().min(RAY_LANES))
    }

    /// Stores what tests of planes along the axes need. `o` and `d` are origins and directions; `pad` gets an axis, how far the origins for
    /// tests of lower and upper planes are to be apart from the origin, and whether the direction is negative there, and returns what they
    /// shall be apart. Returns the rays that can hit anything.
    #[inline(always)]
    pub(crate) fn set_slabs<S: Simd>(
        &mut self,
        simd: S,
        first: usize,
        [o, d]: [[f32x8<S>; 3]; 2],
        [t_min, t_max]: [f32x8<S>; 2],
        pad: impl Fn(usize, f32x8<S>, mask32x8<S>) -> f32x8<S>,
    ) -> mask32x8<S> {
        let splat = |value| f32x8::splat(simd, value);
        let (zero, one, largest) = (splat(0.0), splat(1.0), splat(f32::MAX));
        let t_min = t_min.simd_gt(zero).select(t_min, zero);
        let squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        let (low_side, high_side) = (u32x8::splat(simd, 0), u32x8::splat(simd, WIDTH as u32));
        for axis in 0..3 {
            let inverse = one / d[axis];
            let crosses = inverse.abs().simd_le(largest);
            let parallel_pad = o[axis].abs() * splat(2.0 * f32::EPSILON) + splat(PARALLEL_PAD);
            let inverse = crosses.select(inverse, largest);
            let is_negative = inverse.simd_lt(zero);
            let pad = pad(axis, crosses.select(zero, parallel_pad), is_negative);
            put(&mut self.triangles.origin_low[axis], first, o[axis] + pad);
            put(&mut self.triangles.origin_high[axis], first, o[axis] - pad);
            put(&mut self.triangles.negative_inverse[axis], first, -inverse);
            let near = is_negative.select(high_side, low_side);
            self.near[axis][first..][..RAY_LANES].copy_from_slice(near.as_slice());
        }
        put(&mut self.triangles.t_min, first, t_min);
        squared.simd_ge(splat(f32::MIN_POSITIVE))
            & squared.simd_le(largest)
            & o[0].abs().simd_le(largest)
            & o[1].abs().simd_le(largest)
            & o[2].abs().simd_le(largest)
            & t_min.simd_le(t_max)
            & t_min.simd_le(largest)
    }

    /// Stores the shear of triangles for origins `o` and directions `d`.
    #[inline(always)]
    fn set_shear<S: Simd>(&mut self, simd: S, first: usize, [o, d]: [[f32x8<S>; 3]; 2]) {
        let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
        let size = each!(axis => d[axis].abs());
        let x_is_longest = size[0].simd_ge(size[1]) & size[0].simd_ge(size[2]);
        let y_before_z = size[1].simd_ge(size[2]);
        // The same choice as in `permuted_axes`.
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
        let row = |axis: usize| u32x8::splat(simd, 8 * axis as u32);
        let axes = [
            x_is_longest.select(row(1), y_before_z.select(row(2), row(0))),
            x_is_longest.select(row(2), y_before_z.select(row(0), row(1))),
            x_is_longest.select(row(0), y_before_z.select(row(1), row(2))),
        ];
        for axis in 0..3 {
            put(&mut self.triangles.factors[axis], first, factors[axis]);
            put(&mut self.triangles.sheared_origin[axis], first, sheared_origin[axis]);
            self.triangles.axes[axis][first..][..RAY_LANES].copy_from_slice(axes[axis].as_slice());
        }
    }
}

/// Stores eight numbers from index `first` on.
#[inline(always)]
fn put<S: Simd, const N: usize>(row: &mut [f32; N], first: usize, values: f32x8<S>) {
    row[first..][..RAY_LANES].copy_from_slice(values.as_slice());
}

/// Transposes the first eight of `rays`, at least one: origin, direction, `t_min` and `t_max`, one ray per lane. The
/// last ray fills the remaining lanes.
#[inline(always)]
pub(crate) fn transposed<S: Simd>(simd: S, rays: &[Ray]) -> [f32x8<S>; RAY_LANES] {
    let padded;
    let rays: &[Ray; RAY_LANES] = if let Some(rays) = rays.first_chunk() {
        rays
    } else {
        padded = std::array::from_fn(|lane| rays[lane.min(rays.len() - 1)]);
        &padded
    };
    let rows: &[[f32; RAY_LANES]; RAY_LANES] = bytemuck::cast_ref(rays);
    let mut rows = [
        f32x8::load_array_ref(simd, &rows[0]),
        f32x8::load_array_ref(simd, &rows[1]),
        f32x8::load_array_ref(simd, &rows[2]),
        f32x8::load_array_ref(simd, &rows[3]),
        f32x8::load_array_ref(simd, &rows[4]),
        f32x8::load_array_ref(simd, &rows[5]),
        f32x8::load_array_ref(simd, &rows[6]),
        f32x8::load_array_ref(simd, &rows[7]),
    ];
    // Each round rotates the six bits of row and lane by one.
    for _ in 0..3 {
        let [a, b, c, d, e, f, g, h] = rows;
        let ((a, b), (c, d), (e, f), (g, h)) = (a.interleave(e), b.interleave(f), c.interleave(g), d.interleave(h));
        rows = [a, b, c, d, e, f, g, h];
    }
    rows
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::kernel::SimdLevel;
    use crate::kernel::simd::dispatch;

    #[test]
    fn rays_are_transposed_at_every_simd_level() {
        let rays: Vec<Ray> = (0..9)
            .map(|ray| {
                let value = |field: u8| f32::from(10 * ray + field);
                let [origin, direction] = [0, 3].map(|at| Vec3::new(value(at), value(at + 1), value(at + 2)));
                Ray { origin, direction, t_min: value(6), t_max: value(7) }
            })
            .collect();
        for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
            for count in [1, 5, 8, 9] {
                let found = dispatch!(level.level(), simd => transposed(simd, &rays[..count]).map(SimdBase::to_array));
                for (field, row) in found.iter().enumerate() {
                    let expected = std::array::from_fn(|lane| (10 * lane.min(count - 1) + field) as f32);
                    assert_eq!(*row, expected, "{level:?}, {count} rays, field {field}");
                }
            }
        }
    }
}
