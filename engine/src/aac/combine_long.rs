//! `combine_clusters` for lists of any length. Of each cluster a lower bound of the distance to its best match is kept. Merging
//! never brings anything closer, so that a bound holds until its cluster searches again, and it does so only when no other
//! bound is as small: the two of a pair both have the smallest. A union takes the place of its first part; that of the second
//! stays empty until there are many such places.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "several arrays are indexed by the same row or field")]

use fearless_simd::{Select, Simd, SimdBase, SimdMask, f32x16, mask32x16, u32x16};

use crate::aac::cluster::{Cluster, Clustered, Clusters, Pairs, splat_fields};
use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::bits::bits;
use crate::kernel::lanes::FIELDS;

/// Clusters compared at a time.
const WIDTH: usize = 16;
/// The bits of a row's lanes.
const ALL_LANES: u64 = (1 << WIDTH) - 1;
/// Rows whose lanes' bits are a word.
const WORD: usize = 64 / WIDTH;
/// Stands for the place of no cluster.
const NOBODY: usize = usize::MAX;
/// A list is closed up when one place in so many is empty, but not for less than a row.
const EMPTY_PART: usize = 4;

/// What lists need to be searched, kept for the next one.
#[derive(Debug, Default)]
pub struct Matches {
    rows: Vec<Row>,
    /// Clusters with the smallest bound.
    tied: Vec<usize>,
}

/// What is known of clusters that are compared at a time.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct Row {
    /// The container, see [`Clustered::fields`].
    fields: [[f32; WIDTH]; FIELDS],
    /// Lower bound of the distance to the best match; infinity for an empty place and for the cluster that asks.
    bounds: [f32; WIDTH],
    /// Distances to the cluster that asks; infinity where the bounds are, and if none asks.
    answers: [f32; WIDTH],
}

impl Row {
    /// The row from `at` on of a list that ends at `end`.
    #[inline(always)]
    fn new<C: Clustered>(list: &Clusters, at: usize, end: usize) -> Self {
        let mut row =
            Self { fields: [[0.0; WIDTH]; FIELDS], bounds: [f32::INFINITY; WIDTH], answers: [f32::INFINITY; WIDTH] };
        for field in 0..C::USED_FIELDS {
            // There is room for a row behind the list.
            row.fields[field].copy_from_slice(&list.fields[field][at..at + WIDTH]);
            row.fields[field][WIDTH.min(end - at)..].fill(C::NOWHERE[field]);
        }
        row
    }

    #[inline(always)]
    fn fields<C: Clustered, S: Simd>(&self, simd: S) -> [f32x16<S>; FIELDS] {
        let mut fields = [f32x16::splat(simd, 0.0); FIELDS];
        for field in 0..C::USED_FIELDS {
            fields[field] = f32x16::load_array_ref(simd, &self.fields[field]);
        }
        fields
    }
}

