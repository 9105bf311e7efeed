//! Rays that have little in common, in streams: a node is tested against all rays that reach it, one after the other, its
//! eight children side by side, and each child goes on with those that enter it (after Barringer, Akenine-Möller: *Dynamic
//! Ray Stream Traversal*, 2014). So what a visit costs apart from the tests is shared, above all the wait for memory. Several
//! streams take turns, a step each, so that what one has asked for arrives while the others work.
//!
//! Where any hit will do and most rays are blocked, as in a room, the farthest child goes first: near their origin rays pass
//! what they left without hitting it. In the conference room ambient occlusion rays visit 1.7 nodes by that instead of 3.0, in
//! Sponza 2.5 instead of 5.0. Rays that nothing blocks see the same nodes in any order.

use fearless_simd::{Bytes, Select, Simd, SimdBase, SimdMask, f32x8, mask32x8, u32x8};

use crate::geometry::{Hit, Ray};
use crate::kernel::bits::bits;
use crate::tree::traverse::{Nearest, NoProbe};
use crate::wide::block::BlockRay;
use crate::wide::bounds::WideContainer;
use crate::wide::layout::WIDTH;
use crate::wide::ray_lanes::{RAY_LANES, RayLanes};
use crate::wide::trace::single;
use crate::wide::tree::{Child, WideTree};

/// Rays in a word of a set: one bit each.
const WORD: usize = 32;
/// Streams that take turns. Found by trial: more hide more of the wait for memory, until their own rays leave the cache.
const STREAMS: usize = 4;
/// Entries of a stack; the rays of a stream that needs more are traced one by one.
const STACK: usize = 120;

/// What is asked of each ray of streams of `RAYS`, in sets of `WORDS`.
trait Question<const RAYS: usize, const WORDS: usize> {
    type Answer: Clone;
    /// Whether any hit will do.
    const ANY: bool;
    /// The answer for rays that can hit nothing.
    const NOTHING: Self::Answer;
    /// The answer for ray `index` of a stream that is done.
    fn answer(stream: &Stream<RAYS, WORDS>, index: usize) -> Self::Answer;
}

/// Whether anything lies on a ray.
struct Any;

impl<const RAYS: usize, const WORDS: usize> Question<RAYS, WORDS> for Any {
    type Answer = bool;
    const ANY: bool = true;
    const NOTHING: bool = false;

    #[inline(always)]
    fn answer(stream: &Stream<RAYS, WORDS>, index: usize) -> bool {
        stream.blocked >> index & 1 != 0
    }
}

/// A ray's nearest hit.
struct Closest;

impl<const RAYS: usize, const WORDS: usize> Question<RAYS, WORDS> for Closest {
    type Answer = Option<Hit>;
    const ANY: bool = false;
    const NOTHING: Option<Hit> = None;

    #[inline(always)]
    fn answer(stream: &Stream<RAYS, WORDS>, index: usize) -> Option<Hit> {
        stream.nearest[index].hit()
    }
}

/// Whether anything lies on each of `rays`, into the first elements of `blocked`.
#[inline(always)]
pub(crate) fn any_hits<S: Simd, C: WideContainer>(simd: S, tree: &WideTree<C>, rays: &[Ray], blocked: &mut [bool]) {
    // As many rays a stream as is fastest, here and for the nearest hits. Found by trial.
    trace::<S, C, Any, 64, 2>(simd, tree, rays, blocked);
}

/// The nearest hits of `rays`, into the first elements of `hits`.
#[inline(always)]
pub(crate) fn closest_hits<S: Simd, C: WideContainer>(
    simd: S,
    tree: &WideTree<C>,
    rays: &[Ray],
    hits: &mut [Option<Hit>],
) {
    trace::<S, C, Closest, 32, 1>(simd, tree, rays, hits);
}

#[inline(always)]
fn trace<S: Simd, C: WideContainer, Q: Question<RAYS, WORDS>, const RAYS: usize, const WORDS: usize>(
    simd: S,
    tree: &WideTree<C>,
    rays: &[Ray],
    answers: &mut [Q::Answer],
) {
    const { assert!(RAYS == WORDS * WORD && RAYS <= u64::BITS as usize) };
    let Some(root) = tree.root else { return answers[..rays.len()].fill(Q::NOTHING) };
    if rays.is_empty() {
        return;
    }
    #[allow(clippy::large_stack_arrays, reason = "42 KiB, a part of the smallest stack of any thread")]
    let mut streams = [const { Stream::<RAYS, WORDS>::EMPTY }; STREAMS];
    let mut next = 0;
    // Most rays are taken to be blocked until it is known.
    let (mut traced, mut blocked) = (0, 0);
    loop {
        let mut is_busy = false;
        for stream in &mut streams {
            if stream.top == 0 {
                for (index, answer) in answers[stream.first..][..stream.count].iter_mut().enumerate() {
                    *answer = Q::answer(stream, index % RAYS);
                }
                (traced, blocked) = (traced + stream.count, blocked + stream.blocked.count_ones() as usize);
                let coming = &rays[next..rays.len().min(next + RAYS)];
                stream.start::<S, C, Q>(simd, root, next, coming);
                next += coming.len();
            }
            is_busy |= stream.count > 0;
            if stream.top > STACK {
                stream.finish_alone::<S, C, Q>(simd, tree, rays);
            } else if !Q::ANY {
                stream.step::<S, C, false, false>(simd, tree, rays);
            } else if traced <= 2 * blocked {
                stream.step::<S, C, true, true>(simd, tree, rays);
            } else {
                stream.step::<S, C, true, false>(simd, tree, rays);
            }
        }
        if !is_busy {
            return;
        }
    }
}

