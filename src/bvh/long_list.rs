//! `combine_clusters` for lists of any length. Each cluster keeps its best match. After a merge only clusters whose match
//! was one of the two search again, and only when their old distance has become the smallest of all: merging never brings
//! anything closer, so the old distance is a lower bound until then. Nor does it bring anything as close with fewer
//! primitives; only among matches that are equal in both may one have moved below the one that was found.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Select, Simd, SimdBase, SimdMask, f32x8, u32x8};

use super::cluster::{Cluster, Clustered, Clusters, LANES, Pairs, broadcast};
use crate::cancel::{CancelToken, Cancelled};

/// Marks a cluster whose best match has to be searched again; its distance is a lower bound.
const STALE: u32 = u32::MAX;
/// Merges between two looks at the token.
const MERGES_BETWEEN_CHECKS: usize = 64;

/// The best matches of the clusters of a list.
#[derive(Debug, Default)]
pub struct Matches {
    /// Distance to the best match, or a lower bound where that is [`STALE`].
    distances: Vec<f32>,
    /// Position of the best match in the list, or [`STALE`].
    positions: Vec<u32>,
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

    /// Searches the best match of the cluster at `at`: the smallest distance, then the fewest primitives, then the lowest
    /// position.
    #[inline(always)]
    fn find_best_match<C: Clustered, S: Simd>(&mut self, simd: S, at: usize) {
        let own = broadcast::<C, S>(simd, self.item(at));
        let infinity = f32x8::splat(simd, f32::INFINITY);
        let mut best = (f32::INFINITY, u32::MAX, STALE);
        for chunk in (0..self.len()).step_by(LANES) {
            let distances = C::distances(&own, &self.list.row::<C, S>(simd, self.base + chunk));
            let mut valid = lanes_below(self.len() - chunk);
            if at / LANES == chunk / LANES {
                valid &= !(1 << (at - chunk));
            }
            let distances =
                <f32x8<S> as SimdBase<S>>::Mask::from_bitmask(simd, u64::from(valid)).select(distances, infinity);
            let smallest = distances.reduce_min();
            if smallest > best.0 {
                continue;
            }
            let mut lanes = distances.simd_eq(f32x8::splat(simd, smallest)).to_bitmask() as u32 & valid;
            while lanes != 0 {
                let position = chunk + lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                let found = (smallest, self.item(position).count, position as u32);
                if found < best {
                    best = found;
                }
            }
        }
        self.matches.distances[at] = best.0;
        self.matches.positions[at] = best.2;
    }

    /// The pair with the smallest distance, then the fewest primitives, then the lowest positions.
    #[inline(always)]
    fn closest_pair<C: Clustered, S: Simd>(
        &mut self,
        simd: S,
        token: &CancelToken,
    ) -> Result<(usize, usize), Cancelled> {
        loop {
            let mut smallest = f32x8::splat(simd, f32::INFINITY);
            for chunk in (0..self.len()).step_by(LANES) {
                smallest = smallest.min(f32x8::from_slice(simd, &self.matches.distances[chunk..chunk + LANES]));
            }
            let smallest = smallest.reduce_min();
            let mut closest: Option<(u32, usize, usize)> = None;
            for chunk in (0..self.len()).step_by(LANES) {
                let distances = f32x8::from_slice(simd, &self.matches.distances[chunk..chunk + LANES]);
                let equal = distances.simd_eq(f32x8::splat(simd, smallest)).to_bitmask() as u32;
                let mut lanes = equal & lanes_below(self.len() - chunk);
                while lanes != 0 {
                    let at = chunk + lanes.trailing_zeros() as usize;
                    lanes &= lanes - 1;
                    if self.matches.positions[at] == STALE {
                        token.check()?;
                        self.find_best_match::<C, S>(simd, at);
                        if self.matches.distances[at] > smallest {
                            continue;
                        }
                    }
                    let other = self.matches.positions[at] as usize;
                    let found = (self.item(at).count + self.item(other).count, at.min(other), at.max(other));
                    if closest.is_none_or(|closest| found < closest) {
                        closest = Some(found);
                    }
                }
            }
            if let Some((_, low, high)) = closest {
                return Ok((low, high));
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
        let Matches { distances, positions } = &mut *self.matches;
        // Nothing is closer to the union than the two were to each other.
        positions[low] = STALE;
        positions[high] = positions[last];
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
