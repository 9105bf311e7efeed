//! `combine_clusters`: the upward half of approximate agglomerative clustering, a list of clusters in which the closest
//! pair merges until few enough are left (Gu, He, Fatahalian, Blelloch, *Efficient BVH Construction via Approximate
//! Agglomerative Clustering*, HPG 2013).
//!
//! Each cluster keeps its best match. After a merge only clusters whose match was one of the two search again, and only
//! when their old distance has become the smallest of all: merging never brings anything closer, so the old distance is
//! a lower bound until then.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "several arrays are indexed by the same field")]
#![allow(clippy::too_many_arguments, reason = "a struct for one call would hide what the papers' step takes")]

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, SimdMask, f32x8, u32x8};

use super::{Container, Node};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{Aabb, Sphere};

/// Numbers that describe a container; a sphere leaves two unused.
pub const FIELDS: usize = 6;
/// Clusters compared at a time.
const LANES: usize = 8;
/// Marks a cluster whose best match has to be searched again; its distance is a lower bound.
const STALE: u32 = u32::MAX;
/// Lower than every distance.
const UNKNOWN: f32 = -1.0;
/// A list this long is cancelled between its merges, not only between lists.
const LONG_LIST: usize = 256;

/// Two nodes that were merged: the children of one interior node. While the tree is built a node's `count` is the number
/// of primitives below it, and its `first` is the slot of its children or, below a single primitive, its position in
/// Morton order.
pub type Pair<C> = [Node<C>; 2];

/// A container that can be compared with eight others at a time.
pub trait Clustered: Container {
    /// How many of the fields are used.
    const USED_FIELDS: usize;
    /// The numbers that describe it.
    fn fields(&self) -> [f32; FIELDS];
    /// The point that its Morton code is made of.
    fn middle(&self) -> glam::Vec3;
    /// The container that `fields` describe.
    fn from_fields(fields: [f32; FIELDS]) -> Self;
    /// The surface area of the union with each of `others`, or a number that grows with it.
    fn distances<S: Simd>(own: &[f32x8<S>; FIELDS], others: &[f32x8<S>; FIELDS]) -> f32x8<S>;
}

impl Clustered for Aabb {
    const USED_FIELDS: usize = 6;

    #[inline(always)]
    fn fields(&self) -> [f32; FIELDS] {
        [self.min.x, self.min.y, self.min.z, self.max.x, self.max.y, self.max.z]
    }

    #[inline(always)]
    fn middle(&self) -> glam::Vec3 {
        self.center()
    }

    #[inline(always)]
    fn from_fields([ax, ay, az, bx, by, bz]: [f32; FIELDS]) -> Self {
        Self { min: glam::Vec3::new(ax, ay, az), max: glam::Vec3::new(bx, by, bz) }
    }

    #[inline(always)]
    fn distances<S: Simd>(own: &[f32x8<S>; FIELDS], others: &[f32x8<S>; FIELDS]) -> f32x8<S> {
        let x = own[3].max(others[3]) - own[0].min(others[0]);
        let y = own[4].max(others[4]) - own[1].min(others[1]);
        let z = own[5].max(others[5]) - own[2].min(others[2]);
        x * (y + z) + y * z
    }
}

impl Clustered for Sphere {
    const USED_FIELDS: usize = 4;

    #[inline(always)]
    fn fields(&self) -> [f32; FIELDS] {
        [self.center.x, self.center.y, self.center.z, self.radius, 0.0, 0.0]
    }

    #[inline(always)]
    fn middle(&self) -> glam::Vec3 {
        self.center
    }

    #[inline(always)]
    fn from_fields([x, y, z, radius, ..]: [f32; FIELDS]) -> Self {
        Self { center: glam::Vec3::new(x, y, z), radius }
    }

    #[inline(always)]
    fn distances<S: Simd>(own: &[f32x8<S>; FIELDS], others: &[f32x8<S>; FIELDS]) -> f32x8<S> {
        let (x, y, z) = (own[0] - others[0], own[1] - others[1], own[2] - others[2]);
        let reach = ((x * x + y * y + z * z).sqrt() + (own[3] + others[3])) * 0.5;
        // The radius grows with the area; a sphere inside the other does not enlarge it.
        reach.max(own[3]).max(others[3])
    }
}

/// What is known about best matches when a list comes in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Matches {
    /// Nothing.
    None,
    /// Each cluster's best match within its own half; the second half starts here.
    Halves(usize),
    /// Each cluster's best match in the whole list.
    All,
}

