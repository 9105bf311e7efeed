//! Leaf blocks: neighbours along the curve are joined into leaves of up to four primitives before they are clustered, so that
//! clustering and the wide tree have fewer items to work on.
//!
//! In each of two rounds, an item is joined with its neighbour where each is the other's nearest of its two neighbours, as in the
//! first step of locally ordered clustering with a radius of one (Meister, Bittner, *Parallel Locally-Ordered Clustering for Bounding
//! Volume Hierarchy Construction*, 2018), and where the surface area heuristic favours one leaf over a node of two, see [`GUARD`].

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "several arrays are indexed by the same field")]

use std::ops::Range;

use bytemuck::Zeroable;
use fearless_simd::{Select, Simd, SimdBase, SimdMask, f32x8, mask32x8};

use crate::aac::cluster_container::ClusterContainer;
use crate::aac::leaf_order::LeafItems;
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::kernel::SimdLevel;
use crate::kernel::lanes::{Fields, LANES};
use crate::kernel::parallel::{par_tasks, zeros};
use crate::kernel::simd::dispatch_plain;
use crate::order::SortedPrimitives;

/// Primitives whose blocks are made at once, none across their ends: their items fit the L1 cache.
const CHUNK: usize = 256;
/// Length of the lists of a chunk: longer by a vector, and by what is read beside it.
const LISTED: usize = CHUNK + 2 * LANES;
/// Chunks in a task.
const CHUNKS: usize = 32;
/// Maximum cost of a leaf of two items by the surface area heuristic, as a multiple of the cost of a node above them. Found by
/// experiment: docs/performance.md, "Leaf blocks".
const GUARD: f32 = 1.25;
/// Rounds of joining, each of which at most doubles a block: to as many primitives as the wide tree tests side by side.
const ROUNDS: usize = 2;
/// Maximum number of primitives in a block.
const MAX_SIZE: usize = 1 << ROUNDS;

/// Sorted primitives, and blocks of them, as the items of a tree.
pub struct Blocks<'a, C: ClusterContainer> {
    pub primitives: &'a SortedPrimitives<C>,
    pub blocks: &'a SortedPrimitives<C>,
}

impl<C: ClusterContainer> LeafItems for Blocks<'_, C> {
    #[inline(always)]
    fn write(&self, index: u32, leaf: &mut [u32]) {
        let Some((_, positions)) = self.blocks.block(index as usize) else { return };
        // Without a branch on their number, which could not be predicted: the last one is written again.
        let last = positions.len() - 1;
        for at in 0..MAX_SIZE {
            leaf[at.min(last)] = self.primitives.primitive(positions.start + at.min(last));
        }
    }
}

/// The blocks of a task.
struct TaskBlocks<C> {
    containers: Vec<C>,
    starts: Vec<u32>,
}

/// Joins the primitives of `input`, which are `triangles`, into blocks, which take their places in the result. The same for any number
/// of threads.
pub fn leaf_blocks<C: ClusterContainer>(
    triangles: &[Triangle],
    input: &SortedPrimitives<C>,
    token: &CancelToken,
) -> Result<SortedPrimitives<C>, Cancelled> {
    let level = SimdLevel::of_builds().level();
    let tasks = par_tasks((0..input.len()).step_by(CHUNK * CHUNKS), token, |first, _| {
        let end = input.len().min(first + CHUNK * CHUNKS);
        let mut blocks =
            TaskBlocks { containers: Vec::with_capacity(end - first), starts: Vec::with_capacity(end - first) };
        dispatch_plain!(level, simd => {
            for start in (first..end).step_by(CHUNK) {
                join_chunk(simd, triangles, input, start..end.min(start + CHUNK), &mut blocks);
            }
        });
        Ok(blocks)
    })?;
    let containers = concatenated(tasks.iter().map(|task| &task.containers[..]), token)?;
    let end = [input.len() as u32];
    let starts = concatenated(tasks.iter().map(|task| &task.starts[..]).chain([&end[..]]), token)?;
    input.in_blocks(starts, containers, token)
}

/// The lists one after the other.
fn concatenated<'a, T: Zeroable + Copy + Send + Sync + 'a>(
    lists: impl Iterator<Item = &'a [T]> + Clone,
    token: &CancelToken,
) -> Result<Vec<T>, Cancelled> {
    let mut all: Vec<T> = zeros(lists.clone().map(<[T]>::len).sum(), token)?;
    let (mut parts, mut remaining) = (Vec::new(), &mut all[..]);
    for list in lists {
        let own;
        (own, remaining) = remaining.split_at_mut(list.len());
        parts.push((list, own));
    }
    par_tasks(parts, token, |(list, own), _| {
        own.copy_from_slice(list);
        Ok(())
    })?;
    Ok(all)
}

/// The items of a chunk, each one or several primitives that follow one another along the curve.
struct Items<C: ClusterContainer> {
    /// Container fields of each item, see [`ClusterContainer::fields`].
    fields: C::Fields<[f32; LISTED]>,
    /// Number of primitives of each item.
    counts: [f32; LISTED],
    len: usize,
}

