//! `combine_clusters` for lists of any length. Each cluster keeps its best match. After a merge only clusters whose match
//! was one of the two search again, and only when their old match would still beat the best pair that is known: merging
//! never brings anything closer, nor as close with fewer primitives, so that the old match is a lower bound in both until
//! then. That keeps ties cheap: of a list of equal clusters all have the same match, and only one or two search again after
//! each merge. Only among matches that are equal in both may one have moved below the one that was found.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "several arrays are indexed by the same row")]

use fearless_simd::{Select, Simd, SimdBase, SimdMask, f32x16, u32x16};

use super::cluster::{Cluster, Clustered, Clusters, FIELDS, Pairs, broadcast};
use crate::cancel::{CancelToken, Cancelled};

/// Clusters compared at a time.
const WIDTH: usize = 16;
/// Marks a cluster whose best match has to be searched again; its distance and its count are lower bounds.
const STALE: u32 = u32::MAX;
/// Distances from one cluster to others between two looks at the token.
const COMPARED_BETWEEN_CHECKS: usize = 64;

/// What is known of the clusters of a list, one after the other; whole rows, of which those behind the end have a distance
/// that is no number and so never the smallest.
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
    let room = (list.len - base).next_multiple_of(WIDTH);
    matches.own_counts.clear();
    matches.own_counts.extend(list.items[base..list.len].iter().map(|cluster| cluster.count));
    matches.own_counts.resize(room, 0);
    matches.distances.resize(room, 0.0);
    matches.positions.resize(room, STALE);
    matches.match_counts.resize(room, 0);
    let mut search = Search { list, matches, base };
    let rows = room / WIDTH;
    for row in (0..rows).step_by(2) {
        if row + 1 < rows {
            search.find_best_matches::<C, S, 2>(simd, row, token)?;
        } else {
            search.find_best_matches::<C, S, 1>(simd, row, token)?;
        }
    }
    let mut asking = None;
    loop {
        let (low, high) = search.closest_pair::<C, S>(simd, asking, token)?;
        search.merge::<C, S>(simd, low, high, pairs);
        if search.len() <= target {
            return Ok(());
        }
        // Nothing is closer to the union than the two were to each other: it is the next to ask for its match.
        asking = Some(low);
    }
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

    /// Searches the best matches of all clusters of `R` rows from `first` on: the smallest distance, then the fewest
    /// primitives, then the lowest position.
    #[inline(always)]
    fn find_best_matches<C: Clustered, S: Simd, const R: usize>(
        &mut self,
        simd: S,
        first: usize,
        token: &CancelToken,
    ) -> Result<(), Cancelled> {
        let nothing = f32x16::splat(simd, f32::NAN);
        let mut own = [[nothing; FIELDS]; R];
        let mut lanes = [lanes_of(simd, first); R];
        let mut best = [Best::none(simd); R];
        for row in 0..R {
            own[row] = self.list.row::<C, S, _>(simd, self.base + (first + row) * WIDTH);
            lanes[row] = lanes_of(simd, first + row);
        }
        for at in 0..self.len() {
            if at % COMPARED_BETWEEN_CHECKS == 0 {
                token.check()?;
            }
            let position = u32x16::splat(simd, at as u32);
            let counts = u32x16::splat(simd, self.matches.own_counts[at]);
            let other = broadcast::<C, S, _>(simd, self.item(at));
            for row in 0..R {
                let distances = C::distances(&other, &own[row]);
                best[row].offer(lanes[row].simd_eq(position).select(nothing, distances), counts, position);
            }
        }
        let end = u32x16::splat(simd, self.len() as u32);
        let Matches { distances, positions, match_counts, .. } = &mut *self.matches;
        for row in 0..R {
            let range = (first + row) * WIDTH..(first + row + 1) * WIDTH;
            let behind = lanes[row].simd_ge(end);
            behind.select(nothing, best[row].distances).store_slice(&mut distances[range.clone()]);
            best[row].counts.store_slice(&mut match_counts[range.clone()]);
            best[row].positions.store_slice(&mut positions[range]);
        }
        Ok(())
    }

    /// The same for the cluster at `at` alone.
    #[inline(always)]
    fn best_match<C: Clustered, S: Simd>(&self, simd: S, at: usize) -> Found {
        let own = broadcast::<C, S, f32x16<S>>(simd, self.item(at));
        let len = self.len();
        let nothing = f32x16::splat(simd, f32::NAN);
        let (itself, end) = (u32x16::splat(simd, at as u32), u32x16::splat(simd, len as u32));
        let mut best = Best::none(simd);
        for row in 0..len.div_ceil(WIDTH) {
            let lanes = lanes_of(simd, row);
            let distances = C::distances(&own, &self.list.row::<C, S, _>(simd, self.base + row * WIDTH));
            // Neither itself nor what stands behind the end.
            let distances = (lanes.simd_eq(itself) | lanes.simd_ge(end)).select(nothing, distances);
            best.offer(distances, row_of(simd, &self.matches.own_counts, row), lanes);
        }
        best.least(simd)
    }

    /// The cluster whose pair has the smallest distance, then the fewest primitives, then the lowest position, without that
    /// at `asking`.
    #[inline(always)]
    fn closest<S: Simd>(&self, simd: S, asking: u32) -> Found {
        let Matches { distances, own_counts, match_counts, .. } = &*self.matches;
        let nothing = f32x16::splat(simd, f32::NAN);
        let asking = u32x16::splat(simd, asking);
        let mut best = Best::none(simd);
        for row in 0..self.len().div_ceil(WIDTH) {
            let lanes = lanes_of(simd, row);
            let distances = f32x16::from_slice(simd, &distances[row * WIDTH..(row + 1) * WIDTH]);
            let counts: u32x16<S> = row_of(simd, own_counts, row) + row_of(simd, match_counts, row);
            best.offer(lanes.simd_eq(asking).select(nothing, distances), counts, lanes);
        }
        best.least(simd)
    }

    /// The pair with the smallest distance, then the fewest primitives, then the lowest positions; `asking` has to search its
    /// match first.
    #[inline(always)]
    fn closest_pair<C: Clustered, S: Simd>(
        &mut self,
        simd: S,
        mut asking: Option<usize>,
        token: &CancelToken,
    ) -> Result<(usize, usize), Cancelled> {
        loop {
            // Neither of the two waits for the other.
            let mut closest = self.closest(simd, asking.map_or(STALE, |at| at as u32));
            if let Some(at) = asking {
                token.check()?;
                let found = self.best_match::<C, S>(simd, at);
                let Matches { distances, positions, own_counts, match_counts } = &mut *self.matches;
                (distances[at], match_counts[at], positions[at]) = (found.distance, found.count, found.position);
                let found = Found { count: own_counts[at] + found.count, position: at as u32, ..found };
                if found.is_before(&closest) {
                    closest = found;
                }
            }
            let at = closest.position as usize;
            let other = self.matches.positions[at];
            if other != STALE {
                return Ok((at.min(other as usize), at.max(other as usize)));
            }
            asking = Some(at);
        }
    }

    /// Replaces the clusters at `low` and `high` by their union at `low`; the last cluster moves to `high`.
    #[inline(always)]
    fn merge<C: Clustered, S: Simd>(&mut self, simd: S, low: usize, high: usize, pairs: &mut Pairs<C>) {
        let pair = [*self.item(low), *self.item(high)];
        let union = Cluster::of_pair::<C>(&pair, pairs.push(&pair));
        let last = self.len() - 1;
        let rows = last.div_ceil(WIDTH);
        let moved = *self.item(last);
        self.list.set::<C>(self.base + high, moved);
        self.list.set::<C>(self.base + low, union);
        self.list.len -= 1;
        let Matches { distances, positions, own_counts, match_counts } = &mut *self.matches;
        own_counts[low] = union.count;
        positions[high] = positions[last];
        match_counts[high] = match_counts[last];
        own_counts[high] = own_counts[last];
        distances[high] = distances[last];
        distances[last] = f32::NAN;
        // Who had one of the two as its match has none now; who had the last one finds it at its new place.
        let [low, high, last] = [low, high, last].map(|at| u32x16::splat(simd, at as u32));
        for row in positions.as_chunks_mut::<WIDTH>().0.iter_mut().take(rows) {
            let best = u32x16::load_array_ref(simd, row);
            let moved = best.simd_eq(last).select(high, best);
            let lost = best.simd_eq(low) | best.simd_eq(high);
            lost.select(u32x16::splat(simd, STALE), moved).store_slice(row);
        }
    }
}

