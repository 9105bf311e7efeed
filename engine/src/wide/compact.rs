//! Eight boxes in a third of the memory: the planes in eight bits each, as multiples of a power of two from the lowest corner, rounded
//! outwards (after Ylitie, Karras, Laine, *Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs*, 2017,
//! section 3). Rays may enter such a box where they would miss the exact one, and never the other way round: hits stay the same,
//! since a hit is decided by the triangle.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use bytemuck::{Pod, Zeroable};
use fearless_simd::{Bytes, Select, Simd, SimdBase, SimdCvtFloat, f32x8, i32x8, u32x4, u32x8};

use crate::geometry::Aabb;
use crate::kernel::each;
use crate::wide::bounds::{CompactBounds, WideContainer};
use crate::wide::box_lanes::BoxLanes;
use crate::wide::layout::WIDTH;

/// Largest multiple.
const MOST: i32 = 255;
/// Bits of a multiple.
const BITS: u8 = 8;
/// Largest exponent, of a scale of 2¹²⁷.
pub(crate) const LARGEST_EXPONENT: u8 = 254;
/// Bits of a float's fraction.
const FRACTION_BITS: u8 = 23;

/// Eight boxes with planes of eight bits.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct CompactBoxes {
    /// The lowest corner of all boxes.
    origin: [f32; 3],
    /// For each axis the exponent of the scale, biased as in a float.
    exponents: [u8; 3],
    /// Number of boxes.
    count: u8,
    /// For each lane, from the lowest byte: lower and upper plane on the first and on the second axis.
    planes: [u32; WIDTH],
    /// Lower and upper plane on the third axis: of each of the first four lanes in the lower half, of the others in the upper half.
    last_planes: [u32; WIDTH / 2],
}

/// The multiples on one axis: of the lower planes, and of the upper ones.
type Multiples = [[u8; WIDTH]; 2];

impl CompactBoxes {
    /// The scale of an axis.
    #[inline(always)]
    fn scale(&self, axis: usize) -> f32 {
        scale(self.exponents[axis])
    }

    /// The multiples on each axis.
    fn multiples(&self) -> [Multiples; 3] {
        let [x, y] = [0, 16].map(|shift| [0, 8].map(|side| self.planes.map(|word| (word >> (shift + side)) as u8)));
        let z = [0, 8]
            .map(|side| std::array::from_fn(|lane| (self.last_planes[lane % 4] >> (lane / 4 * 16) >> side) as u8));
        [x, y, z]
    }
}

/// The scale with a biased exponent.
pub(crate) fn scale(exponent: u8) -> f32 {
    f32::from_bits(u32::from(exponent) << FRACTION_BITS)
}

/// The biased exponent of a number: that of the largest power of two which is not larger.
fn exponent_of(value: f32) -> u8 {
    (value.abs().to_bits() >> FRACTION_BITS) as u8
}

/// Multiples of the scale with the given exponent that enclose the planes of a box on an axis, and whether 0 to `most` suffice.
#[inline(always)]
pub(crate) fn enclose_one([low, high]: [f32; 2], origin: f32, exponent: u8, most: i32) -> ([i32; 2], bool) {
    let scale = scale(exponent);
    let plane = |multiple: i32| origin + multiple as f32 * scale;
    let down = ((low - origin) / scale) as i32;
    let down = down.saturating_sub(i32::from(plane(down) > low));
    let up = ((high - origin) / scale) as i32;
    let up = up.saturating_add(i32::from(plane(up) < high));
    let fits = (0..=most).contains(&down) && up <= most && plane(down) <= low && plane(up) >= high;
    // At last from the lowest number to beyond the largest.
    let multiples = if fits || exponent < LARGEST_EXPONENT { [down, up] } else { [0, most] };
    (multiples, fits || exponent == LARGEST_EXPONENT)
}

/// [`enclose_one`] of the first `count` boxes; `None` where eight bits do not suffice.
fn enclose(planes: &[[f32; WIDTH]; 2], count: usize, origin: f32, exponent: u8) -> Option<Multiples> {
    let mut found: Multiples = [[0; WIDTH]; 2];
    let mut fits = true;
    for lane in 0..count.min(WIDTH) {
        let ([down, up], lane_fits) = enclose_one([planes[0][lane], planes[1][lane]], origin, exponent, MOST);
        fits &= lane_fits;
        (found[0][lane], found[1][lane]) = (down as u8, up as u8);
    }
    fits.then_some(found)
}