/// A stack of clusters as a structure of arrays. The lists that a subtree works on lie behind one another at its end.
#[derive(Debug)]
pub struct Clusters {
    fields: [Vec<f32>; FIELDS],
    /// Distance to the best match, or a lower bound where that is [`STALE`].
    best_distance: Vec<f32>,
    /// Position of the best match, or [`STALE`].
    best: Vec<u32>,
    /// `first` and `count` of the cluster's node; see [`Pair`].
    first: Vec<u32>,
    count: Vec<u32>,
    /// A slot that only this cluster may fill: each primitive brings one, each merge uses one.
    free_slot: Vec<u32>,
    len: usize,
}

impl Clusters {
    /// A stack with room for `capacity` clusters; it grows where that is not enough.
    pub fn with_capacity(capacity: usize) -> Self {
        let room = capacity + LANES;
        Self {
            fields: std::array::from_fn(|_| vec![0.0; room]),
            best_distance: vec![0.0; room],
            best: vec![0; room],
            first: vec![0; room],
            count: vec![0; room],
            free_slot: vec![0; room],
            len: 0,
        }
    }

    /// Number of clusters on the stack.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Puts a single primitive, at `position` in Morton order, on the stack.
    #[inline(always)]
    pub fn push<C: Clustered>(&mut self, container: &C, position: u32) {
        self.reserve(1);
        let at = self.len;
        let fields = container.fields();
        for field in 0..C::USED_FIELDS {
            self.fields[field][at] = fields[field];
        }
        self.best_distance[at] = UNKNOWN;
        self.best[at] = STALE;
        self.first[at] = position;
        self.count[at] = 1;
        self.free_slot[at] = position;
        self.len = at + 1;
    }

    /// Puts the clusters of `other`, with their matches, on top.
    pub fn append(&mut self, other: &Self) {
        self.reserve(other.len);
        let (at, end) = (self.len, self.len + other.len);
        for (own, others) in self.fields.iter_mut().zip(&other.fields) {
            own[at..end].copy_from_slice(&others[..other.len]);
        }
        self.best_distance[at..end].copy_from_slice(&other.best_distance[..other.len]);
        for (own, &best) in self.best[at..end].iter_mut().zip(&other.best) {
            *own = if best == STALE { STALE } else { best + at as u32 };
        }
        self.first[at..end].copy_from_slice(&other.first[..other.len]);
        self.count[at..end].copy_from_slice(&other.count[..other.len]);
        self.free_slot[at..end].copy_from_slice(&other.free_slot[..other.len]);
        self.len = end;
    }

    /// The node of the cluster at `at`.
    #[inline(always)]
    pub fn node<C: Clustered>(&self, at: usize) -> Node<C> {
        let mut fields = [0.0; FIELDS];
        for field in 0..C::USED_FIELDS {
            fields[field] = self.fields[field][at];
        }
        Node { container: C::from_fields(fields), first: self.first[at], count: self.count[at] }
    }

    #[inline(always)]
    fn reserve(&mut self, more: usize) {
        if self.len + more + LANES > self.best.len() {
            self.grow(more);
        }
    }

    #[cold]
    fn grow(&mut self, more: usize) {
        let room = 2 * (self.len + more + LANES);
        for field in &mut self.fields {
            field.resize(room, 0.0);
        }
        self.best_distance.resize(room, 0.0);
        for list in [&mut self.best, &mut self.first, &mut self.count, &mut self.free_slot] {
            list.resize(room, 0);
        }
    }

    /// Merges the closest pair of the clusters from `base` on until no more than `target` are left. The merged pairs go to
    /// `slots`, whose first one has the number `slot_offset`. Returns what is known about matches afterwards.
    #[inline(always)]
    pub fn combine_clusters<C: Clustered, S: Simd>(
        &mut self,
        simd: S,
        base: usize,
        matches: Matches,
        target: usize,
        slots: &mut [Pair<C>],
        slot_offset: usize,
        token: &CancelToken,
    ) -> Result<Matches, Cancelled> {
        if self.len - base <= target {
            return Ok(if matches == Matches::All { Matches::All } else { Matches::None });
        }
        match matches {
            Matches::All => {}
            Matches::Halves(middle) => self.match_halves::<C, S>(simd, base, middle),
            Matches::None => {
                for at in base..self.len {
                    self.find_best_match::<C, S>(simd, base, at);
                }
            }
        }
        while self.len - base > target {
            if self.len - base >= LONG_LIST {
                token.check()?;
            }
            let (low, high) = self.closest_pair::<C, S>(simd, base);
            self.merge::<C, S>(simd, base, low, high, slots, slot_offset);
        }
        Ok(Matches::All)
    }