impl<C: ClusterContainer> Items<C> {
    /// The primitives at the positions `range`, at most [`CHUNK`].
    #[inline(always)]
    fn load<S: Simd>(simd: S, triangles: &[Triangle], input: &SortedPrimitives<C>, range: Range<usize>) -> Self {
        let mut items = Self { fields: C::Fields::splat([0.0; LISTED]), counts: [1.0; LISTED], len: range.len() };
        for (at, position) in range.enumerate() {
            let (fields, _) = input.fields(simd, triangles, position);
            items.set(at % CHUNK, fields);
        }
        items
    }

    #[inline(always)]
    fn get(&self, at: usize) -> C {
        let mut fields = C::Fields::splat(0.0);
        for field in 0..C::USED_FIELDS {
            fields[field] = self.fields[field][at];
        }
        C::from_fields(fields)
    }

    #[inline(always)]
    fn set(&mut self, at: usize, fields: C::Fields<f32>) {
        for field in 0..C::USED_FIELDS {
            self.fields[field][at] = fields[field];
        }
    }

    /// The containers from `at` on, one per lane.
    #[inline(always)]
    fn row<S: Simd>(&self, simd: S, at: usize) -> C::Fields<f32x8<S>> {
        let mut row = C::Fields::splat(f32x8::splat(simd, 0.0));
        for field in 0..C::USED_FIELDS {
            row[field] = f32x8::from_slice(simd, &self.fields[field][at..at + LANES]);
        }
        row
    }

    /// Merge distance of each pair of neighbours, that of the items `at` and `at + 1` at `at + 2`; infinite where a leaf of both costs too
    /// much, and around the list.
    #[inline(always)]
    fn distances<S: Simd>(&self, simd: S) -> [f32; LISTED] {
        // The compiler sees that no list is left.
        let groups = self.len.min(CHUNK).div_ceil(LANES);
        let mut costs = [0.0; LISTED];
        for group in 0..groups {
            let at = LANES * group;
            let row = self.row(simd, at);
            let area = C::area_of_distance(C::merge_distances(simd, &row, &row));
            (area * f32x8::from_slice(simd, &self.counts[at..at + LANES])).store_slice(&mut costs[at..at + LANES]);
        }
        let mut distances = [f32::INFINITY; LISTED];
        let (guard, node) = (f32x8::splat(simd, GUARD), f32x8::splat(simd, C::KIND.traversal_cost()));
        let infinity = f32x8::splat(simd, f32::INFINITY);
        for group in 0..groups {
            let at = LANES * group;
            let count = f32x8::from_slice(simd, &self.counts[at..at + LANES])
                + f32x8::from_slice(simd, &self.counts[at + 1..at + 1 + LANES]);
            let cost = f32x8::from_slice(simd, &costs[at..at + LANES])
                + f32x8::from_slice(simd, &costs[at + 1..at + 1 + LANES]);
            let distance = C::merge_distances(simd, &self.row(simd, at), &self.row(simd, at + 1));
            let area = C::area_of_distance(distance);
            let joins = (area * count).simd_le(guard * (area * node + cost));
            joins.select(distance, infinity).store_slice(&mut distances[at + 2..at + 2 + LANES]);
        }
        // Beyond the last item there is none.
        distances[self.len.min(CHUNK) + 1..][..LANES].fill(f32::INFINITY);
        distances
    }

    /// Joins each pair of neighbours that are nearest to each other where [`Items::distances`] allows it; of two equal distances the
    /// first counts. Eight items at a time, in place: none is written before it and its neighbour were read.
    #[inline(always)]
    fn join<S: Simd>(&mut self, simd: S) {
        let distances = self.distances(simd);
        let groups = self.len.min(CHUNK).div_ceil(LANES);
        let mut to = 0;
        for group in 0..groups {
            let at = LANES * group;
            let joins = are_nearest(simd, &distances, at + 1);
            // The second of a pair is not the first of another, whose distance would have to be less.
            let stays = !are_nearest(simd, &distances, at);
            let (own, next) = (self.row(simd, at), self.row(simd, at + 1));
            let unions = C::unions(simd, &own, &next);
            let end = to % (CHUNK + 1);
            for field in 0..C::USED_FIELDS {
                let joined = joins.select(unions[field], own[field]).compress(stays);
                joined.store_slice(&mut self.fields[field][end..end + LANES]);
            }
            let own = f32x8::from_slice(simd, &self.counts[at..at + LANES]);
            let next = f32x8::from_slice(simd, &self.counts[at + 1..at + 1 + LANES]);
            let joined = joins.select(own + next, own).compress(stays);
            joined.store_slice(&mut self.counts[end..end + LANES]);
            to += stays.to_bitmask().count_ones() as usize;
        }
        // Those beyond the last item have stayed.
        self.len = to - (LANES * groups - self.len);
    }
}

