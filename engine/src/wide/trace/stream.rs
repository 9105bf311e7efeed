//! Streams of incoherent rays: a node is tested against all rays that reach it, one after the other, each against its
//! eight children side by side; each child is then visited with the rays that enter it (after Barringer,
//! Akenine-Möller, *Dynamic Ray Stream Traversal*, 2014). The rays share what a visit costs apart from the tests, above
//! all memory latency. Several streams are interleaved step by step, so that the prefetches of one complete while the
//! others run.
//!
//! For any-hit queries children are visited in the order of their lanes, by hits per cost, which the node has from the build: nothing
//! is sorted. Unblocked rays visit the same nodes in any order.

use fearless_simd::{Bytes, Select, Simd, SimdBase, SimdMask, f32x8, mask32x8, u32x8};

use crate::geometry::{Hit, Ray};
use crate::kernel::bits::bits;
use crate::tree::traverse::{Nearest, NoProbe};
use crate::wide::block::BlockRay;
use crate::wide::bounds::WideContainer;
use crate::wide::box_lanes::LaneTest;
use crate::wide::child::Child;
use crate::wide::layout::WIDTH;
use crate::wide::ray_lanes::{RAY_LANES, RayLanes};
use crate::wide::trace::single;
use crate::wide::tree::{Addresses, WideTree};

/// Number of rays in a word of a ray set, one bit each.
const WORD: usize = 32;
/// Number of interleaved streams. Found by experiment: more hide more memory latency, until their rays no longer fit
/// the cache.
const STREAMS: usize = 4;
/// Maximum number of stack entries; the rays of a stream that needs more are traced one by one.
pub(super) const STACK: usize = 120;

/// A query for streams of `RAYS` rays, whose sets have `WORDS` words.
trait Query<const RAYS: usize, const WORDS: usize> {
    type Output: Clone;
    /// Whether any hit suffices.
    const ANY: bool;
    /// Result for a ray that hits nothing.
    const NOTHING: Self::Output;
    /// Result for ray `index` of a finished stream.
    fn output(stream: &Stream<RAYS, WORDS>, index: usize) -> Self::Output;
}

/// Query whether anything lies on a ray.
struct AnyHit;

impl<const RAYS: usize, const WORDS: usize> Query<RAYS, WORDS> for AnyHit {
    type Output = bool;
    const ANY: bool = true;
    const NOTHING: bool = false;

    #[inline(always)]
    fn output(stream: &Stream<RAYS, WORDS>, index: usize) -> bool {
        stream.blocked >> index & 1 != 0
    }
}

/// Query for a ray's closest hit.
struct ClosestHit;

impl<const RAYS: usize, const WORDS: usize> Query<RAYS, WORDS> for ClosestHit {
    type Output = Option<Hit>;
    const ANY: bool = false;
    const NOTHING: Option<Hit> = None;

    #[inline(always)]
    fn output(stream: &Stream<RAYS, WORDS>, index: usize) -> Option<Hit> {
        stream.nearest[index].hit()
    }
}

/// For each of `rays` whether anything lies on it, written to the first elements of `blocked`.
#[inline(always)]
pub(crate) fn any_hits<S: Simd, C: WideContainer>(simd: S, tree: &WideTree<C>, rays: &[Ray], blocked: &mut [bool]) {
    // The numbers of rays per stream, here and for closest hits, were found by experiment.
    trace::<S, C, AnyHit, 64, 2>(simd, tree, rays, blocked);
}

/// The closest hits of `rays`, written to the first elements of `hits`.
#[inline(always)]
pub(crate) fn closest_hits<S: Simd, C: WideContainer>(
    simd: S,
    tree: &WideTree<C>,
    rays: &[Ray],
    hits: &mut [Option<Hit>],
) {
    trace::<S, C, ClosestHit, 32, 1>(simd, tree, rays, hits);
}