/// What a search has found.
struct Found {
    distance: f32,
    /// Number of primitives.
    count: u32,
    position: u32,
}

impl Found {
    fn is_before(&self, other: &Self) -> bool {
        self.distance < other.distance
            || self.distance == other.distance && (self.count, self.position) < (other.count, other.position)
    }
}

/// The best that each lane has seen: the smallest distance, then the fewest primitives, then the first.
#[derive(Clone, Copy)]
struct Best<S: Simd> {
    distances: f32x16<S>,
    counts: u32x16<S>,
    positions: u32x16<S>,
}

impl<S: Simd> Best<S> {
    #[inline(always)]
    fn none(simd: S) -> Self {
        let most = u32x16::splat(simd, u32::MAX);
        Self { distances: f32x16::splat(simd, f32::INFINITY), counts: most, positions: most }
    }

    /// Takes what is better; nothing is where the distance is no number.
    #[inline(always)]
    fn offer(&mut self, distances: f32x16<S>, counts: u32x16<S>, positions: u32x16<S>) {
        let tied = distances.simd_eq(self.distances) & counts.simd_lt(self.counts);
        let better = distances.simd_lt(self.distances) | tied;
        self.distances = better.select(distances, self.distances);
        self.counts = better.select(counts, self.counts);
        self.positions = better.select(positions, self.positions);
    }

    /// The best of all lanes, of equally good ones that at the lowest position.
    #[inline(always)]
    fn least(self, simd: S) -> Found {
        let smallest = self.distances.reduce_min();
        let mut lanes = self.distances.simd_eq(f32x16::splat(simd, smallest)).to_bitmask();
        let (counts, positions) = (self.counts.to_array(), self.positions.to_array());
        let mut best = (u32::MAX, u32::MAX);
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % WIDTH;
            lanes &= lanes - 1;
            best = best.min((counts[lane], positions[lane]));
        }
        Found { distance: smallest, count: best.0, position: best.1 }
    }
}

/// The positions of `row`.
#[inline(always)]
fn lanes_of<S: Simd>(simd: S, row: usize) -> u32x16<S> {
    let first = u32x16::load_array(simd, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]);
    first + u32x16::splat(simd, (row * WIDTH) as u32)
}

#[inline(always)]
fn row_of<S: Simd>(simd: S, numbers: &[u32], row: usize) -> u32x16<S> {
    u32x16::from_slice(simd, &numbers[row * WIDTH..(row + 1) * WIDTH])
}
