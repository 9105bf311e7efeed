//! Morton codes: interleaved bits of quantised coordinates, which order points along the Z curve.
//!
//! ```text
//! x = …x2 x1 x0   y = …y2 y1 y0   z = …z2 z1 z0
//! code = …x2 y2 z2 x1 y1 z1 x0 y0 z0
//! ```

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Bytes, Simd, SimdBase, SimdFloat, f32x4, i32x4, u32x4, u64x4};
use glam::Vec3;

use crate::geometry::Aabb;

/// Bits of a code per axis.
pub const BITS_PER_AXIS: u32 = 21;
/// Bits of a code.
pub const CODE_BITS: u32 = 3 * BITS_PER_AXIS;

/// Grid of cubic cells over a box, 2²¹ along its longest edge; maps points to Morton codes.
#[derive(Debug, Clone, Copy)]
pub struct MortonGrid {
    origin: Vec3,
    cells_per_unit: f32,
}

impl MortonGrid {
    /// The grid over `bounds`, which must be finite; a box of zero size gives every point the code 0.
    pub fn new(bounds: &Aabb) -> Self {
        let extent = bounds.extent().max_element();
        let cells = (1_u32 << BITS_PER_AXIS) as f32 / extent;
        Self { origin: bounds.min, cells_per_unit: if cells.is_finite() { cells } else { 0.0 } }
    }

    /// 63-bit Morton code of the cell that contains `point`.
    pub fn code(&self, point: Vec3) -> u64 {
        interleave(self.cell(point))
    }

    /// Coordinates of the cell that contains `point`, clamped to the grid.
    #[inline]
    pub fn cell(&self, point: Vec3) -> [u32; 3] {
        let cell = ((point - self.origin) * self.cells_per_unit).clamp(Vec3::ZERO, Vec3::splat(MAX_CELL));
        [cell.x as u32, cell.y as u32, cell.z as u32]
    }

    /// The box of the cells from `min` to `max`, both included. A grid of zero size has no cells but its origin.
    pub fn bounds_of_cells(&self, min: [u32; 3], max: [u32; 3]) -> Aabb {
        let origin = self.origin.as_dvec3();
        let unit = if self.cells_per_unit > 0.0 { 1.0 / f64::from(self.cells_per_unit) } else { 0.0 };
        let corner = |cell: glam::DVec3| (origin + cell * unit).as_vec3();
        let [min, max] = [min, max].map(|cell| glam::DVec3::from(cell.map(f64::from)));
        Aabb { min: corner(min), max: corner(max + 1.0) }
    }

    /// `length` in cells.
    pub fn cells_across(&self, length: f32) -> f32 {
        length * self.cells_per_unit
    }

    /// The codes of two points, in the first three lanes of each vector.
    #[inline(always)]
    pub fn codes<S: Simd>(&self, simd: S, points: [f32x4<S>; 2]) -> [u64; 2] {
        let (first, second) = (self.cell_lanes(simd, points[0]), self.cell_lanes(simd, points[1]));
        let (first, second) = simd.widen_u32x8(simd.combine_u32x4(first, second));
        [interleave_spread(simd, spread_all(first)), interleave_spread(simd, spread_all(second))]
    }

    /// [`Self::cell`] of a point whose coordinates are in the first three lanes.
    #[inline(always)]
    fn cell_lanes<S: Simd>(&self, simd: S, point: f32x4<S>) -> u32x4<S> {
        let origin = f32x4::from_slice(simd, &[self.origin.x, self.origin.y, self.origin.z, 0.0]);
        let cell = (point - origin) * self.cells_per_unit;
        let inside = cell.max(f32x4::splat(simd, 0.0)).min(f32x4::splat(simd, MAX_CELL));
        inside.to_int::<i32x4<S>>().bitcast()
    }
}