#[inline(always)]
fn trace<S: Simd, C: WideContainer, Q: Query<RAYS, WORDS>, const RAYS: usize, const WORDS: usize>(
    simd: S,
    tree: &WideTree<C>,
    rays: &[Ray],
    outputs: &mut [Q::Output],
) {
    const { assert!(RAYS == WORDS * WORD && RAYS <= u64::BITS as usize) };
    let Some(root) = tree.root else { return outputs[..rays.len()].fill(Q::NOTHING) };
    if rays.is_empty() {
        return;
    }
    #[allow(clippy::large_stack_arrays, reason = "42 KiB, a part of the smallest stack of any thread")]
    let mut streams = [const { Stream::<RAYS, WORDS>::EMPTY }; STREAMS];
    let addresses = tree.addresses();
    let mut next = 0;
    loop {
        let mut is_busy = false;
        for stream in &mut streams {
            if stream.top == 0 {
                for (index, output) in outputs[stream.first..][..stream.count].iter_mut().enumerate() {
                    *output = Q::output(stream, index % RAYS);
                }
                let batch = &rays[next..rays.len().min(next + RAYS)];
                if Q::ANY {
                    stream.start::<S, C, true>(simd, root, next, batch);
                } else {
                    stream.start::<S, C, false>(simd, root, next, batch);
                }
                next += batch.len();
            }
            is_busy |= stream.count > 0;
            if stream.top > STACK {
                stream.finish_single::<S, C, Q>(simd, tree, rays);
            } else if Q::ANY {
                stream.step::<S, C, true>(simd, tree, &addresses, rays);
            } else {
                stream.step::<S, C, false>(simd, tree, &addresses, rays);
            }
        }
        if !is_busy {
            return;
        }
    }
}

/// Rays that traverse the tree together, and their stack.
pub(super) struct Stream<const RAYS: usize, const WORDS: usize> {
    /// Index of the first ray in the list.
    first: usize,
    /// Number of rays.
    count: usize,
    pub(super) rays: RayLanes<RAYS>,
    /// Upper bound of each ray's distance.
    pub(super) t: [f32; RAYS],
    /// For any-hit queries one bit for each ray that is blocked.
    pub(super) blocked: u64,
    /// For closest-hit queries the closest hit so far.
    pub(super) nearest: [Nearest; RAYS],
    /// One bit for each ray that still needs to be traced.
    pub(super) active: u64,
    /// Number of stack entries. The stack has space for all children of one more node.
    pub(super) top: usize,
    pub(super) children: [Child; STACK + WIDTH],
    /// The rays to visit each child with, word by word.
    pub(super) sets: [[u32; STACK + WIDTH]; WORDS],
    /// For closest-hit queries the distance at which the first ray enters each child.
    pub(super) entries: [f32; STACK + WIDTH],
}

impl<const RAYS: usize, const WORDS: usize> Stream<RAYS, WORDS> {
    pub(super) const EMPTY: Self = Self {
        first: 0,
        count: 0,
        rays: RayLanes::EMPTY,
        t: [0.0; RAYS],
        blocked: 0,
        nearest: [Nearest::NOTHING; RAYS],
        active: 0,
        top: 0,
        children: [Child::ROOT; STACK + WIDTH],
        sets: [[0; STACK + WIDTH]; WORDS],
        entries: [0.0; STACK + WIDTH],
    };

    /// Starts up to `RAYS` rays, the first of which has index `first`. Not inlined, because the surrounding loop would
    /// run out of registers.
    #[inline(never)]
    pub(super) fn start<S: Simd, C: WideContainer, const ANY: bool>(
        &mut self,
        simd: S,
        root: Child,
        first: usize,
        rays: &[Ray],
    ) {
        (self.first, self.count) = (first, rays.len());
        (self.active, self.blocked) = (0, 0);
        for (group, rays) in rays.chunks(RAY_LANES).enumerate() {
            let at = group * RAY_LANES % RAYS;
            let able = simd.vectorize(
                #[inline(always)]
                || self.rays.set::<S, C>(simd, at, rays),
            );
            self.active |= u64::from(able) << at;
            for (t, ray) in self.t[at..].iter_mut().zip(rays) {
                *t = ray.t_max.min(f32::MAX);
            }
        }
        if !ANY {
            for (nearest, ray) in self.nearest.iter_mut().zip(rays) {
                *nearest = Nearest::new(ray.t_max);
            }
        }
        self.start_at(root);
    }

