//! Trees from the top down over boxes, by the surface area heuristic.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Level, Simd, dispatch};

use super::below::{joined_cost, leaf_cost};
use super::item::{Item, NEW};
use super::small::{SMALL, small_tree};
use super::split::{MAX_SPLIT_DEPTH, split};
use super::split_large::{LARGE, split_large};
use crate::bvh::lists::zeros;
use crate::cancel::{CancelToken, Cancelled};

/// Up to this many items are built by one thread: twice their bytes fit the second cache.
const FORK_ABOVE: usize = 8192;

/// A tree over items.
#[derive(Debug, Default)]
pub struct TopDown {
    /// The children of each new node: of the root first, then depth first.
    pub pairs: Vec<[Item; 2]>,
    /// SAH cost of the children of each new node together.
    below: Vec<f32>,
    /// The items once more: each split moves them to the other list.
    other: Vec<Item>,
}

/// What stays the same for the whole tree.
#[derive(Clone, Copy)]
pub struct Builder<'a> {
    pub level: Level,
    /// Whether leaves may be made of several items.
    pub collapses: bool,
    pub token: &'a CancelToken,
}

/// Items that still have to be divided.
struct Range<'a> {
    /// Where they are, and as much room.
    items: &'a mut [Item],
    other: &'a mut [Item],
    /// Their box.
    whole: Item,
    pairs: &'a mut [[Item; 2]],
    below: &'a mut [f32],
    /// Number of the first of these pairs.
    offset: u32,
    depth: u32,
}

impl Builder<'_> {
    /// Builds the tree over `items`, at least two, whose box `whole` is and which are reordered, into `tree`. Returns the cost below its root.
    pub fn build(&self, items: &mut [Item], whole: Item, tree: &mut TopDown) -> Result<f32, Cancelled> {
        let TopDown { pairs, below, other } = tree;
        *pairs = zeros(items.len() - 1, self.token)?;
        *below = zeros(items.len() - 1, self.token)?;
        *other = zeros(items.len(), self.token)?;
        self.range(Range { items, other, whole, pairs, below, offset: 0, depth: 0 })?;
        Ok(below[0])
    }

    /// Both sides of a large range in parallel.
    fn range(&self, range: Range) -> Result<(), Cancelled> {
        self.token.check()?;
        let Range { items, other, whole, pairs, below, offset, depth } = range;
        let count = items.len();
        if count <= FORK_ABOVE {
            dispatch!(self.level, simd => self.task(simd, Range { items, other, whole, pairs, below, offset, depth }));
            return Ok(());
        }
        let (middle, mut pair) = if count >= LARGE && depth < MAX_SPLIT_DEPTH {
            split_large(self.level, items, other, &whole, depth, self.token)?
        } else {
            dispatch!(self.level, simd => split(simd, items, other, &whole, depth))
        };
        let (items, items_right) = items.split_at_mut(middle);
        let (other, other_right) = other.split_at_mut(middle);
        let ([own_pair, pairs @ ..], [own_below, below @ ..]) = (pairs, below) else { return Ok(()) };
        let (pairs, pairs_right) = pairs.split_at_mut(middle - 1);
        let (below, below_right) = below.split_at_mut(middle - 1);
        let (left_offset, right_offset) = (offset + 1, offset + middle as u32);
        for (side, count, first, number) in
            [(0, middle, other[0], left_offset), (1, count - middle, other_right[0], right_offset)]
        {
            if count > 1 { pair[side].link = NEW | number } else { pair[side] = first }
        }
        let depth = depth + 1;
        let side = |range: Range| if range.items.len() > 1 { self.range(range) } else { Ok(()) };
        let (left, right) = rayon::join(
            || {
                side(Range {
                    items: other,
                    other: items,
                    whole: pair[0],
                    pairs: &mut *pairs,
                    below: &mut *below,
                    offset: left_offset,
                    depth,
                })
            },
            || {
                let (pairs, below) = (&mut *pairs_right, &mut *below_right);
                side(Range {
                    items: other_right,
                    other: items_right,
                    whole: pair[1],
                    pairs,
                    below,
                    offset: right_offset,
                    depth,
                })
            },
        );
        left.and(right)?;
        let first = |below: &[f32]| below.first().copied().unwrap_or_default();
        *own_pair = pair;
        *own_below = self.cost(&pair[0], first(below)) + self.cost(&pair[1], first(below_right));
        Ok(())
    }

    /// Everything by one thread.
    #[inline(always)]
    fn task<S: Simd>(&self, simd: S, range: Range) {
        let Range { items, other, whole, pairs, below, offset, depth } = range;
        // Start, end, their box, number of the first pair within the task, depth, whether it lies in the second list.
        let mut open = vec![(0, items.len(), whole, 0, depth, false)];
        while let Some((start, end, whole, slot, depth, is_in_other)) = open.pop() {
            let (from, to) = (&mut items[start..end], &mut other[start..end]);
            let (from, to) = if is_in_other { (to, from) } else { (from, to) };
            if from.len() <= SMALL {
                small_tree(simd, from, &mut pairs[slot..], offset + slot as u32);
                continue;
            }
            let (middle, mut pair) = split(simd, from, to, &whole, depth);
            let sides = [(start, middle, slot + 1), (start + middle, end - start - middle, slot + middle)];
            // The left one is done next.
            for side in [1, 0] {
                let (start, count, slot) = sides[side];
                if count > 1 {
                    pair[side].link = NEW | (offset + slot as u32);
                    open.push((start, start + count, pair[side], slot, depth + 1, !is_in_other));
                } else {
                    pair[side] = if is_in_other { items[start] } else { other[start] };
                }
            }
            pairs[slot] = pair;
        }
        for at in (0..pairs.len()).rev() {
            let pair = &pairs[at];
            let below_of =
                |item: &Item| if item.link & NEW == 0 { 0.0 } else { below[((item.link & !NEW) - offset) as usize] };
            below[at] = self.cost(&pair[0], below_of(&pair[0])) + self.cost(&pair[1], below_of(&pair[1]));
        }
    }

    /// SAH cost of `item`, whose children cost `below` together where it is new.
    #[inline(always)]
    fn cost(&self, item: &Item, below: f32) -> f32 {
        let area = item.half_area();
        if item.link & NEW != 0 {
            joined_cost(area, item.count, below, self.collapses).0
        } else {
            leaf_cost(area, item.count)
        }
    }
}