/// Merges the closest pair of the clusters from `base` on until `target` are left; there are more. A function of its own: within
/// the caller it would take registers from the short lists, and they from it.
#[inline(never)]
pub fn combine_long<C: Clustered, S: Simd>(
    simd: S,
    list: &mut Clusters,
    matches: &mut Matches,
    base: usize,
    target: usize,
    pairs: &mut Pairs<C>,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    simd.vectorize(
        #[inline(always)]
        || {
            let len = list.len - base;
            let Matches { rows, tied } = matches;
            rows.clear();
            rows.extend((base..list.len).step_by(WIDTH).map(|at| Row::new::<C>(list, at, list.len)));
            let items = &mut list.items[base..base + len];
            let mut search =
                Search { rows: rows.as_mut_slice(), items, len, asking: NOBODY, answer: f32x16::splat(simd, 0.0) };
            let mut smallest = search.find_bounds::<C>(simd, token)?;
            loop {
                let closest = search.closest(simd, smallest);
                let (low, high) = match closest.count {
                    // Its match has merged: of a pair that is left both have the smallest bound.
                    1 => (closest.first, closest.first),
                    2 if closest.is_asking || search.is_pair::<C>(simd, &closest) => (closest.first, closest.last),
                    _ => search.break_tie::<C>(simd, &closest, tied, token)?,
                };
                smallest = search.step::<C>(simd, low, high, pairs);
                if search.len <= target {
                    break;
                }
                if search.has_many_empty() {
                    smallest = search.close_up::<C>(simd, tied);
                }
                token.check()?;
            }
            search.close_up::<C>(simd, tied);
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

/// A list at work.
struct Search<'a, S: Simd> {
    rows: &'a mut [Row],
    /// The clusters, some of whose places are empty.
    items: &'a mut [Cluster],
    /// Number of clusters.
    len: usize,
    /// Which cluster asks for its match, and its distances, the smallest of each lane.
    asking: usize,
    answer: f32x16<S>,
}

/// Who has the smallest bound.
struct Closest<S: Simd> {
    distance: f32x16<S>,
    count: u32,
    first: usize,
    last: usize,
    /// Whether the cluster that asks is one of them.
    is_asking: bool,
}

impl<S: Simd> Search<'_, S> {
    /// Compares all clusters with each other, each two once. Returns the smallest distances.
    #[inline(always)]
    fn find_bounds<C: Clustered>(&mut self, simd: S, token: &CancelToken) -> Result<f32x16<S>, Cancelled> {
        let nobody = f32x16::splat(simd, f32::INFINITY);
        let mut smallest = nobody;
        for at in 0..self.rows.len() {
            token.check()?;
            let [row, behind @ ..] = &mut self.rows[at..] else { break };
            let mut bounds = f32x16::load_array_ref(simd, &row.bounds);
            let own = row.fields::<C, S>(simd);
            let items = &self.items[at * WIDTH..self.items.len().min((at + 1) * WIDTH)];
            for (lane, item) in items.iter().enumerate() {
                let distances = C::distances(&splat_fields::<C, S, _>(simd, &item.fields), &own);
                let itself = lanes_at::<S>(simd, lane);
                bounds = bounds.min(itself.select(nobody, distances));
            }
            if let Ok(items) = <&[Cluster; WIDTH]>::try_from(items) {
                let mut found = [nobody; WIDTH];
                for other in behind {
                    let others = other.fields::<C, S>(simd);
                    let mut bounds = f32x16::load_array_ref(simd, &other.bounds);
                    for lane in 0..WIDTH {
                        let own = splat_fields::<C, S, _>(simd, &items[lane].fields);
                        let distances = C::distances(&own, &others);
                        found[lane] = found[lane].min(distances);
                        bounds = bounds.min(distances);
                    }
                    bounds.store_slice(&mut other.bounds);
                }
                bounds = bounds.min(smallest_of_each(found));
            }
            bounds.store_slice(&mut row.bounds);
            smallest = smallest.min(bounds);
        }
        Ok(smallest)
    }

    /// Makes the cluster at `at`, whose fields are `own` in all lanes, the one that asks; the one at `gone`, unless it is the
    /// same, is no more. Returns the smallest bounds and distances.
    #[inline(always)]
    fn ask<C: Clustered>(&mut self, simd: S, own: &[f32x16<S>; FIELDS], at: usize, gone: usize) -> f32x16<S> {
        self.settle(simd);
        self.hide(simd, gone);
        self.hide(simd, at);
        self.asking = at;
        let nobody = f32x16::splat(simd, f32::INFINITY);
        let (mut answer, mut smallest) = (nobody, nobody);
        for row in &mut *self.rows {
            let bounds = f32x16::load_array_ref(simd, &row.bounds);
            let distances = C::distances(own, &row.fields::<C, S>(simd));
            let distances = bounds.simd_eq(nobody).select(nobody, distances);
            distances.store_slice(&mut row.answers);
            answer = answer.min(distances);
            smallest = smallest.min(bounds);
        }
        self.answer = answer;
        smallest.min(answer)
    }

    /// Keeps what the cluster that asks has found.
    #[inline(always)]
    fn settle(&mut self, simd: S) {
        if let Some(row) = self.rows.get_mut(self.asking / WIDTH) {
            let nobody = f32x16::splat(simd, f32::INFINITY);
            let found = f32x16::splat(simd, self.answer.reduce_min());
            let here = lanes_at::<S>(simd, self.asking).select(found, nobody);
            // Not a store of the lane alone, for which those who read the row next would wait.
            f32x16::load_array_ref(simd, &row.bounds).min(here).store_slice(&mut row.bounds);
            self.asking = NOBODY;
        }
    }

    /// Leaves the place `at` out of what is searched.
    #[inline(always)]
    fn hide(&mut self, simd: S, at: usize) {
        let row = &mut self.rows[at / WIDTH];
        let nobody = f32x16::splat(simd, f32::INFINITY);
        let here = lanes_at::<S>(simd, at).select(nobody, f32x16::splat(simd, 0.0));
        f32x16::load_array_ref(simd, &row.bounds).max(here).store_slice(&mut row.bounds);
    }

    /// Who has the smallest bound, or a distance as small to the cluster that asks.
    #[inline(always)]
    fn closest(&self, simd: S, smallest: f32x16<S>) -> Closest<S> {
        let distance = f32x16::splat(simd, smallest.reduce_min());
        let mut closest = Closest { distance, count: 0, first: NOBODY, last: 0, is_asking: false };
        for (word, rows) in self.rows.chunks(WORD).enumerate() {
            let (mut bounds, mut answers) = (0_u64, 0_u64);
            for (at, row) in rows.iter().enumerate() {
                bounds |= equal(simd, &row.bounds, distance) << (at * WIDTH);
                answers |= equal(simd, &row.answers, distance) << (at * WIDTH);
            }
            closest.is_asking |= answers != 0;
            let places = bounds | answers;
            if places != 0 {
                let start = word * WORD * WIDTH;
                closest.count += places.count_ones();
                closest.first = closest.first.min(start + places.trailing_zeros() as usize);
                closest.last = start + places.ilog2() as usize;
            }
        }
        if closest.is_asking {
            closest.count += 1;
            closest.first = closest.first.min(self.asking);
            closest.last = closest.last.max(self.asking);
        }
        closest
    }

    /// Whether the only two with the smallest bound are as close to each other.
    #[inline(always)]
    fn is_pair<C: Clustered>(&self, simd: S, closest: &Closest<S>) -> bool {
        let [first, last] = [&self.items[closest.first], &self.items[closest.last]];
        let first = splat_fields::<C, S, f32x16<S>>(simd, &first.fields);
        let distance = C::distances(&first, &splat_fields::<C, S, _>(simd, &last.fields));
        distance.simd_eq(closest.distance).any_true()
    }

    /// Of the pairs that are as close as the smallest bound, that with the fewest primitives, then the lowest places; if all
    /// have merged, some cluster twice. `tied` is room for a list.
    #[inline(always)]
    fn break_tie<C: Clustered>(
        &mut self,
        simd: S,
        closest: &Closest<S>,
        tied: &mut Vec<usize>,
        token: &CancelToken,
    ) -> Result<(usize, usize), Cancelled> {
        tied.clear();
        for (row, lanes) in self.rows.iter().enumerate() {
            let mut tied_lanes =
                equal(simd, &lanes.bounds, closest.distance) | equal(simd, &lanes.answers, closest.distance);
            if closest.is_asking && row == self.asking / WIDTH {
                tied_lanes |= 1 << (self.asking % WIDTH);
            }
            tied.extend(bits(tied_lanes).map(|lane| row * WIDTH + lane));
        }
        // The two smallest counts of primitives.
        let mut fewest = [u32::MAX; 2];
        for &at in tied.iter() {
            let count = self.items[at].count;
            fewest = [fewest[0].min(count), fewest[1].min(count.max(fewest[0]))];
        }
        let fewest_together = fewest[0].saturating_add(fewest[1]);
        let mut best = (u32::MAX, closest.first, closest.first);
        // Those with few primitives first, from the lowest on: two of them are before all other pairs.
        for have_few in [true, false] {
            for &at in tied.iter() {
                let count = self.items[at].count;
                if (count <= fewest[1]) != have_few {
                    continue;
                }
                token.check()?;
                let own = splat_fields::<C, S, _>(simd, &self.items[at].fields);
                self.ask::<C>(simd, &own, at, at);
                for (row, start) in self.rows.iter().zip((0..).step_by(WIDTH)) {
                    for other in bits(equal(simd, &row.answers, closest.distance)).map(|lane| start + lane) {
                        best = best.min((count + self.items[other].count, at.min(other), at.max(other)));
                        if best.0 <= fewest_together {
                            return Ok((best.1, best.2));
                        }
                    }
                }
            }
        }
        Ok((best.1, best.2))
    }

    /// Replaces the clusters at `low` and `high` by their union at `low`, which asks; if they are the same, it just asks. One way
    /// for both: nobody could predict which comes next.
    #[inline(always)]
    fn step<C: Clustered>(&mut self, simd: S, low: usize, high: usize, pairs: &mut Pairs<C>) -> f32x16<S> {
        let lanes = C::union_fields::<S, f32x16<S>>(simd, &self.items[low].fields, &self.items[high].fields);
        let pair = [self.items[low], self.items[high]];
        let is_merge = low != high;
        let first = pairs.push_if(is_merge, &pair);
        let first = if is_merge { first } else { pair[0].first };
        let count = pair[0].count + if is_merge { pair[1].count } else { 0 };
        let union = Cluster::from_lanes::<C, S, _>(&lanes, first, count);
        self.len -= usize::from(is_merge);
        let smallest = self.ask::<C>(simd, &lanes, low, high);
        // Now that its row has been read, which would wait for what is written to a part of it.
        self.set::<C>(low, union);
        smallest
    }

    /// Puts `cluster` at `at`.
    #[inline(always)]
    fn set<C: Clustered>(&mut self, at: usize, cluster: Cluster) {
        self.items[at] = cluster;
        let row = &mut self.rows[at / WIDTH];
        for field in 0..C::USED_FIELDS {
            row.fields[field][at % WIDTH] = cluster.fields[field];
        }
    }

    #[inline(always)]
    fn has_many_empty(&self) -> bool {
        self.items.len() - self.len >= (self.items.len() / EMPTY_PART).max(WIDTH)
    }

    /// Moves the last clusters to the places that are empty; nobody asks then. Returns the smallest bounds. `places` is room
    /// for a list.
    #[inline(always)]
    fn close_up<C: Clustered>(&mut self, simd: S, places: &mut Vec<usize>) -> f32x16<S> {
        self.settle(simd);
        let nobody = f32x16::splat(simd, f32::INFINITY);
        places.clear();
        for (row, start) in self.rows.iter().zip((0..self.len).step_by(WIDTH)) {
            let empty = bits(equal(simd, &row.bounds, nobody));
            places.extend(empty.map(|lane| start + lane).filter(|&place| place < self.len));
        }
        let mut to = 0;
        for start in (self.len / WIDTH * WIDTH..self.items.len()).step_by(WIDTH) {
            let taken = equal(simd, &self.rows[start / WIDTH].bounds, nobody) ^ ALL_LANES;
            for from in bits(taken).map(|lane| start + lane) {
                if from >= self.len {
                    let bound = self.rows[start / WIDTH].bounds[from % WIDTH];
                    self.rows[places[to] / WIDTH].bounds[places[to] % WIDTH] = bound;
                    self.set::<C>(places[to], self.items[from]);
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
        let mut smallest = nobody;
        for row in &mut *self.rows {
            nobody.store_slice(&mut row.answers);
            smallest = smallest.min(f32x16::load_array_ref(simd, &row.bounds));
        }
        smallest
    }
}

/// The lane of place `at`, in its row.
#[inline(always)]
fn lanes_at<S: Simd>(simd: S, at: usize) -> mask32x16<S> {
    let lanes = u32x16::load_array(simd, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]);
    lanes.simd_eq(u32x16::splat(simd, (at % WIDTH) as u32))
}

/// The smallest lane of each vector, in the lane of its number.
#[inline(always)]
fn smallest_of_each<S: Simd>(mut vectors: [f32x16<S>; WIDTH]) -> f32x16<S> {
    let mut half = WIDTH / 2;
    while half > 0 {
        for at in 0..half {
            let (first, second) = (vectors[at], vectors[at + half]);
            vectors[at] = first.zip_low(second).min(first.zip_high(second));
        }
        half /= 2;
    }
    vectors[0]
}

/// A bit for each of `numbers` that is `number`.
#[inline(always)]
fn equal<S: Simd>(simd: S, numbers: &[f32; WIDTH], number: f32x16<S>) -> u64 {
    f32x16::load_array_ref(simd, numbers).simd_eq(number).to_bitmask()
}