/// The smallest exponent with which multiples of so many `bits` may reach from `origin` to `highest`.
pub(crate) fn first_exponent(origin: f32, highest: f32, bits: u8) -> u8 {
    // Finer steps than those of floats would be lost in the sum.
    let finest = exponent_of(origin.abs().max(highest.abs())).saturating_sub(FRACTION_BITS);
    let coarsest_needed = exponent_of(highest - origin).saturating_sub(bits - 1);
    finest.max(coarsest_needed).clamp(1, LARGEST_EXPONENT)
}

/// [`enclose`] with the smallest scale that suffices, and its exponent.
fn enclose_closely(planes: &[[f32; WIDTH]; 2], count: usize, origin: f32) -> (u8, Multiples) {
    let highest = planes[1][..count].iter().copied().fold(origin, f32::max);
    (first_exponent(origin, highest, BITS)..=LARGEST_EXPONENT)
        .find_map(|exponent| Some((exponent, enclose(planes, count, origin, exponent)?)))
        .unwrap_or_else(|| unreachable!("the largest scale always suffices"))
}

impl CompactBounds<Aabb> for CompactBoxes {
    fn pack(lanes: &BoxLanes, count: usize) -> Self {
        let lowest = |axis: usize| lanes.0[axis][0][..count].iter().copied().fold(f32::INFINITY, f32::min);
        let origin = each!(axis => lowest(axis));
        let [(ex, x), (ey, y), (ez, z)] = each!(axis => enclose_closely(&lanes.0[axis], count, origin[axis]));
        let [x, y, z] = [x, y, z].map(|[low, high]| -> [u32; WIDTH] {
            std::array::from_fn(|lane| u32::from(low[lane]) | u32::from(high[lane]) << 8)
        });
        Self {
            origin,
            exponents: [ex, ey, ez],
            count: count as u8,
            planes: std::array::from_fn(|lane| x[lane] | y[lane] << 16),
            last_planes: std::array::from_fn(|lane| z[lane] | z[lane + 4] << 16),
        }
    }

    #[inline(always)]
    fn unpack<S: Simd>(&self, simd: S) -> BoxLanes {
        let mut lanes = Aabb::EMPTY_BOUNDS;
        let byte = |word: u32x8<S>, shift: u32| -> i32x8<S> { ((word >> shift) & 255).bitcast() };
        let words = u32x8::load_array_ref(simd, &self.planes);
        let last = u32x4::load_array_ref(simd, &self.last_planes);
        let last = simd.combine_u32x4(last & 0xffff, last >> 16);
        let multiples =
            [[byte(words, 0), byte(words, 8)], [byte(words, 16), byte(words, 24)], [byte(last, 0), byte(last, 8)]];
        let numbers = u32x8::from_slice(simd, &[0, 1, 2, 3, 4, 5, 6, 7]);
        let is_used = numbers.simd_lt(u32x8::splat(simd, self.count.into()));
        let unused = [f32x8::splat(simd, f32::INFINITY), f32x8::splat(simd, f32::NEG_INFINITY)];
        for (axis, multiples) in multiples.into_iter().enumerate() {
            let (origin, scale) = (f32x8::splat(simd, self.origin[axis]), f32x8::splat(simd, self.scale(axis)));
            for (side, multiples) in multiples.into_iter().enumerate() {
                // The product is exact, so that every level rounds alike.
                let plane = origin + f32x8::float_from(multiples) * scale;
                // One axis suffices to keep every ray out of an unused lane.
                let plane = if axis == 0 { is_used.select(plane, unused[side]) } else { plane };
                lanes.0[axis][side] = plane.to_array();
            }
        }
        lanes
    }

    fn load(&self, lane: usize) -> Aabb {
        let multiples = self.multiples();
        let plane =
            |axis: usize, side: usize| self.origin[axis] + f32::from(multiples[axis][side][lane]) * self.scale(axis);
        Aabb { min: each!(axis => plane(axis, 0)).into(), max: each!(axis => plane(axis, 1)).into() }
    }

