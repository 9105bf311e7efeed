//! The cheapest of all trees over up to six boxes: every subset's best division, from the small subsets up (Karras, Aila,
//! *Fast Parallel Construction of High-Quality Bounding Volume Hierarchies*, 2013, section 4).

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Simd, SimdBase, f32x8};

use super::item::{Item, NEW, half_area};

/// Most boxes: the time triples with each.
pub const SMALL: usize = 4;
/// Sets of boxes, the empty one included.
const SUBSETS: usize = 1 << SMALL;

/// Writes the pairs of the best tree over `items`, 2 to [`SMALL`], to `slots`; the first one's number is `offset`. What
/// collapses is not considered.
#[inline(always)]
pub fn small_tree<S: Simd>(simd: S, items: &[Item], slots: &mut [[Item; 2]], offset: u32) {
    if let &[first, second] = items {
        slots[0] = [first, second];
        return;
    }
    let all = (1_usize << items.len()) - 1;
    let mut bounds = [f32x8::splat(simd, 0.0); SUBSETS];
    let (mut costs, mut counts, mut halves) = ([0.0_f32; SUBSETS], [0_u32; SUBSETS], [0_usize; SUBSETS]);
    for set in 1..=all {
        let lowest = 1 << set.trailing_zeros();
        let others = set - lowest;
        let item = &items[set.trailing_zeros() as usize];
        if others == 0 {
            // What is below an item counts the same in every tree.
            (bounds[set], counts[set]) = (item.bounds(simd), item.count);
            continue;
        }
        bounds[set] = bounds[others].min(item.bounds(simd));
        counts[set] = counts[others] + item.count;
        // Every half that has the lowest item.
        let mut cheapest = f32::INFINITY;
        let mut more = others;
        while more > 0 {
            more = (more - 1) & others;
            let cost = costs[lowest + more] + costs[others - more];
            if cost < cheapest {
                (cheapest, halves[set]) = (cost, lowest + more);
            }
        }
        costs[set] = cheapest + half_area(bounds[set]);
    }
    let mut open = [(all, 0); SMALL];
    let (mut len, mut free) = (1, 1);
    while len > 0 {
        len -= 1;
        let (set, slot) = open[len];
        let mut pair = [items[0]; 2];
        for (side, half) in pair.iter_mut().zip([halves[set], set - halves[set]]) {
            if half.is_power_of_two() {
                *side = items[half.trailing_zeros() as usize];
            } else {
                *side = Item::of(bounds[half], counts[half], NEW | (offset + free as u32));
                open[len] = (half, free);
                len += 1;
                free += 1;
            }
        }
        slots[slot] = pair;
    }
}
