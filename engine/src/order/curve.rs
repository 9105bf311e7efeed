//! Codes of primitives along a space-filling curve: Morton's, Hilbert's, or Morton's with the primitive's size.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "plain loops over lanes, which the compiler vectorises")]

use fearless_simd::{Simd, SimdBase, f32x4};
use glam::Vec3;

use crate::geometry::{Aabb, Triangle};
use crate::kernel::lanes::LANES;
use crate::order::morton::{BITS_PER_AXIS, MAX_CELL, MortonGrid, interleave};
use crate::settings::Curve;

/// Maps primitives to 63-bit codes along a curve.
#[derive(Debug, Clone, Copy)]
pub struct CurveGrid {
    pub(super) grid: MortonGrid,
    pub(super) curve: Curve,
}

impl CurveGrid {
    /// The grid over `bounds`, see [`MortonGrid::new`].
    pub fn new(bounds: &Aabb, curve: Curve) -> Self {
        Self { grid: MortonGrid::new(bounds), curve }
    }

    /// The code of `triangle`, whose container has its centroid at `centroid`.
    pub fn code(&self, centroid: Vec3, triangle: &Triangle) -> u64 {
        match self.curve {
            Curve::Morton => self.grid.code(centroid),
            Curve::Hilbert => {
                let mut cells = self.grid.cell(centroid).map(|cell| [cell]);
                hilbert(&mut cells);
                interleave(cells.map(|[cell]| cell))
            }
            Curve::Extended => self.extended(self.grid.cell(centroid), triangle),
        }
    }

    /// The codes of eight `triangles`, whose containers' centroids are in the first three lanes of `centroids`.
    #[inline(always)]
    pub fn codes<S: Simd>(
        &self,
        simd: S,
        centroids: &[f32x4<S>; LANES],
        triangles: &[Triangle; LANES],
    ) -> [u64; LANES] {
        let mut codes = [0; LANES];
        if self.curve == Curve::Morton {
            for (codes, centroids) in codes.chunks_exact_mut(2).zip(centroids.chunks_exact(2)) {
                codes.copy_from_slice(&self.grid.codes(simd, [centroids[0], centroids[1]]));
            }
            return codes;
        }
        let mut cells = [[0; LANES]; 3];
        for lane in 0..LANES {
            let [x, y, z] = self.grid.cell(Vec3::from_slice(centroids[lane].as_slice()));
            (cells[0][lane], cells[1][lane], cells[2][lane]) = (x, y, z);
        }
        if self.curve == Curve::Hilbert {
            hilbert(&mut cells);
        }
        for (lane, (code, triangle)) in codes.iter_mut().zip(triangles).enumerate() {
            let cell = [cells[0][lane], cells[1][lane], cells[2][lane]];
            *code = if self.curve == Curve::Hilbert { interleave(cell) } else { self.extended(cell, triangle) };
        }
        codes
    }

    /// Interleaves the bits of the primitive's size with those of the axes, so that large primitives part from small ones (Vinkler,
    /// Bittner, Havran,
    /// *Extended Morton Codes for High Performance Bounding Volume Hierarchy Construction*, HPG 2017, section 3). The size
    /// is the diagonal of the triangle's box, in units of the grid's diagonal.
    fn extended(&self, [x, y, z]: [u32; 3], triangle: &Triangle) -> u64 {
        let diagonal = self.grid.cells_across(triangle.bounds().extent().length()) / 3_f32.sqrt();
        let size = diagonal.clamp(0.0, MAX_CELL) as u32;
        let [size, x, y, z] = [size, x, y, z].map(|bits| spread_by_four(bits >> (BITS_PER_AXIS - 16)));
        (size << 3 | x << 2 | y << 1 | z) >> 1
    }
}

/// Transforms the cell coordinates of `N` points, stored by axis, so that their interleaved bits are the cells' indices along the
/// Hilbert curve (Skilling, *Programming the Hilbert curve*, 2004). Each bit of such a code halves a box of cells, as the
/// bits of Morton codes do.
#[inline(always)]
fn hilbert<const N: usize>(cells: &mut [[u32; N]; 3]) {
    // All bits set where `bit` of `cell` is set, otherwise 0.
    let ones = |cell: u32, bit: u32| 0_u32.wrapping_sub(cell >> bit & 1);
    for bit in (1..BITS_PER_AXIS).rev() {
        let below = (1 << bit) - 1;
        for axis in 0..3 {
            for lane in 0..N {
                let set = ones(cells[axis][lane], bit);
                // Inverts the lower bits of the first axis where the bit is set, else exchanges them with this axis's.
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

/// Inserts three zero bits before each of the lowest 16 bits.
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
    use super::*;
    use crate::kernel::SimdLevel;
    use crate::kernel::simd::dispatch_plain;

    const SIDE: f32 = (1 << BITS_PER_AXIS) as f32;

    fn grid(curve: Curve) -> CurveGrid {
        CurveGrid::new(&Aabb { min: Vec3::ZERO, max: Vec3::splat(SIDE) }, curve)
    }

    fn point(at: Vec3) -> Triangle {
        Triangle { a: at, b: at, c: at }
    }

    #[test]
    fn cells_that_follow_each_other_along_the_hilbert_curve_touch() {
        // The 512 cells at the third level, by the first nine bits of their codes.
        let grid = grid(Curve::Hilbert);
        let mut cells: Vec<(u64, [i32; 3])> = (0..512)
            .map(|index| {
                let cell = [index >> 6, index >> 3 & 7, index & 7];
                let centroid = Vec3::from_array(cell.map(|part| (part as f32 + 0.5) * SIDE / 8.0));
                (grid.code(centroid, &point(centroid)) >> 54, cell)
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
                    let centroids = triangles.map(|triangle| triangle.bounds().center());
                    let codes = dispatch_plain!(level.level(), simd => {
                        let lanes = centroids.map(|centroid| f32x4::from_slice(simd, &[centroid.x, centroid.y, centroid.z, 5.0]));
                        grid.codes(simd, &lanes, triangles)
                    });
                    let mut expected = [0; LANES];
                    for lane in 0..LANES {
                        expected[lane] = grid.code(centroids[lane], &triangles[lane]);
                    }
                    assert_eq!(codes, expected, "{} {}", curve.name(), level.name());
                }
            }
        }
    }
}