/// Rays under way through the tree together.
struct Stream<const RAYS: usize, const WORDS: usize> {
    /// The first ray's place in the list, and how many there are.
    first: usize,
    count: usize,
    rays: RayLanes<RAYS>,
    /// How far each ray looks.
    t: [f32; RAYS],
    /// What has been found, where any hit will do: one bit for each ray.
    blocked: u64,
    /// What has been found where the nearest hit is asked for.
    nearest: [Nearest; RAYS],
    /// The rays that still look.
    open: u64,
    /// What waits, the next one last, with room for all children of a node: where, for which rays, and how far away it is for
    /// the first of them to enter it, or the last one where the farthest goes first.
    top: usize,
    children: [Child; STACK + WIDTH],
    sets: [[u32; STACK + WIDTH]; WORDS],
    entries: [f32; STACK + WIDTH],
}

impl<const RAYS: usize, const WORDS: usize> Stream<RAYS, WORDS> {
    const EMPTY: Self = Self {
        first: 0,
        count: 0,
        rays: RayLanes::EMPTY,
        t: [0.0; RAYS],
        blocked: 0,
        nearest: [Nearest::NOTHING; RAYS],
        open: 0,
        top: 0,
        children: [Child::ROOT; STACK + WIDTH],
        sets: [[0; STACK + WIDTH]; WORDS],
        entries: [0.0; STACK + WIDTH],
    };

    /// Takes up to `RAYS` rays, of which the first is number `first`. Apart from the loop around it, which would get too few
    /// registers.
    #[inline(never)]
    fn start<S: Simd, C: WideContainer, Q: Question<RAYS, WORDS>>(
        &mut self,
        simd: S,
        root: Child,
        first: usize,
        rays: &[Ray],
    ) {
        (self.first, self.count) = (first, rays.len());
        (self.open, self.blocked) = (0, 0);
        for (group, rays) in rays.chunks(RAY_LANES).enumerate() {
            let at = group * RAY_LANES % RAYS;
            let able = simd.vectorize(
                #[inline(always)]
                || self.rays.set::<S, C>(simd, at, rays),
            );
            self.open |= u64::from(able) << at;
            for (t, ray) in self.t[at..].iter_mut().zip(rays) {
                *t = ray.t_max.min(f32::MAX);
            }
        }
        if !Q::ANY {
            for (nearest, ray) in self.nearest.iter_mut().zip(rays) {
                *nearest = Nearest::new(ray.t_max);
            }
        }
        (self.children[0], self.entries[0]) = (root, 0.0);
        for (word, sets) in self.sets.iter_mut().enumerate() {
            sets[0] = word_of(self.open, word);
        }
        self.top = usize::from(self.open != 0);
    }