    /// Eight containers from `at` on.
    #[inline(always)]
    fn row<C: Clustered, S: Simd>(&self, simd: S, at: usize) -> [f32x8<S>; FIELDS] {
        std::array::from_fn(|field| {
            if field < C::USED_FIELDS {
                f32x8::from_slice(simd, &self.fields[field][at..at + LANES])
            } else {
                f32x8::splat(simd, 0.0)
            }
        })
    }

    /// The container at `at`, eight times.
    #[inline(always)]
    fn broadcast<C: Clustered, S: Simd>(&self, simd: S, at: usize) -> [f32x8<S>; FIELDS] {
        std::array::from_fn(|field| {
            f32x8::splat(simd, if field < C::USED_FIELDS { self.fields[field][at] } else { 0.0 })
        })
    }

    /// Searches the best match of the cluster at `at` among all from `base` on: the smallest distance, then the fewest
    /// primitives, then the lowest position.
    #[inline(always)]
    fn find_best_match<C: Clustered, S: Simd>(&mut self, simd: S, base: usize, at: usize) {
        let own = self.broadcast::<C, S>(simd, at);
        let mut best = (f32::INFINITY, u32::MAX, STALE);
        let mut chunk = base;
        while chunk < self.len {
            let distances = C::distances(&own, &self.row::<C, S>(simd, chunk));
            let mut valid = lanes_below(self.len - chunk);
            if at >= chunk && at < chunk + LANES {
                valid &= !(1 << (at - chunk));
            }
            self.take_best(simd, distances, valid, chunk, &mut best);
            chunk += LANES;
        }
        self.best_distance[at] = best.0;
        self.best[at] = best.2;
    }

    /// Replaces `best` (distance, primitives, position) where one of the `valid` lanes of `distances`, which belong to the
    /// clusters from `chunk` on, is better.
    #[inline(always)]
    fn take_best<S: Simd>(&self, simd: S, distances: f32x8<S>, valid: u32, chunk: usize, best: &mut (f32, u32, u32)) {
        let distances = <f32x8<S> as SimdBase<S>>::Mask::from_bitmask(simd, u64::from(valid))
            .select(distances, f32x8::splat(simd, f32::INFINITY));
        let smallest = distances.reduce_min();
        if smallest > best.0 {
            return;
        }
        let mut lanes = distances.simd_eq(f32x8::splat(simd, smallest)).to_bitmask() as u32 & valid;
        while lanes != 0 {
            let position = chunk + lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            let found = (smallest, self.count[position], position as u32);
            if found < *best {
                *best = found;
            }
        }
    }

    /// Joins two lists that know their matches: only the distances from one half to the other are new.
    #[inline(always)]
    fn match_halves<C: Clustered, S: Simd>(&mut self, simd: S, base: usize, middle: usize) {
        for at in base..middle {
            let own = self.broadcast::<C, S>(simd, at);
            let mut row_best = (f32::INFINITY, u32::MAX, STALE);
            let mut chunk = middle;
            while chunk < self.len {
                let distances = C::distances(&own, &self.row::<C, S>(simd, chunk));
                let valid = lanes_below(self.len - chunk);
                self.take_best(simd, distances, valid, chunk, &mut row_best);
                // The same distances seen from the second half.
                let known = f32x8::from_slice(simd, &self.best_distance[chunk..chunk + LANES]);
                let matches = u32x8::from_slice(simd, &self.best[chunk..chunk + LANES]);
                let closer = distances.simd_lt(known);
                closer.select(distances, known).store_slice(&mut self.best_distance[chunk..chunk + LANES]);
                closer.select(u32x8::splat(simd, at as u32), matches).store_slice(&mut self.best[chunk..chunk + LANES]);
                let mut ties = distances.simd_eq(known).to_bitmask() as u32 & valid;
                while ties != 0 {
                    let position = chunk + ties.trailing_zeros() as usize;
                    ties &= ties - 1;
                    self.break_tie(position, at);
                }
                chunk += LANES;
            }
            if row_best.0 < self.best_distance[at] {
                self.best_distance[at] = row_best.0;
                self.best[at] = row_best.2;
            } else if row_best.0 == self.best_distance[at] {
                self.break_tie(at, row_best.2 as usize);
            }
        }
    }

