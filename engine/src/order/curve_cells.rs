//! The boxes of cells behind the codes: all primitives whose codes begin with the same bits have their centroids in one box, whatever the
//! curve.

use crate::geometry::Aabb;
use crate::order::curve::CurveGrid;
use crate::order::morton::{BITS_PER_AXIS, CODE_BITS, deinterleave};
use crate::settings::Curve;

/// A box of cells of the grid, its corners included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CellBox {
    pub min: [u32; 3],
    pub max: [u32; 3],
}

impl CellBox {
    /// The cube of 2^`bits` cells along each edge around `cell`.
    fn cube(cell: [u32; 3], bits: u32) -> Self {
        let below = (1 << bits) - 1;
        Self { min: cell.map(|x| x & !below), max: cell.map(|x| x | below) }
    }

    /// The smallest box around both.
    pub fn union(self, other: Self) -> Self {
        let corner = |a: [u32; 3], b: [u32; 3], of: fn(u32, u32) -> u32| [0, 1, 2].map(|axis| of(a[axis], b[axis]));
        Self { min: corner(self.min, other.min, u32::min), max: corner(self.max, other.max, u32::max) }
    }
}

impl CurveGrid {
    /// The cells whose codes agree with `code` in all but the lowest `free_bits`, at most [`CODE_BITS`].
    pub fn cells_of_prefix(&self, code: u64, free_bits: u32) -> CellBox {
        debug_assert!(free_bits <= CODE_BITS);
        let free = (1_u64 << free_bits) - 1;
        let (low, high) = (code & !free, code | free);
        match self.curve {
            Curve::Morton => CellBox { min: deinterleave(low), max: deinterleave(high) },
            Curve::Hilbert => {
                // Whole cubes: one, or the two or four on one side of a larger one.
                let bits = free_bits / 3;
                let cubes = (0..1_u64 << (free_bits % 3)).map(|at| low | at << (3 * bits));
                let cubes = cubes.map(|code| CellBox::cube(hilbert_cell(code), bits));
                cubes.reduce(CellBox::union).unwrap_or(CellBox { min: [0; 3], max: [0; 3] })
            }
            Curve::Extended => {
                // The lowest bit of z is not in the code.
                let [low, high] = [low << 1, high << 1 | 1].map(axes_of_extended);
                let shift = BITS_PER_AXIS - 16;
                CellBox { min: low.map(|x| x << shift), max: high.map(|x| ((x + 1) << shift) - 1) }
            }
        }
    }

    /// The box of `cells`, in world space.
    pub fn bounds_of(&self, cells: &CellBox) -> Aabb {
        self.grid.bounds_of_cells(cells.min, cells.max)
    }
}

/// The cell with the index `code` along the Hilbert curve (Skilling, *Programming the Hilbert curve*, 2004).
fn hilbert_cell(code: u64) -> [u32; 3] {
    let mut cell = deinterleave(code);
    let turned = cell[2] >> 1;
    cell[2] ^= cell[1];
    cell[1] ^= cell[0];
    cell[0] ^= turned;
    for bit in 1..BITS_PER_AXIS {
        let below = (1 << bit) - 1;
        for axis in (0..3).rev() {
            if cell[axis] >> bit & 1 == 1 {
                cell[0] ^= below;
            } else {
                let exchanged = (cell[0] ^ cell[axis]) & below;
                cell[0] ^= exchanged;
                cell[axis] ^= exchanged;
            }
        }
    }
    cell
}

/// The leading 16 bits of each axis of an extended code with all of its 64 bits; the size is left out.
fn axes_of_extended(code: u64) -> [u32; 3] {
    [2, 1, 0].map(|axis| (0..16).fold(0, |x, bit| x | ((code >> (4 * bit + axis)) as u32 & 1) << bit))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::geometry::Triangle;

    /// Cells at which coordinates are whole numbers.
    fn grid(curve: Curve) -> CurveGrid {
        let last = (1_u32 << BITS_PER_AXIS) as f32;
        CurveGrid::new(&Aabb { min: Vec3::ZERO, max: Vec3::splat(last) }, curve)
    }

    #[test]
    fn a_prefix_has_exactly_the_cells_whose_codes_begin_with_it() {
        let mut state = 7_u32;
        let mut number = |below: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((u64::from(state) * u64::from(below)) >> 32) as u32
        };
        for curve in Curve::ALL {
            let grid = grid(curve);
            let code_of = |cell: [u32; 3], size: f32| {
                let at = Vec3::from(cell.map(|x| x as f32));
                grid.code(at, &Triangle { a: at, b: at + Vec3::splat(size), c: at })
            };
            for round in 0..2_000 {
                let size = number(1 << 20) as f32;
                let cell = [0; 3].map(|_: u32| number(1 << BITS_PER_AXIS));
                let (code, free_bits) = (code_of(cell, size), round % (CODE_BITS + 1));
                let cells = grid.cells_of_prefix(code, free_bits);
                let inside = |cell: [u32; 3]| (0..3).all(|i| (cells.min[i]..=cells.max[i]).contains(&cell[i]));
                assert!(inside(cell), "{curve:?}: {cell:?} is not in {cells:?}");
                assert_eq!(grid.cells_of_prefix(code, CODE_BITS), CellBox::cube([0; 3], BITS_PER_AXIS));
                // Corners of the box have the prefix, if their size has, and cells beside it have not.
                for corner in [cells.min, cells.max, [cells.min[0], cells.max[1], cells.min[2]]] {
                    assert_eq!(code_of(corner, size) >> free_bits, code >> free_bits, "{curve:?}, {free_bits} free");
                }
                for axis in 0..3 {
                    let mut beside = cells.min;
                    beside[axis] = if beside[axis] > 0 { beside[axis] - 1 } else { cells.max[axis] + 1 };
                    if beside[axis] < 1 << BITS_PER_AXIS {
                        assert_ne!(
                            code_of(beside, size) >> free_bits,
                            code >> free_bits,
                            "{curve:?}, {free_bits} free"
                        );
                    }
                }
            }
        }
    }
}
