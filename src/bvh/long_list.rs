//! `combine_clusters` for lists of any length. Each cluster keeps its best match. After a merge only clusters whose match
//! was one of the two search again, and only when their old match would still beat the best pair that is known: merging
//! never brings anything closer, nor as close with fewer primitives, so that the old match is a lower bound in both until
//! then. That keeps ties cheap: of a list of equal clusters all have the same match, and only one or two search again after
//! each merge. Only among matches that are equal in both may one have moved below the one that was found.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Select, Simd, SimdBase, SimdMask, f32x8, u32x8};

use super::cluster::{Cluster, Clustered, Clusters, LANES, Pairs, broadcast};
use crate::cancel::{CancelToken, Cancelled};

/// Marks a cluster whose best match has to be searched again; its distance and its count are lower bounds.
const STALE: u32 = u32::MAX;
/// Merges between two looks at the token.
const MERGES_BETWEEN_CHECKS: usize = 64;

/// What is known of the clusters of a list, one after the other; whole rows, of which those behind the end have no distance.
#[derive(Debug, Default)]
pub struct Matches {
    /// Distance to the best match, or a lower bound where that is [`STALE`].
    distances: Vec<f32>,
    /// Position of the best match in the list, or [`STALE`].
    positions: Vec<u32>,
    /// Number of primitives of the cluster itself.
    own_counts: Vec<u32>,
    /// That of its best match, or a lower bound for those at this distance.
    match_counts: Vec<u32>,
    /// Distances from one cluster to all, while its best match is searched.
    row: Vec<f32>,
}

/// Merges the closest pair of the clusters from `base` on until no more than `target` are left.
#[inline(always)]
pub fn combine_long<C: Clustered, S: Simd>(
    simd: S,
    list: &mut Clusters,
    matches: &mut Matches,
    base: usize,
    target: usize,
    pairs: &mut Pairs<C>,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    let room = (list.len - base).next_multiple_of(LANES);
    matches.distances.clear();
    matches.distances.resize(room, f32::INFINITY);
    matches.positions.clear();
    matches.positions.resize(room, STALE);
    matches.own_counts.clear();
    matches.own_counts.extend(list.items[base..list.len].iter().map(|cluster| cluster.count));
    matches.own_counts.resize(room, 0);
    matches.match_counts.clear();
    matches.match_counts.resize(room, 0);
    matches.row.resize(room, 0.0);
    let mut search = Search { list, matches, base };
    for at in 0..search.len() {
        if at % MERGES_BETWEEN_CHECKS == 0 {
            token.check()?;
        }
        search.find_best_match::<C, S>(simd, at);
    }
    while search.len() > target {
        if search.len().is_multiple_of(MERGES_BETWEEN_CHECKS) {
            token.check()?;
        }
        let (low, high) = search.closest_pair::<C, S>(simd, token)?;
        search.merge::<C, S>(simd, low, high, pairs);
    }
    Ok(())
}

/// A list at work; positions count from `base`.
struct Search<'a> {
    list: &'a mut Clusters,
    matches: &'a mut Matches,
    base: usize,
}

