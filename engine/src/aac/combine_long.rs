//! `combine_clusters` for lists of any length. Instead of each cluster's best match a lower bound of the distance to it is stored:
//! merging never brings clusters closer, so that a bound stays a valid lower bound. A cluster searches again only when its bound is the
//! smallest. If the two clusters with the smallest bound are at just this distance, they are the closest
//! pair. A union takes the place of its first cluster; that of the second stays empty until there are many such places.
//!
//! The *query* is the cluster whose best match was searched last: its distances to all others are still stored.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "several arrays are indexed by the same row or field")]

use fearless_simd::{Select, Simd, SimdBase, SimdMask, f32x16};

use crate::aac::cluster::{Cluster, ClusterStack};
use crate::aac::cluster_container::{ClusterContainer, splat_fields};
use crate::aac::cluster_row::{Row, WIDTH, equal, lane_mask, minimum_of_each};
use crate::aac::pair_writer::PairWriter;
use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::bits::bits;

/// One bit per lane of a row.
const ALL_LANES: u64 = (1 << WIDTH) - 1;
/// Number of rows whose lanes fill a word of bits.
const ROWS_PER_WORD: usize = 64 / WIDTH;
/// Index of no cluster.
const NO_INDEX: usize = usize::MAX;
/// A list is compacted when a quarter of its places is empty, but at least a row.
const COMPACTION_DIVISOR: usize = 4;

/// Number of searches for the smallest of the tied pairs, after which any of those found will do: a list of many small groups of
/// equal clusters would otherwise search all of them before each merge.
const MAX_TIE_SEARCHES: usize = 32;

/// Working memory of [`combine_long`], reused from list to list.
pub struct Scratch<C: ClusterContainer> {
    rows: Vec<Row<C>>,
    /// Indices of the clusters with the smallest bound.
    tied: Vec<usize>,
}

impl<C: ClusterContainer> Default for Scratch<C> {
    fn default() -> Self {
        Self { rows: Vec::new(), tied: Vec::new() }
    }
}

/// Merges the closest pair of the clusters from `base` on until `target` are left. There must be more than `target`. Not
/// inlined: the code for short lists around it would compete with it for registers.
#[inline(never)]
pub fn combine_long<C: ClusterContainer, S: Simd>(
    simd: S,
    list: &mut ClusterStack<C>,
    scratch: &mut Scratch<C>,
    base: usize,
    target: usize,
    pairs: &mut PairWriter<C>,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    simd.vectorize(
        #[inline(always)]
        || {
            let len = list.len - base;
            let Scratch { rows, tied } = scratch;
            rows.clear();
            rows.extend((base..list.len).step_by(WIDTH).map(|at| Row::new(list, at, list.len)));
            let items = &mut list.items[base..base + len];
            let mut search = Search {
                rows: rows.as_mut_slice(),
                items,
                len,
                query: NO_INDEX,
                query_nearest: f32x16::splat(simd, 0.0),
            };
            // for each c in C: c.closest = find_best_match(C, c)
            let mut smallest = search.find_all_best_matches(simd, token)?;
            loop {
                // (left, right) = the pair with the smallest distance
                let closest = search.smallest_bounds(simd, smallest);
                let (low, high) = match closest.count {
                    // Its best match has been merged: otherwise that would have the smallest bound too.
                    1 => (closest.first, closest.first),
                    2 if closest.has_query || search.is_pair(simd, &closest) => (closest.first, closest.last),
                    _ => search.break_tie(simd, &closest, tied, token)?,
                };
                // C = C − {left, right} + the cluster of both; search again
                smallest = search.merge_or_search(simd, low, high, pairs);
                if search.len <= target {
                    break;
                }
                if search.is_sparse() {
                    smallest = search.compact(simd, tied);
                }
                token.check()?;
            }
            search.compact(simd, tied);
            list.len = base + search.len;
            for (row, at) in rows.iter().zip((base..list.len).step_by(WIDTH)) {
                for field in 0..C::USED_FIELDS {
                    list.fields[field][at..at + WIDTH].copy_from_slice(&row.fields[field]);
                }
            }
            Ok(())
        },
    )
}