    fn holds(&self, lane: usize, container: &Aabb) -> bool {
        let mut lanes = Aabb::EMPTY_BOUNDS;
        container.store(&mut lanes, 0);
        let multiples = self.multiples();
        (0..3).all(|axis| {
            enclose(&lanes.0[axis], 1, self.origin[axis], self.exponents[axis])
                .is_some_and(|found| [0, 1].map(|side| multiples[axis][side][lane]) == [found[0][0], found[1][0]])
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::kernel::SimdLevel;
    use crate::kernel::mix::next_unit;
    use crate::kernel::simd::dispatch;

    fn packed(boxes: &[Aabb]) -> CompactBoxes {
        let mut lanes = Aabb::EMPTY_BOUNDS;
        for (lane, container) in boxes.iter().enumerate() {
            container.store(&mut lanes, lane);
        }
        CompactBoxes::pack(&lanes, boxes.len())
    }

    fn unpacked(compact: &CompactBoxes, level: SimdLevel) -> BoxLanes {
        dispatch!(level.level(), simd => compact.unpack(simd))
    }

    /// Boxes of very different sizes and places, flat ones, and the largest that there are.
    fn boxes() -> Vec<Vec<Aabb>> {
        let mut state = 1;
        let mut random = || next_unit(&mut state) as f32;
        let mut sets = Vec::new();
        for place in [0.0, 1.0, -1e4, 3e7, 1e30, 3.4e38] {
            for size in [0.0, 1e-42, 1e-20, 1e-3, 1.0, 1e9, 3.4e38] {
                for count in [1, 2, 5, 8] {
                    let mut corner =
                        |from: Vec3| (from + Vec3::new(random(), random(), random()) * size).min(Vec3::MAX);
                    let mut one = || {
                        let a = corner(Vec3::splat(place).with_y(-place));
                        let b = corner(Vec3::splat(place).with_y(-place));
                        Aabb { min: a.min(b), max: a.max(b) }
                    };
                    sets.push((0..count).map(|_| one()).collect());
                }
            }
        }
        sets.push(vec![Aabb { min: Vec3::MIN, max: Vec3::MAX }, Aabb { min: Vec3::ZERO, max: Vec3::ONE }]);
        sets
    }

    #[test]
    fn compact_boxes_enclose_the_exact_ones_and_hardly_more() {
        for boxes in boxes() {
            let compact = packed(&boxes);
            let around = boxes.iter().fold(Aabb::EMPTY, |all, one| all.union(one));
            for (lane, exact) in boxes.iter().enumerate() {
                let found = compact.load(lane);
                assert!(found.min.cmple(exact.min).all() && found.max.cmpge(exact.max).all(), "{exact:?} in {found:?}");
                let size = (around.max - around.min).min(Vec3::MAX).max(around.max.abs().max(around.min.abs()) * 1e-5);
                let slack = size / 100.0 + f32::MIN_POSITIVE * 4.0;
                assert!(
                    size.max_element() > 1e38
                        || (exact.min - found.min).cmple(slack).all() && (found.max - exact.max).cmple(slack).all(),
                    "{exact:?} in {found:?} of {around:?}"
                );
                assert!(compact.holds(lane, exact));
                let other = Aabb { min: exact.min - size / 3.0, max: exact.max };
                assert!(size.max_element() > 1e38 || size.max_element() < 1e-30 || !compact.holds(lane, &other));
            }
        }
    }

    #[test]
    fn every_simd_level_unpacks_the_same_planes() {
        for boxes in boxes() {
            let compact = packed(&boxes);
            for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
                let lanes = unpacked(&compact, level);
                for lane in 0..boxes.len() {
                    assert_eq!(Aabb::load(&lanes, lane), compact.load(lane), "{level:?}");
                }
                for lane in boxes.len()..WIDTH {
                    assert_eq!([lanes.0[0][0][lane], lanes.0[0][1][lane]], [f32::INFINITY, f32::NEG_INFINITY]);
                }
            }
        }
    }
}