impl Search<'_> {
    #[inline(always)]
    fn len(&self) -> usize {
        self.list.len - self.base
    }

    #[inline(always)]
    fn item(&self, at: usize) -> &Cluster {
        &self.list.items[self.base + at]
    }

    /// Number of primitives of the cluster at `at` and its best match, or a lower bound.
    #[inline(always)]
    fn pair_count(&self, at: usize) -> u32 {
        self.matches.own_counts[at] + self.matches.match_counts[at]
    }

    /// Searches the best match of the cluster at `at`: the smallest distance, then the fewest primitives, then the lowest
    /// position.
    #[inline(always)]
    fn find_best_match<C: Clustered, S: Simd>(&mut self, simd: S, at: usize) {
        let own = broadcast::<C, S>(simd, self.item(at));
        let len = self.len();
        let infinity = f32x8::splat(simd, f32::INFINITY);
        let (itself, end) = (u32x8::splat(simd, at as u32), u32x8::splat(simd, len as u32));
        let rows = &mut self.matches.row.as_chunks_mut::<LANES>().0[..len.div_ceil(LANES)];
        let mut smallest = infinity;
        let mut lanes = u32x8::from_slice(simd, &[0, 1, 2, 3, 4, 5, 6, 7]);
        for (chunk, row) in rows.iter_mut().enumerate() {
            let distances = C::distances(&own, &self.list.row::<C, S>(simd, self.base + chunk * LANES));
            // Neither itself nor what stands behind the end.
            let distances = (lanes.simd_eq(itself) | lanes.simd_ge(end)).select(infinity, distances);
            distances.store_slice(row);
            smallest = smallest.min(distances);
            lanes += u32x8::splat(simd, LANES as u32);
        }
        let smallest = smallest.reduce_min();
        let mut best = (u32::MAX, STALE);
        for (chunk, row) in rows.iter().enumerate() {
            let equal = f32x8::from_slice(simd, row).simd_eq(f32x8::splat(simd, smallest));
            let mut lanes = equal.to_bitmask() as u32;
            if lanes == 0 {
                continue;
            }
            lanes &= lanes_below(len - chunk * LANES);
            if at / LANES == chunk {
                lanes &= !(1 << (at % LANES));
            }
            if lanes.count_ones() > 1 {
                let counts = u32x8::from_slice(simd, &self.matches.own_counts[chunk * LANES..(chunk + 1) * LANES]);
                let tied = <u32x8<S> as SimdBase<S>>::Mask::from_bitmask(simd, u64::from(lanes));
                let counts = tied.select(counts, u32x8::splat(simd, u32::MAX));
                lanes &= counts.simd_eq(u32x8::splat(simd, counts.reduce_min())).to_bitmask() as u32;
            }
            if lanes != 0 {
                let position = chunk * LANES + lanes.trailing_zeros() as usize;
                best = best.min((self.matches.own_counts[position], position as u32));
            }
        }
        self.matches.distances[at] = smallest;
        (self.matches.match_counts[at], self.matches.positions[at]) = best;
    }

    /// The pair with the smallest distance, then the fewest primitives, then the lowest positions.
    #[inline(always)]
    fn closest_pair<C: Clustered, S: Simd>(
        &mut self,
        simd: S,
        token: &CancelToken,
    ) -> Result<(usize, usize), Cancelled> {
        loop {
            let rows = self.len().div_ceil(LANES);
            let mut smallest = f32x8::splat(simd, f32::INFINITY);
            for row in &self.matches.distances.as_chunks::<LANES>().0[..rows] {
                smallest = smallest.min(f32x8::from_slice(simd, row));
            }
            let smallest = smallest.reduce_min();
            // The fewest primitives of a pair at that distance, so far; and where one of its two is.
            let mut fewest = u32::MAX;
            let mut closest = 0;
            for chunk in (0..rows).map(|row| row * LANES) {
                let distances = f32x8::from_slice(simd, &self.matches.distances[chunk..chunk + LANES]);
                let equal = distances.simd_eq(f32x8::splat(simd, smallest));
                if !equal.any_true() {
                    continue;
                }
                let counts = u32x8::from_slice(simd, &self.matches.own_counts[chunk..chunk + LANES])
                    + u32x8::from_slice(simd, &self.matches.match_counts[chunk..chunk + LANES]);
                let fewer = equal & counts.simd_lt(u32x8::splat(simd, fewest));
                let mut lanes = fewer.to_bitmask() as u32 & lanes_below(self.len() - chunk);
                while lanes != 0 {
                    let at = chunk + lanes.trailing_zeros() as usize;
                    lanes &= lanes - 1;
                    if self.pair_count(at) >= fewest {
                        continue;
                    }
                    if self.matches.positions[at] == STALE {
                        token.check()?;
                        self.find_best_match::<C, S>(simd, at);
                        if self.matches.distances[at] > smallest || self.pair_count(at) >= fewest {
                            continue;
                        }
                    }
                    (fewest, closest) = (self.pair_count(at), at);
                }
            }
            if fewest < u32::MAX {
                let other = self.matches.positions[closest] as usize;
                return Ok((closest.min(other), closest.max(other)));
            }
        }
    }

    /// Replaces the clusters at `low` and `high` by their union at `low`; the last cluster moves to `high`.
    #[inline(always)]
    fn merge<C: Clustered, S: Simd>(&mut self, simd: S, low: usize, high: usize, pairs: &mut Pairs<C>) {
        let pair = [*self.item(low), *self.item(high)];
        let union = Cluster::of_pair::<C>(&pair, pairs.push(&pair));
        let last = self.len() - 1;
        let rows = last.div_ceil(LANES);
        let moved = *self.item(last);
        self.list.set::<C>(self.base + high, moved);
        self.list.set::<C>(self.base + low, union);
        self.list.len -= 1;
        let Matches { distances, positions, own_counts, match_counts, .. } = &mut *self.matches;
        // Nothing is closer to the union than the two were to each other, nor as close with fewer primitives than either.
        positions[low] = STALE;
        match_counts[low] = pair[0].count.max(pair[1].count);
        own_counts[low] = union.count;
        positions[high] = positions[last];
        match_counts[high] = match_counts[last];
        own_counts[high] = own_counts[last];
        distances[high] = distances[last];
        distances[last] = f32::INFINITY;
        // Who had one of the two as its match has none now; who had the last one finds it at its new place.
        let [low, high, last] = [low, high, last].map(|at| u32x8::splat(simd, at as u32));
        for row in positions.chunks_exact_mut(LANES).take(rows) {
            let best = u32x8::from_slice(simd, row);
            let moved = best.simd_eq(last).select(high, best);
            let lost = best.simd_eq(low) | best.simd_eq(high);
            lost.select(u32x8::splat(simd, STALE), moved).store_slice(row);
        }
    }
}

/// A bit for each of the first `count` of eight lanes.
#[inline(always)]
fn lanes_below(count: usize) -> u32 {
    if count >= LANES { 0xff } else { (1 << count) - 1 }
}