    /// Starts the active rays at `root`.
    #[inline(always)]
    pub(super) fn start_at(&mut self, root: Child) {
        (self.children[0], self.entries[0]) = (root, 0.0);
        for (word, sets) in self.sets.iter_mut().enumerate() {
            sets[0] = word_of(self.active, word);
        }
        self.top = usize::from(self.active != 0);
    }

    /// Pops the next child with the rays that still need to visit it; `None` if the stream has finished.
    #[inline(always)]
    pub(super) fn next<S: Simd, const ANY: bool>(&mut self, simd: S) -> Option<(Child, u64)> {
        while self.top > 0 {
            self.top -= 1;
            let mut set = 0;
            for (word, sets) in self.sets.iter().enumerate() {
                set |= u64::from(sets[self.top]) << (word * WORD);
            }
            set &= self.active;
            if !ANY {
                let entry = f32x8::splat(simd, self.entries[self.top]);
                let mut near = 0;
                for (group, t) in self.t.chunks_exact(8).enumerate() {
                    near |= (f32x8::from_slice(simd, t).simd_ge(entry).to_bitmask()) << (8 * group);
                }
                set &= near;
            }
            if set != 0 {
                return Some((self.children[self.top], set));
            }
        }
        None
    }

    /// Visits the next child.
    #[inline(always)]
    fn step<S: Simd, C: WideContainer, const ANY: bool>(
        &mut self,
        simd: S,
        tree: &WideTree<C>,
        addresses: &Addresses<C>,
        rays: &[Ray],
    ) {
        let Some((child, set)) = self.next::<S, ANY>(simd) else { return };
        if child.is_leaf() {
            // The next child was prefetched with its siblings. Any-hit rays rarely get as far as the one after it.
            if !ANY {
                addresses.prefetch(self.children[self.top.saturating_sub(2)]);
            }
            self.test_leaf::<S, C, ANY>(simd, tree, child, set, rays);
        } else {
            self.enter::<S, C, ANY>(simd, tree, addresses, child, set);
        }
    }

    #[inline(always)]
    fn test_leaf<S: Simd, C: WideContainer, const ANY: bool>(
        &mut self,
        simd: S,
        tree: &WideTree<C>,
        leaf: Child,
        set: u64,
        rays: &[Ray],
    ) {
        for block in tree.leaves.blocks(leaf) {
            for index in bits(set & self.active) {
                let index = index % RAYS;
                let ray = &rays[self.first + index];
                let block_ray = BlockRay::new(&self.rays.triangles, index);
                if ANY {
                    let meets = u64::from(block_ray.any_hit(simd, block, ray, self.t[index])) << index;
                    self.blocked |= meets;
                    self.active &= !meets;
                } else {
                    let nearest = &mut self.nearest[index];
                    block_ray.closest_hit(simd, block, ray, nearest);
                    self.t[index] = nearest.t();
                }
            }
        }
    }