/// A list while its clusters are merged.
struct Search<'a, S: Simd, C: ClusterContainer> {
    rows: &'a mut [Row<C>],
    /// The clusters; some places are empty.
    items: &'a mut [Cluster<C>],
    /// Number of clusters.
    len: usize,
    /// Index of the query; [`NO_INDEX`] if there is none.
    query: usize,
    /// Smallest distance to the query in each lane.
    query_nearest: f32x16<S>,
}

/// The clusters with the smallest bound or distance to the query.
struct SmallestBounds<S: Simd> {
    /// That bound, in all lanes.
    distance: f32x16<S>,
    /// Number of these clusters, the query included.
    count: u32,
    /// Index of the first of them.
    first: usize,
    /// Index of the last of them.
    last: usize,
    /// Whether the query is one of them.
    has_query: bool,
}

impl<S: Simd, C: ClusterContainer> Search<'_, S, C> {
    /// Computes the distance of each pair of clusters once and stores each cluster's bound. Returns the smallest bound of each lane.
    #[inline(always)]
    fn find_all_best_matches(&mut self, simd: S, token: &CancelToken) -> Result<f32x16<S>, Cancelled> {
        let infinity = f32x16::splat(simd, f32::INFINITY);
        let mut smallest = infinity;
        for at in 0..self.rows.len() {
            token.check()?;
            let [row, behind @ ..] = &mut self.rows[at..] else { break };
            let mut bounds = f32x16::load_array_ref(simd, &row.bounds);
            let own = row.fields(simd);
            let items = &self.items[at * WIDTH..self.items.len().min((at + 1) * WIDTH)];
            for (lane, item) in items.iter().enumerate() {
                let distances = C::merge_distances(simd, &splat_fields::<C, S, _>(simd, &item.fields), &own);
                let itself = lane_mask::<S>(simd, lane);
                bounds = bounds.min(itself.select(infinity, distances));
            }
            if let Ok(items) = <&[Cluster<C>; WIDTH]>::try_from(items) {
                let mut found = [infinity; WIDTH];
                for other in behind {
                    let others = other.fields(simd);
                    let mut bounds = f32x16::load_array_ref(simd, &other.bounds);
                    for lane in 0..WIDTH {
                        let own = splat_fields::<C, S, _>(simd, &items[lane].fields);
                        let distances = C::merge_distances(simd, &own, &others);
                        found[lane] = found[lane].min(distances);
                        bounds = bounds.min(distances);
                    }
                    bounds.store_slice(&mut other.bounds);
                }
                bounds = bounds.min(minimum_of_each(found));
            }
            bounds.store_slice(&mut row.bounds);
            smallest = smallest.min(bounds);
        }
        Ok(smallest)
    }

    /// Makes the cluster at `at`, whose fields are `own` in all lanes, the query and computes its distances to all others. The
    /// cluster at `merged`, unless it is the same, is removed. Returns the smallest bound or distance of each lane.
    #[inline(always)]
    fn find_best_match(&mut self, simd: S, own: &C::Fields<f32x16<S>>, at: usize, merged: usize) -> f32x16<S> {
        self.store_query_bound(simd);
        self.exclude(simd, merged);
        self.exclude(simd, at);
        self.query = at;
        let infinity = f32x16::splat(simd, f32::INFINITY);
        let (mut nearest, mut smallest) = (infinity, infinity);
        for row in &mut *self.rows {
            let bounds = f32x16::load_array_ref(simd, &row.bounds);
            let distances = C::merge_distances(simd, own, &row.fields(simd));
            let distances = bounds.simd_eq(infinity).select(infinity, distances);
            distances.store_slice(&mut row.query_distances);
            nearest = nearest.min(distances);
            smallest = smallest.min(bounds);
        }
        self.query_nearest = nearest;
        smallest.min(nearest)
    }

    /// Stores the bound of the query, which then is a cluster like all others.
    #[inline(always)]
    fn store_query_bound(&mut self, simd: S) {
        if let Some(row) = self.rows.get_mut(self.query / WIDTH) {
            let infinity = f32x16::splat(simd, f32::INFINITY);
            let found = f32x16::splat(simd, self.query_nearest.reduce_min());
            let here = lane_mask::<S>(simd, self.query).select(found, infinity);
            // Not a store of this lane alone: the next load of the whole row would stall on store forwarding.
            f32x16::load_array_ref(simd, &row.bounds).min(here).store_slice(&mut row.bounds);
            self.query = NO_INDEX;
        }
    }

    /// Excludes the place `at` from the search, by an infinite bound.
    #[inline(always)]
    fn exclude(&mut self, simd: S, at: usize) {
        let row = &mut self.rows[at / WIDTH];
        let infinity = f32x16::splat(simd, f32::INFINITY);
        let here = lane_mask::<S>(simd, at).select(infinity, f32x16::splat(simd, 0.0));
        f32x16::load_array_ref(simd, &row.bounds).max(here).store_slice(&mut row.bounds);
    }

    /// The clusters whose bound or distance to the query is the minimum of `smallest`.
    #[inline(always)]
    fn smallest_bounds(&self, simd: S, smallest: f32x16<S>) -> SmallestBounds<S> {
        let distance = f32x16::splat(simd, smallest.reduce_min());
        let mut closest = SmallestBounds { distance, count: 0, first: NO_INDEX, last: 0, has_query: false };
        for (word, rows) in self.rows.chunks(ROWS_PER_WORD).enumerate() {
            let (mut bounds, mut query_distances) = (0_u64, 0_u64);
            for (at, row) in rows.iter().enumerate() {
                bounds |= equal(simd, &row.bounds, distance) << (at * WIDTH);
                query_distances |= equal(simd, &row.query_distances, distance) << (at * WIDTH);
            }
            closest.has_query |= query_distances != 0;
            let places = bounds | query_distances;
            if places != 0 {
                let start = word * ROWS_PER_WORD * WIDTH;
                closest.count += places.count_ones();
                closest.first = closest.first.min(start + places.trailing_zeros() as usize);
                closest.last = start + places.ilog2() as usize;
            }
        }
        if closest.has_query {
            closest.count += 1;
            closest.first = closest.first.min(self.query);
            closest.last = closest.last.max(self.query);
        }
        closest
    }

    /// Whether the only two clusters with the smallest bound are at this distance from each other.
    #[inline(always)]
    fn is_pair(&self, simd: S, closest: &SmallestBounds<S>) -> bool {
        let [first, last] = [&self.items[closest.first], &self.items[closest.last]];
        let first = splat_fields::<C, S, f32x16<S>>(simd, &first.fields);
        let distance = C::merge_distances(simd, &first, &splat_fields::<C, S, _>(simd, &last.fields));
        distance.simd_eq(closest.distance).any_true()
    }

    /// Of the pairs at the distance of the smallest bound, the one with the fewest primitives, then with the lowest indices, as far
    /// as [`MAX_TIE_SEARCHES`] show; if there is none any more, some cluster twice. `tied` is scratch memory.
    #[inline(always)]
    fn break_tie(
        &mut self,
        simd: S,
        closest: &SmallestBounds<S>,
        tied: &mut Vec<usize>,
        token: &CancelToken,
    ) -> Result<(usize, usize), Cancelled> {
        tied.clear();
        for (row, lanes) in self.rows.iter().enumerate() {
            let mut tied_lanes =
                equal(simd, &lanes.bounds, closest.distance) | equal(simd, &lanes.query_distances, closest.distance);
            if closest.has_query && row == self.query / WIDTH {
                tied_lanes |= 1 << (self.query % WIDTH);
            }
            tied.extend(bits(tied_lanes).map(|lane| row * WIDTH + lane));
        }
        // The two smallest primitive counts.
        let mut fewest = [u32::MAX; 2];
        for &at in tied.iter() {
            let count = self.items[at].count;
            fewest = [fewest[0].min(count), fewest[1].min(count.max(fewest[0]))];
        }
        let fewest_together = fewest[0].saturating_add(fewest[1]);
        let mut best = (u32::MAX, closest.first, closest.first);
        let mut searches = 0;
        // Clusters with few primitives first, in order of their index: a pair of these precedes all other pairs.
        for have_few in [true, false] {
            for &at in tied.iter() {
                let count = self.items[at].count;
                if (count <= fewest[1]) != have_few {
                    continue;
                }
                token.check()?;
                let own = splat_fields::<C, S, _>(simd, &self.items[at].fields);
                self.find_best_match(simd, &own, at, at);
                for (row, start) in self.rows.iter().zip((0..).step_by(WIDTH)) {
                    for other in bits(equal(simd, &row.query_distances, closest.distance)).map(|lane| start + lane) {
                        best = best.min((count + self.items[other].count, at.min(other), at.max(other)));
                        if best.0 <= fewest_together {
                            return Ok((best.1, best.2));
                        }
                    }
                }
                searches += 1;
                if searches >= MAX_TIE_SEARCHES && best.0 < u32::MAX {
                    return Ok((best.1, best.2));
                }
            }
        }
        Ok((best.1, best.2))
    }

    /// Replaces the clusters at `low` and `high` by their union at `low` and searches its best match; if `low` and `high` are the
    /// same, only searches again. Without a branch, as it would be unpredictable. Returns the smallest bound of each lane.
    #[inline(always)]
    fn merge_or_search(&mut self, simd: S, low: usize, high: usize, pairs: &mut PairWriter<C>) -> f32x16<S> {
        let lanes = C::union_fields::<S, f32x16<S>>(simd, &self.items[low].fields, &self.items[high].fields);
        let pair = [self.items[low], self.items[high]];
        let is_merge = low != high;
        let first = pairs.push_if(is_merge, &pair);
        let first = if is_merge { first } else { pair[0].first };
        let count = pair[0].count + if is_merge { pair[1].count } else { 0 };
        let union = Cluster::from_lanes::<S, _>(&lanes, first, count);
        self.len -= usize::from(is_merge);
        let smallest = self.find_best_match(simd, &lanes, low, high);
        // After its row was read: a load of the whole row would stall on this store to a part of it.
        self.set(low, union);
        smallest
    }

    /// Stores `cluster` at `at`.
    #[inline(always)]
    fn set(&mut self, at: usize, cluster: Cluster<C>) {
        self.items[at] = cluster;
        let row = &mut self.rows[at / WIDTH];
        for field in 0..C::USED_FIELDS {
            row.fields[field][at % WIDTH] = cluster.fields[field];
        }
    }

    /// Whether enough places are empty to compact the list.
    #[inline(always)]
    fn is_sparse(&self) -> bool {
        self.items.len() - self.len >= (self.items.len() / COMPACTION_DIVISOR).max(WIDTH)
    }

    /// Moves the last clusters to the empty places; afterwards there is no query. Returns the smallest bound of each lane.
    /// `places` is scratch memory.
    #[inline(always)]
    fn compact(&mut self, simd: S, places: &mut Vec<usize>) -> f32x16<S> {
        self.store_query_bound(simd);
        let infinity = f32x16::splat(simd, f32::INFINITY);
        places.clear();
        for (row, start) in self.rows.iter().zip((0..self.len).step_by(WIDTH)) {
            let empty = bits(equal(simd, &row.bounds, infinity));
            places.extend(empty.map(|lane| start + lane).filter(|&place| place < self.len));
        }
        let mut to = 0;
        for start in (self.len / WIDTH * WIDTH..self.items.len()).step_by(WIDTH) {
            let occupied = equal(simd, &self.rows[start / WIDTH].bounds, infinity) ^ ALL_LANES;
            for from in bits(occupied).map(|lane| start + lane) {
                if from >= self.len {
                    let bound = self.rows[start / WIDTH].bounds[from % WIDTH];
                    self.rows[places[to] / WIDTH].bounds[places[to] % WIDTH] = bound;
                    self.set(places[to], self.items[from]);
                    to += 1;
                }
            }
        }
        let (items, rows) = (std::mem::take(&mut self.items), std::mem::take(&mut self.rows));
        self.items = &mut items[..self.len];
        self.rows = &mut rows[..self.len.div_ceil(WIDTH)];
        if let Some(last) = self.rows.last_mut() {
            last.bounds[(self.len - 1) % WIDTH + 1..].fill(f32::INFINITY);
        }
        let mut smallest = infinity;
        for row in &mut *self.rows {
            infinity.store_slice(&mut row.query_distances);
            smallest = smallest.min(f32x16::load_array_ref(simd, &row.bounds));
        }
        smallest
    }
}
