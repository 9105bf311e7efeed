//! Morton codes: points in space on one line, neighbours mostly close together.
//!
//! ```text
//! x = …x2 x1 x0   y = …y2 y1 y0   z = …z2 z1 z0
//! code = …x2 y2 z2 x1 y1 z1 x0 y0 z0
//! ```

use glam::Vec3;

use crate::geometry::Aabb;

/// Bits of a code in each axis; three times as many in all.
pub const BITS_PER_AXIS: u32 = 21;
/// Bits in each axis of the leading part of a code that is sorted first.
pub const COARSE_BITS_PER_AXIS: u32 = 10;

/// Maps points of a box to codes. The cells are cubes: the longest edge is cut into 2²¹ parts.
#[derive(Debug, Clone, Copy)]
pub struct MortonGrid {
    origin: Vec3,
    cells_per_unit: f32,
}

impl MortonGrid {
    /// The grid over `bounds`, which must be finite; a box without extent gives every point the code 0.
    pub fn new(bounds: &Aabb) -> Self {
        let extent = bounds.extent().max_element();
        let cells = (1_u32 << BITS_PER_AXIS) as f32 / extent;
        Self { origin: bounds.min, cells_per_unit: if cells.is_finite() { cells } else { 0.0 } }
    }

    /// The code of `point`, 63 bits.
    #[inline]
    pub fn code(&self, point: Vec3) -> u64 {
        let cell = ((point - self.origin) * self.cells_per_unit).clamp(Vec3::ZERO, Vec3::splat(MAX_CELL));
        spread(cell.x as u32) << 2 | spread(cell.y as u32) << 1 | spread(cell.z as u32)
    }

    /// The leading 30 bits of the code of `point`.
    #[inline]
    pub fn coarse_code(&self, point: Vec3) -> u32 {
        let cell = ((point - self.origin) * self.cells_per_unit).clamp(Vec3::ZERO, Vec3::splat(MAX_CELL));
        let [x, y, z] =
            [cell.x, cell.y, cell.z].map(|c| spread_coarse(c as u32 >> (BITS_PER_AXIS - COARSE_BITS_PER_AXIS)));
        x << 2 | y << 1 | z
    }
}

/// Largest cell number in an axis.
const MAX_CELL: f32 = ((1 << BITS_PER_AXIS) - 1) as f32;

/// Two zero bits in front of each of the lowest 21 bits.
#[inline]
fn spread(bits: u32) -> u64 {
    let mut x = u64::from(bits) & 0x001f_ffff;
    x = (x | x << 32) & 0x001f_0000_0000_ffff;
    x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

/// Two zero bits in front of each of the lowest 10 bits.
#[inline]
fn spread_coarse(bits: u32) -> u32 {
    let mut x = bits & 0x3ff;
    x = (x | x << 16) & 0x0300_00ff;
    x = (x | x << 8) & 0x0300_f00f;
    x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

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
        for point in [Vec3::new(123.0, 99_999.0, 1e6), Vec3::splat(last), Vec3::new(2e6, 0.5, 77.0)] {
            assert_eq!(u64::from(grid.coarse_code(point)), grid.code(point) >> 33);
        }
    }

    #[test]
    fn a_box_without_extent_has_one_code() {
        let grid = MortonGrid::new(&Aabb { min: Vec3::ONE, max: Vec3::ONE });
        assert_eq!(grid.code(Vec3::ONE), 0);
        assert_eq!(grid.coarse_code(Vec3::splat(7.0)), 0);
    }
}