    /// Tests the children of `node` with the rays of `set`, and pushes those that any of them enters.
    #[inline(always)]
    pub(super) fn enter<S: Simd, C: WideContainer, const ANY: bool>(
        &mut self,
        simd: S,
        tree: &WideTree<C>,
        addresses: &Addresses<C>,
        node: Child,
        set: u64,
    ) {
        let mut space = None;
        let (bounds, children) = tree.node(node).unpack(simd, &mut space);
        let none = u32x8::splat(simd, 0);
        let mut sets = [none; WORDS];
        let mut entries = f32x8::splat(simd, f32::INFINITY);
        for index in bits(set) {
            let index = index % RAYS;
            let (enters, entry) = C::prepare(simd, &self.rays, index).intersect_lanes(simd, bounds, self.t[index]);
            for (word, set) in sets.iter_mut().enumerate() {
                *set |= enters.select(u32x8::splat(simd, word_of(1 << index, word)), none);
            }
            if !ANY {
                entries = enters.select(entry.min(entries), entries);
            }
        }
        let mut union = sets[0];
        for set in &sets[1..] {
            union |= *set;
        }
        let entered = !union.simd_eq(none);
        let new_top = self.top + entered.to_bitmask().count_ones() as usize;
        let slots = self.top % (STACK + 1)..self.top % (STACK + 1) + WIDTH;
        let stack_children = &mut self.children[slots.clone()];
        if ANY {
            let children = u32x8::load_array_ref(simd, bytemuck::cast_ref(children)).compress(entered);
            stack_children.copy_from_slice(bytemuck::cast_slice(children.as_slice()));
            for (stack_set, set) in self.sets.iter_mut().zip(&sets) {
                stack_set[slots.clone()].copy_from_slice(set.compress(entered).as_slice());
            }
        } else {
            let slot_of_lane = stack_slots(simd, entered, entries);
            let stack_entries = &mut self.entries[slots.clone()];
            for lane in 0..WIDTH {
                let slot = slot_of_lane[lane] as usize % WIDTH;
                stack_children[slot] = children[lane];
                stack_entries[slot] = entries[lane];
            }
            for (stack_set, set) in self.sets.iter_mut().zip(&sets) {
                let stack_set = &mut stack_set[slots.clone()];
                for lane in 0..WIDTH {
                    stack_set[slot_of_lane[lane] as usize % WIDTH] = set[lane];
                }
            }
        }
        // Prefetch the next two; later ones are often culled before they are visited.
        for ahead in 1..=2 {
            addresses.prefetch(self.children[new_top.saturating_sub(ahead)]);
        }
        self.top = new_top;
    }

    /// Restarts the active rays from the root, each by itself with a growing stack.
    #[cold]
    #[inline(never)]
    fn finish_single<S: Simd, C: WideContainer, Q: Query<RAYS, WORDS>>(
        &mut self,
        simd: S,
        tree: &WideTree<C>,
        rays: &[Ray],
    ) {
        for index in bits(self.active) {
            let index = index % RAYS;
            let ray = &rays[self.first + index];
            simd.vectorize(
                #[inline(always)]
                || {
                    if Q::ANY {
                        let blocked = single::any_hit(simd, tree, ray, &mut NoProbe);
                        self.blocked |= u64::from(blocked) << index;
                    } else {
                        self.nearest[index] = single::nearest::<S, C, NoProbe, false>(simd, tree, ray, &mut NoProbe);
                    }
                },
            );
        }
        self.top = 0;
    }
}

/// Stack slots of the entered children, so that the nearest comes last; all other lanes get the slot after these. Counted instead of
/// sorted, because the branches of a sort could not be predicted.
#[inline(always)]
fn stack_slots<S: Simd>(simd: S, entered: mask32x8<S>, entries: f32x8<S>) -> [u32; WIDTH] {
    // The lane in the lowest bits breaks ties.
    let finite = entries.min(f32x8::splat(simd, f32::MAX));
    let lanes = u32x8::from_slice(simd, &[0, 1, 2, 3, 4, 5, 6, 7]);
    let tagged: f32x8<S> = (finite.bitcast::<u32x8<S>>() & !7 | lanes).bitcast();
    let keys = entered.select(tagged, f32x8::splat(simd, -1.0));
    let one = u32x8::splat(simd, 1);
    let mut slot_of_lane = u32x8::splat(simd, 0);
    for key in keys.to_array() {
        let key = f32x8::splat(simd, key);
        slot_of_lane = key.simd_gt(keys).select(slot_of_lane + one, slot_of_lane);
    }
    slot_of_lane.to_array()
}

/// A word of a ray set.
#[inline(always)]
fn word_of(set: u64, word: usize) -> u32 {
    (set >> (word * WORD)) as u32
}
