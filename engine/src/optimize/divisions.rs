//! The divisions of a treelet's set of subtrees in two (Karras, Aila, *Fast Parallel Construction of High-Quality Bounding Volume
//! Hierarchies*, 2013, section 3).

#![allow(clippy::inline_always, reason = "the innermost loop of the treelets' searches")]

/// The least cost of dividing `set`, one bit for each subtree and at least two, and the part without its lowest bit. `cost` is that
/// of each part; of equal divisions the first wins.
#[inline(always)]
pub fn cheapest_division(set: usize, cost: impl Fn(usize) -> f32) -> (f32, usize) {
    let rest = set & (set - 1);
    let (mut least, mut part) = (f32::INFINITY, rest);
    let mut other = rest;
    while other > 0 {
        let both = cost(other) + cost(set & !other);
        if both < least {
            (least, part) = (both, other);
        }
        other = (other - 1) & rest;
    }
    (least, part)
}
