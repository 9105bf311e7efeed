//! Codes of primitives along a curve through space: by Morton, by Hilbert, or by Morton with the primitives' size.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "plain loops over lanes, which compilers make vectors of")]

use fearless_simd::{Simd, SimdBase, f32x4};
use glam::Vec3;

use crate::geometry::{Aabb, Triangle};
use crate::kernel::lanes::LANES;
use crate::order::morton::{BITS_PER_AXIS, MAX_CELL, MortonGrid, join_spread};
use crate::settings::Curve;

/// Maps primitives to codes of 63 bits.
#[derive(Debug, Clone, Copy)]
pub struct CurveGrid {
    grid: MortonGrid,
    curve: Curve,
}

impl CurveGrid {
    /// The grid over `bounds`, see [`MortonGrid::new`].
    pub fn new(bounds: &Aabb, curve: Curve) -> Self {
        Self { grid: MortonGrid::new(bounds), curve }
    }

    /// The code of `triangle`, whose container has its middle at `middle`.
    pub fn code(&self, middle: Vec3, triangle: &Triangle) -> u64 {
        match self.curve {
            Curve::Morton => self.grid.code(middle),
            Curve::Hilbert => {
                let mut cells = self.grid.cell(middle).map(|cell| [cell]);
                hilbert(&mut cells);
                join_spread(cells.map(|[cell]| cell))
            }
            Curve::Extended => self.extended(self.grid.cell(middle), triangle),
        }
    }

    /// The codes of eight `triangles`, whose containers have their middles in the first three lanes of `middles`.
    #[inline(always)]
    pub fn codes<S: Simd>(&self, simd: S, middles: &[f32x4<S>; LANES], triangles: &[Triangle; LANES]) -> [u64; LANES] {
        let mut codes = [0; LANES];
        if self.curve == Curve::Morton {
            for (codes, middles) in codes.chunks_exact_mut(2).zip(middles.chunks_exact(2)) {
                codes.copy_from_slice(&self.grid.codes(simd, [middles[0], middles[1]]));
            }
            return codes;
        }
        let mut cells = [[0; LANES]; 3];
        for lane in 0..LANES {
            let [x, y, z] = self.grid.cell(Vec3::from_slice(middles[lane].as_slice()));
            (cells[0][lane], cells[1][lane], cells[2][lane]) = (x, y, z);
        }
        if self.curve == Curve::Hilbert {
            hilbert(&mut cells);
        }
        for (lane, (code, triangle)) in codes.iter_mut().zip(triangles).enumerate() {
            let cell = [cells[0][lane], cells[1][lane], cells[2][lane]];
            *code = if self.curve == Curve::Hilbert { join_spread(cell) } else { self.extended(cell, triangle) };
        }
        codes
    }

    /// In turn a bit of the size, then one of each axis: large primitives part from small ones (Vinkler, Bittner, Havran,
    /// *Extended Morton Codes for High Performance Bounding Volume Hierarchy Construction*, HPG 2017, section 3). The size
    /// is the diagonal of the triangle's box in diagonals of the grid.
    fn extended(&self, [x, y, z]: [u32; 3], triangle: &Triangle) -> u64 {
        let diagonal = self.grid.cells_across(triangle.bounds().extent().length()) / 3_f32.sqrt();
        let size = diagonal.clamp(0.0, MAX_CELL) as u32;
        let [size, x, y, z] = [size, x, y, z].map(|number| spread_by_four(number >> (BITS_PER_AXIS - 16)));
        (size << 3 | x << 2 | y << 1 | z) >> 1
    }
}

/// Turns the cell numbers of `N` points, axis by axis, into those whose bits, interleaved, number the cells along the Hilbert
/// curve (Skilling, *Programming the Hilbert curve*, 2004). Each bit of such a code halves a box of cells, as those of Morton
/// codes do.
#[inline(always)]
fn hilbert<const N: usize>(cells: &mut [[u32; N]; 3]) {
    // All ones where the bit is set.
    let ones = |number: u32, bit: u32| 0_u32.wrapping_sub(number >> bit & 1);
    for bit in (1..BITS_PER_AXIS).rev() {
        let below = (1 << bit) - 1;
        for axis in 0..3 {
            for lane in 0..N {
                let set = ones(cells[axis][lane], bit);
                // Inverts the lower bits of the first axis, or exchanges them.
                let exchanged = (cells[0][lane] ^ cells[axis][lane]) & below & !set;
                cells[0][lane] ^= below & set | exchanged;
                cells[axis][lane] ^= exchanged;
            }
        }
    }
    for lane in 0..N {
        cells[1][lane] ^= cells[0][lane];
        cells[2][lane] ^= cells[1][lane];
        let mut turned = 0;
        for bit in (1..BITS_PER_AXIS).rev() {
            turned ^= ((1 << bit) - 1) & ones(cells[2][lane], bit);
        }
        for axis in 0..3 {
            cells[axis][lane] ^= turned;
        }
    }
}