/// Largest cell coordinate along an axis.
pub const MAX_CELL: f32 = ((1 << BITS_PER_AXIS) - 1) as f32;
/// Shift and mask of each step of [`spread`].
const SPREAD: [(u32, u64); 5] = [
    (32, 0x001f_0000_0000_ffff),
    (16, 0x001f_0000_ff00_00ff),
    (8, 0x100f_00f0_0f00_f00f),
    (4, 0x10c3_0c30_c30c_30c3),
    (2, 0x1249_2492_4924_9249),
];

/// Inserts two zero bits before each of the lowest 21 bits.
fn spread(bits: u32) -> u64 {
    SPREAD.iter().fold(u64::from(bits) & 0x001f_ffff, |x, (shift, mask)| (x | x << shift) & mask)
}

/// Removes two bits before each of the lowest 21 bits: undoes [`spread`].
fn compact(bits: u64) -> u32 {
    (0..BITS_PER_AXIS).fold(0, |compact, bit| compact | ((bits >> (3 * bit) & 1) as u32) << bit)
}

/// Coordinates whose interleaved bits are `code`: undoes [`interleave`].
pub fn deinterleave(code: u64) -> [u32; 3] {
    [compact(code >> 2), compact(code >> 1), compact(code)]
}

/// Morton code of a cell: its coordinates' bits interleaved.
#[inline]
pub fn interleave([x, y, z]: [u32; 3]) -> u64 {
    spread(x) << 2 | spread(y) << 1 | spread(z)
}

/// Combines three spread coordinates into one code.
#[inline(always)]
fn interleave_spread<S: Simd>(simd: S, axes: u64x4<S>) -> u64 {
    let [x, y, z, _] = <[u64; 4]>::from(axes << u64x4::from_slice(simd, &[2, 1, 0, 0]));
    x | y | z
}

/// [`spread`] of four values of at most 21 bits.
#[inline(always)]
fn spread_all<S: Simd>(mut bits: u64x4<S>) -> u64x4<S> {
    for (shift, mask) in SPREAD {
        bits = (bits | bits << shift) & mask;
    }
    bits
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::SimdLevel;
    use crate::kernel::simd::dispatch_plain;

    #[test]
    fn bits_interleave_from_x_down_to_z() {
        let last = (1_u32 << BITS_PER_AXIS) as f32;
        let grid = MortonGrid::new(&Aabb { min: Vec3::ZERO, max: Vec3::splat(last) });
        for bit in 0..BITS_PER_AXIS {
            let at = (1_u32 << bit) as f32;
            assert_eq!(grid.code(Vec3::X * at), 1 << (3 * bit + 2));
            assert_eq!(grid.code(Vec3::Y * at), 1 << (3 * bit + 1));
            assert_eq!(grid.code(Vec3::Z * at), 1 << (3 * bit));
        }
        assert_eq!(grid.code(Vec3::splat(last)), (1 << 63) - 1, "the far corner stays inside");
    }

    #[test]
    fn vectors_give_the_same_codes_at_every_level() {
        let grid = MortonGrid::new(&Aabb { min: Vec3::new(-3.0, 0.5, 2.0), max: Vec3::new(7.0, 4.0, 9.0) });
        let points: Vec<Vec3> =
            (0..2000).map(|i| Vec3::new(-3.3, 0.4, 1.9) + i as f32 * Vec3::new(0.0052, 0.0019, 0.0037)).collect();
        for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
            for pair in points.chunks(2) {
                let codes = dispatch_plain!(level.level(), simd => {
                    let lanes = |point: Vec3| f32x4::from_slice(simd, &[point.x, point.y, point.z, 123.0]);
                    grid.codes(simd, [lanes(pair[0]), lanes(pair[1])])
                });
                assert_eq!(codes, [grid.code(pair[0]), grid.code(pair[1])], "{} {pair:?}", level.name());
            }
        }
    }

    #[test]
    fn a_box_of_zero_size_has_one_code() {
        let grid = MortonGrid::new(&Aabb { min: Vec3::ONE, max: Vec3::ONE });
        assert_eq!(grid.code(Vec3::ONE), 0);
        assert_eq!(grid.code(Vec3::splat(7.0)), 0);
    }
}