    /// Makes `candidate`, as close as the known best match of `at`, its match if it has fewer primitives or stands lower.
    fn break_tie(&mut self, at: usize, candidate: usize) {
        let best = self.best[at] as usize;
        if self.best[at] != STALE && (self.count[candidate], candidate) < (self.count[best], best) {
            self.best[at] = candidate as u32;
        }
    }

    /// The pair with the smallest distance, then the fewest primitives, then the lowest positions.
    #[inline(always)]
    fn closest_pair<C: Clustered, S: Simd>(&mut self, simd: S, base: usize) -> (usize, usize) {
        loop {
            let mut smallest = f32x8::splat(simd, f32::INFINITY);
            let mut chunk = base;
            while chunk < self.len {
                let distances = f32x8::from_slice(simd, &self.best_distance[chunk..chunk + LANES]);
                let valid =
                    <f32x8<S> as SimdBase<S>>::Mask::from_bitmask(simd, u64::from(lanes_below(self.len - chunk)));
                smallest = smallest.min(valid.select(distances, f32x8::splat(simd, f32::INFINITY)));
                chunk += LANES;
            }
            let smallest = smallest.reduce_min();
            let mut closest: Option<(u32, usize, usize)> = None;
            let mut chunk = base;
            while chunk < self.len {
                let distances = f32x8::from_slice(simd, &self.best_distance[chunk..chunk + LANES]);
                let mut lanes =
                    distances.simd_eq(f32x8::splat(simd, smallest)).to_bitmask() as u32 & lanes_below(self.len - chunk);
                while lanes != 0 {
                    let at = chunk + lanes.trailing_zeros() as usize;
                    lanes &= lanes - 1;
                    if self.best[at] == STALE {
                        self.find_best_match::<C, S>(simd, base, at);
                        if self.best_distance[at] > smallest {
                            continue;
                        }
                    }
                    let other = self.best[at] as usize;
                    let found = (self.count[at] + self.count[other], at.min(other), at.max(other));
                    if closest.is_none_or(|closest| found < closest) {
                        closest = Some(found);
                    }
                }
                chunk += LANES;
            }
            if let Some((_, low, high)) = closest {
                return (low, high);
            }
        }
    }

    /// Replaces the clusters at `low` and `high` by their union at `low`; the last cluster moves to `high`.
    #[inline(always)]
    fn merge<C: Clustered, S: Simd>(
        &mut self,
        simd: S,
        base: usize,
        low: usize,
        high: usize,
        slots: &mut [Pair<C>],
        slot_offset: usize,
    ) {
        let (first, second) = (self.node::<C>(low), self.node::<C>(high));
        let slot = self.free_slot[low];
        slots[slot as usize - slot_offset] = [first, second];
        let union = first.container.union(&second.container).fields();
        let last = self.len - 1;
        for field in 0..C::USED_FIELDS {
            self.fields[field][low] = union[field];
            self.fields[field][high] = self.fields[field][last];
        }
        self.first[low] = slot;
        self.count[low] = first.count + second.count;
        self.free_slot[low] = self.free_slot[high];
        // Nothing is closer to the union than the two were to each other.
        self.best[low] = STALE;
        self.best[high] = self.best[last];
        self.best_distance[high] = self.best_distance[last];
        if last != high {
            self.first[high] = self.first[last];
            self.count[high] = self.count[last];
            self.free_slot[high] = self.free_slot[last];
        }
        self.len = last;
        // Who had one of the two as its match has none now; who had the last one finds it at its new place.
        let [low, high, last] = [low, high, last].map(|at| u32x8::splat(simd, at as u32));
        let mut chunk = base;
        while chunk < self.len {
            let best = u32x8::from_slice(simd, &self.best[chunk..chunk + LANES]);
            let moved = best.simd_eq(last).select(high, best);
            let lost = best.simd_eq(low) | best.simd_eq(high);
            lost.select(u32x8::splat(simd, STALE), moved).store_slice(&mut self.best[chunk..chunk + LANES]);
            chunk += LANES;
        }
    }
}

/// A bit for each of the first `count` of eight lanes.
#[inline(always)]
fn lanes_below(count: usize) -> u32 {
    if count >= LANES { 0xff } else { (1 << count) - 1 }
}