/// Three zero bits in front of each of the lowest 16 bits.
fn spread_by_four(bits: u32) -> u64 {
    const SPREAD: [(u32, u64); 4] = [
        (24, 0x0000_00ff_0000_00ff),
        (12, 0x000f_000f_000f_000f),
        (6, 0x0303_0303_0303_0303),
        (3, 0x1111_1111_1111_1111),
    ];
    SPREAD.iter().fold(u64::from(bits), |x, (shift, mask)| (x | x << shift) & mask)
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;

    use super::*;
    use crate::kernel::SimdLevel;

    const SIDE: f32 = (1 << BITS_PER_AXIS) as f32;

    fn grid(curve: Curve) -> CurveGrid {
        CurveGrid::new(&Aabb { min: Vec3::ZERO, max: Vec3::splat(SIDE) }, curve)
    }

    fn point(at: Vec3) -> Triangle {
        Triangle { a: at, b: at, c: at }
    }

    #[test]
    fn cells_that_follow_each_other_along_the_hilbert_curve_touch() {
        // The 512 cells of the third halving, by the first nine bits of their codes.
        let grid = grid(Curve::Hilbert);
        let mut cells: Vec<(u64, [i32; 3])> = (0..512)
            .map(|number| {
                let cell = [number >> 6, number >> 3 & 7, number & 7];
                let middle = Vec3::from_array(cell.map(|part| (part as f32 + 0.5) * SIDE / 8.0));
                (grid.code(middle, &point(middle)) >> 54, cell)
            })
            .collect();
        cells.sort_unstable();
        assert!(cells.iter().map(|(code, _)| *code).eq(0..512), "each code once");
        for pair in cells.windows(2) {
            let steps: i32 = pair[0].1.iter().zip(pair[1].1).map(|(a, b)| (a - b).abs()).sum();
            assert_eq!(steps, 1, "{pair:?}");
        }
    }

    #[test]
    fn extended_codes_tell_large_from_small_first() {
        let grid = grid(Curve::Extended);
        let at = |size: f32, x: f32| {
            let corner = Vec3::new(x, 0.0, 0.0);
            grid.code(corner, &Triangle { a: corner, b: corner + Vec3::splat(size), c: corner })
        };
        let (large, small, far) = (at(SIDE * 0.6, 0.0), at(SIDE * 0.01, 0.0), at(SIDE * 0.01, SIDE * 0.9));
        assert!(large >> 62 == 1 && small >> 62 == 0 && far >> 62 == 0, "the first bit is the size's");
        assert!(small < far && far < large);
        assert_eq!(at(0.0, 0.0), 0);
        assert_eq!(spread_by_four(0xffff), 0x1111_1111_1111_1111);
        for bit in 0..16 {
            assert_eq!(spread_by_four(1 << bit), 1 << (4 * bit));
        }
    }

    #[test]
    fn eight_at_a_time_give_the_same_codes_at_every_level() {
        let triangles: Vec<Triangle> = (0..800)
            .map(|i| {
                let a = Vec3::new(1.3, 2.7, 0.9) * i as f32 * 700.0;
                Triangle { a, b: a + Vec3::X * (i % 7) as f32 * 9e4, c: a + Vec3::Y * (i % 5) as f32 * 2e5 }
            })
            .collect();
        for curve in Curve::ALL {
            let grid = grid(curve);
            for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
                for triangles in triangles.as_chunks::<LANES>().0 {
                    let middles = triangles.map(|triangle| triangle.bounds().center());
                    let codes = dispatch!(level.level_of_plain_loops(), simd => {
                        let lanes = middles.map(|middle| f32x4::from_slice(simd, &[middle.x, middle.y, middle.z, 5.0]));
                        grid.codes(simd, &lanes, triangles)
                    });
                    let mut expected = [0; LANES];
                    for lane in 0..LANES {
                        expected[lane] = grid.code(middles[lane], &triangles[lane]);
                    }
                    assert_eq!(codes, expected, "{} {}", curve.name(), level.name());
                }
            }
        }
    }
}
