//! Boxes with planes of few bits, in the grid of their parent.

use glam::Vec3;

use crate::geometry::Aabb;
use crate::kernel::each;
use crate::wide::compact::{LARGEST_EXPONENT, enclose_one, first_exponent, scale};

/// Replaces each of `boxes`, the children of one node, by the box that its planes of so many `bits` stand for: the smallest around it
/// whose planes are multiples of a step, a power of two on each axis, counted from the lowest corner of all. The step is the smallest
/// with which all multiples have so many bits.
pub(super) fn quantise(boxes: &mut [Aabb], bits: u32) {
    let origin = boxes.iter().fold(Vec3::INFINITY, |lowest, one| lowest.min(one.min));
    let most = (1 << bits) - 1;
    let planes: [Vec<[f32; 2]>; 3] = each!(axis => {
        let exact: Vec<[f32; 2]> = boxes.iter().map(|one| [one.min[axis], one.max[axis]]).collect();
        enclose_closely(&exact, origin[axis], bits, most)
    });
    for (at, one) in boxes.iter_mut().enumerate() {
        *one = Aabb { min: each!(axis => planes[axis][at][0]).into(), max: each!(axis => planes[axis][at][1]).into() };
    }
}

/// Planes, lower and upper, that enclose those of `exact` with the smallest step that suffices.
fn enclose_closely(exact: &[[f32; 2]], origin: f32, bits: u32, most: i32) -> Vec<[f32; 2]> {
    let highest = exact.iter().fold(origin, |highest, planes| highest.max(planes[1]));
    (first_exponent(origin, highest, bits as u8)..=LARGEST_EXPONENT)
        .find_map(|exponent| {
            let step = scale(exponent);
            let enclosed = |planes: &[f32; 2]| {
                let (multiples, fits) = enclose_one(*planes, origin, exponent, most);
                fits.then(|| multiples.map(|multiple| origin + multiple as f32 * step))
            };
            exact.iter().map(enclosed).collect()
        })
        .unwrap_or_else(|| unreachable!("the largest step always suffices"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::mix::next_unit;
    use crate::wide::layout::WIDTH;
    use crate::wide::{CompactBounds as _, WideContainer};

    /// Boxes at awkward places: far from the origin, flat, of subnormal numbers and of the largest.
    fn siblings() -> Vec<Vec<Aabb>> {
        let mut state = 3;
        let mut random = || next_unit(&mut state) as f32;
        let mut sets = Vec::new();
        for place in [0.0, -0.0, 1.0, -1e4, 3e7, -1e30, 3.4e38] {
            for size in [0.0, 1e-42, 1e-20, 1e-3, 1.0, 1e9, 3.4e38] {
                for count in [1, 2, 5, 8, 16] {
                    let mut corner = || {
                        let from = Vec3::splat(place).with_y(-place);
                        (from + Vec3::new(random(), random(), random()) * size).clamp(Vec3::MIN, Vec3::MAX)
                    };
                    let mut one = || {
                        let [a, b] = [corner(), corner()];
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
    fn quantised_boxes_enclose_the_exact_ones() {
        for exact in siblings() {
            for bits in [8, 16] {
                let mut found = exact.clone();
                quantise(&mut found, bits);
                let around = exact.iter().fold(Aabb::EMPTY, |all, one| all.union(one));
                let size = (around.max - around.min).max(around.max.abs().max(around.min.abs()) * 1e-5);
                // A power of two is at most twice what is needed, and a plane is rounded by at most one step.
                let slack = size * (2.1 / (1 << bits) as f32)
                    + size * 2e-2 * f32::from(bits == 16) * 1e-2
                    + f32::MIN_POSITIVE * 4.0;
                for (exact, found) in exact.iter().zip(&found) {
                    assert!(
                        found.min.cmple(exact.min).all() && found.max.cmpge(exact.max).all(),
                        "{exact:?} in {found:?}"
                    );
                    assert!(
                        size.max_element() > 1e37
                            || (exact.min - found.min).cmple(slack).all() && (found.max - exact.max).cmple(slack).all(),
                        "{bits} bits: {exact:?} in {found:?} of {around:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn eight_children_of_eight_bits_are_those_of_compact_nodes() {
        for exact in siblings().into_iter().filter(|exact| exact.len() <= WIDTH) {
            let mut lanes = Aabb::EMPTY_BOUNDS;
            for (lane, one) in exact.iter().enumerate() {
                one.store(&mut lanes, lane);
            }
            let compact = <Aabb as WideContainer>::Compact::pack(&lanes, exact.len());
            let mut found = exact.clone();
            quantise(&mut found, 8);
            for (lane, found) in found.iter().enumerate() {
                assert_eq!(*found, compact.load(lane), "lane {lane} of {exact:?}");
            }
        }
    }
}