    /// What comes next, with the rays that still need it; `None` where the stream is done.
    #[inline(always)]
    fn next<S: Simd, const ANY: bool>(&mut self, simd: S) -> Option<(Child, u64)> {
        while self.top > 0 {
            self.top -= 1;
            let mut set = 0;
            for (word, sets) in self.sets.iter().enumerate() {
                set |= u64::from(sets[self.top]) << (word * WORD);
            }
            set &= self.open;
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

    /// Tests what comes next.
    #[inline(always)]
    fn step<S: Simd, C: WideContainer, const ANY: bool, const FARTHEST: bool>(
        &mut self,
        simd: S,
        tree: &WideTree<C>,
        rays: &[Ray],
    ) {
        let Some((child, set)) = self.next::<S, ANY>(simd) else { return };
        if child.is_leaf() {
            // The next one was asked for with its siblings. Rays that any hit ends rarely come so far.
            if !ANY {
                tree.prefetch_any(self.children[self.top.saturating_sub(2)]);
            }
            self.test_leaf::<S, C, ANY>(simd, tree, child, set, rays);
        } else {
            self.enter::<S, C, ANY, FARTHEST>(simd, tree, child, set);
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
        for block in &tree.blocks[leaf.index()..] {
            for index in bits(set & self.open) {
                let index = index % RAYS;
                let ray = &rays[self.first + index];
                let block_ray = BlockRay::new(simd, &self.rays, index);
                if ANY {
                    let meets = u64::from(block_ray.meets(simd, block, ray, self.t[index])) << index;
                    self.blocked |= meets;
                    self.open &= !meets;
                } else {
                    let nearest = &mut self.nearest[index];
                    block_ray.test(simd, block, ray, nearest);
                    self.t[index] = nearest.t();
                }
            }
            if block.is_last() {
                break;
            }
        }
    }

    #[inline(always)]
    fn enter<S: Simd, C: WideContainer, const ANY: bool, const FARTHEST: bool>(
        &mut self,
        simd: S,
        tree: &WideTree<C>,
        node: Child,
        set: u64,
    ) {
        let node = &tree.nodes[node.index()];
        let nobody = u32x8::splat(simd, 0);
        let mut sets = [nobody; WORDS];
        let mut entries = f32x8::splat(simd, if FARTHEST { -1.0 } else { f32::INFINITY });
        for index in bits(set) {
            let index = index % RAYS;
            let ray = C::prepare(simd, &self.rays, index);
            let (enters, entry) = C::entered(simd, &node.bounds, &ray, self.t[index]);
            for (word, set) in sets.iter_mut().enumerate() {
                *set |= enters.select(u32x8::splat(simd, word_of(1 << index, word)), nobody);
            }
            if FARTHEST {
                entries = enters.select(entry.max(entries), entries);
            } else if !ANY {
                entries = enters.select(entry.min(entries), entries);
            }
        }
        let mut union = sets[0];
        for set in &sets[1..] {
            union |= *set;
        }
        let entered = !union.simd_eq(nobody);
        let above = self.top + entered.to_bitmask().count_ones() as usize;
        let room = self.top % (STACK + 1)..self.top % (STACK + 1) + WIDTH;
        let stacked_children = &mut self.children[room.clone()];
        if ANY && !FARTHEST {
            let children = u32x8::load_array_ref(simd, bytemuck::cast_ref(&node.children)).compress(entered);
            stacked_children.copy_from_slice(bytemuck::cast_slice(children.as_slice()));
            for (stacked, set) in self.sets.iter_mut().zip(&sets) {
                stacked[room.clone()].copy_from_slice(set.compress(entered).as_slice());
            }
        } else {
            let places = places::<S, FARTHEST>(simd, entered, entries);
            let stacked_entries = &mut self.entries[room.clone()];
            for lane in 0..WIDTH {
                let place = places[lane] as usize % WIDTH;
                stacked_children[place] = node.children[lane];
                stacked_entries[place] = entries[lane];
            }
            for (stacked, set) in self.sets.iter_mut().zip(&sets) {
                let stacked = &mut stacked[room.clone()];
                for lane in 0..WIDTH {
                    stacked[places[lane] as usize % WIDTH] = set[lane];
                }
            }
        }
        // The next two; what waits longer is often not needed any more when its turn comes.
        for ahead in 1..=2 {
            tree.prefetch_any(self.children[above.saturating_sub(ahead)]);
        }
        self.top = above;
    }

    /// Traces what is open once more from the root, each ray with a stack that grows.
    #[cold]
    #[inline(never)]
    fn finish_alone<S: Simd, C: WideContainer, Q: Question<RAYS, WORDS>>(
        &mut self,
        simd: S,
        tree: &WideTree<C>,
        rays: &[Ray],
    ) {
        for index in bits(self.open) {
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

/// Where each child that is entered goes among them, so that the one that goes first stands last; one place behind all for
/// the others. Counted, because nobody could predict the branches of a sort.
#[inline(always)]
fn places<S: Simd, const FARTHEST: bool>(simd: S, entered: mask32x8<S>, entries: f32x8<S>) -> [u32; WIDTH] {
    // The lane in the last bits tells equal entries apart.
    let finite = entries.min(f32x8::splat(simd, f32::MAX));
    let lanes = u32x8::from_slice(simd, &[0, 1, 2, 3, 4, 5, 6, 7]);
    let tagged: f32x8<S> = (finite.bitcast::<u32x8<S>>() & !7 | lanes).bitcast();
    let outside = f32x8::splat(simd, if FARTHEST { f32::INFINITY } else { -1.0 });
    let keys = entered.select(tagged, outside);
    let one = u32x8::splat(simd, 1);
    let mut places = u32x8::splat(simd, 0);
    for key in keys.to_array() {
        let key = f32x8::splat(simd, key);
        let is_below = if FARTHEST { key.simd_lt(keys) } else { key.simd_gt(keys) };
        places = is_below.select(places + one, places);
    }
    places.to_array()
}

/// A word of a set.
#[inline(always)]
fn word_of(set: u64, word: usize) -> u32 {
    (set >> (word * WORD)) as u32
}