/// For each item from `at - 1` on, one per lane, whether it and the next one are nearest to each other, by [`Items::distances`].
#[inline(always)]
fn are_nearest<S: Simd>(simd: S, distances: &[f32; LISTED], at: usize) -> mask32x8<S> {
    let before = f32x8::from_slice(simd, &distances[at..at + LANES]);
    let own = f32x8::from_slice(simd, &distances[at + 1..at + 1 + LANES]);
    let after = f32x8::from_slice(simd, &distances[at + 2..at + 2 + LANES]);
    own.simd_lt(before) & own.simd_le(after)
}

/// Appends the blocks of the primitives at the positions `range`, at most [`CHUNK`], to `blocks`.
#[inline(always)]
fn join_chunk<C: ClusterContainer, S: Simd>(
    simd: S,
    triangles: &[Triangle],
    input: &SortedPrimitives<C>,
    range: Range<usize>,
    blocks: &mut TaskBlocks<C>,
) {
    // The next chunk's, while this one's are joined.
    for position in range.end..input.len().min(range.end + CHUNK) {
        input.prefetch(triangles, position);
    }
    let mut start = range.start as u32;
    let mut items = Items::load(simd, triangles, input, range);
    for _ in 0..ROUNDS {
        items.join(simd);
    }
    let len = items.len.min(CHUNK);
    blocks.containers.extend((0..len).map(|at| items.get(at)));
    blocks.starts.extend(items.counts[..len].iter().map(|count| {
        let first = start;
        start += *count as u32;
        first
    }));
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::geometry::Aabb;
    use crate::order::{input_bounds, sort_primitives};
    use crate::settings::Curve;
    use crate::stage_times::StageTimes;

    /// Triangles with small whole coordinates, whose areas and costs are exact, many of them equal.
    fn triangles(count: u32) -> Vec<Triangle> {
        let mut state = 7_u32;
        let mut number = |below: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((state >> 16) % below) as f32
        };
        let mut triangle = |_| {
            let a = Vec3::new(number(64), number(48), number(8));
            Triangle { a, b: a + Vec3::new(number(5), number(3), 1.0), c: a + Vec3::new(1.0, number(4), number(2)) }
        };
        (0..count).map(&mut triangle).collect()
    }

    /// Containers and sizes after one round over the items of a chunk, by definition.
    fn joined(items: &[(Aabb, u32)]) -> Vec<(Aabb, u32)> {
        let cost = |(container, count): &(Aabb, u32)| container.half_area() * *count as f32;
        let union = |at: usize| (items[at].0.union(&items[at + 1].0), items[at].1 + items[at + 1].1);
        let distance = |at: usize| {
            let both = (at + 1 < items.len()).then(|| union(at))?;
            let node = both.0.half_area() + cost(&items[at]) + cost(&items[at + 1]);
            (cost(&both) <= 1.25 * node).then(|| both.0.half_area())
        };
        let (mut list, mut at) = (Vec::new(), 0);
        while at < items.len() {
            let before = at.checked_sub(1).and_then(distance);
            let is_nearest = distance(at).is_some_and(|own| {
                before.is_none_or(|before| own < before) && distance(at + 1).is_none_or(|after| own <= after)
            });
            list.push(if is_nearest { union(at) } else { items[at] });
            at += if is_nearest { 2 } else { 1 };
        }
        list
    }

    #[test]
    fn neighbours_that_are_nearest_to_each_other_are_joined_where_a_leaf_is_cheap() {
        let (token, mut sizes) = (CancelToken::new(), [0; 5]);
        for count in [1, 2, 3, 4, 5, 255, 256, 257, 258, 1000, 20_000] {
            let triangles = triangles(count);
            let Ok(bounds) = input_bounds(&triangles, &token) else { panic!("not cancelled") };
            let input = sort_primitives::<Aabb>(&triangles, &bounds, Curve::Morton, &token, &mut StageTimes::default());
            let Ok(input) = input else { panic!("not cancelled") };
            let Ok(blocks) = leaf_blocks(&triangles, &input, &token) else { panic!("not cancelled") };
            let single = |position| (input.container(&triangles, input.primitive(position)), 1);
            let singles: Vec<(Aabb, u32)> = (0..input.len()).map(single).collect();
            let expected: Vec<(Aabb, u32)> = singles.chunks(CHUNK).flat_map(|chunk| joined(&joined(chunk))).collect();
            let ranges: Vec<(Aabb, Range<usize>)> =
                (0..blocks.len()).filter_map(|at| blocks.block(at)).map(|(block, range)| (*block, range)).collect();
            let found: Vec<(Aabb, u32)> = ranges.iter().map(|(block, range)| (*block, range.len() as u32)).collect();
            assert!(found == expected, "{count} triangles");
            for (_, size) in &found {
                sizes[*size as usize] += 1;
            }
            // A block has the place on the curve of its first primitive.
            let firsts = ranges.iter().map(|(_, range)| input.primitive(range.start));
            assert!(firsts.eq((0..found.len()).map(|at| blocks.primitive(at))), "{count} triangles");
        }
        assert!(sizes[1..].iter().all(|&blocks| blocks > 100), "blocks of every size: {sizes:?}");
    }
}
