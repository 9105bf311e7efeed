//! Rays that have little in common, in streams: a node is tested against all rays that reach it, one after the other, its
//! eight children side by side, and each child goes on with those that enter it (after Barringer, Akenine-Möller: *Dynamic
//! Ray Stream Traversal*, 2014). So what a visit costs apart from the tests is shared, above all the wait for memory. Several
//! streams take turns, a step each, so that what one has asked for arrives while the others work.
//!
//! Where any hit will do and most rays are blocked, as in a room, the farthest child goes first: near their origin rays pass
//! what they left without hitting it. In the conference room ambient occlusion rays visit 1.7 nodes by that instead of 3.0, in
//! Sponza 2.5 instead of 5.0. Rays that nothing blocks see the same nodes in any order.

use fearless_simd::{Select, Simd, SimdBase, SimdMask, f32x8, u32x8};

use super::block::BlockRay;
use super::packed::{PACKED, PackedRay, PackedRays};
use super::{Child, WIDTH, WideContainer, WideTree, single};
use crate::bvh::traverse::{Nearest, NoProbe};
use crate::geometry::{Hit, Ray};

/// Rays of a stream: one bit each in a set.
const RAYS: usize = 32;
/// Streams that take turns. Found by trial: more hide more of the wait for memory, until their own rays leave the cache.
const STREAMS: usize = 4;
/// Entries of a stack; the rays of a stream that needs more are traced one by one.
const STACK: usize = 120;

/// What is asked of each ray.
trait Question {
    type Answer: Clone;
    /// Whether any hit will do.
    const ANY: bool;
    /// The answer for rays that can hit nothing.
    const NOTHING: Self::Answer;
    fn answer(found: &Nearest) -> Self::Answer;
    /// Traces a ray by itself.
    fn alone<S: Simd, C: WideContainer>(simd: S, tree: &WideTree<C>, ray: &Ray) -> Nearest;
}

/// Whether anything lies on a ray.
struct Any;

impl Question for Any {
    type Answer = bool;
    const ANY: bool = true;
    const NOTHING: bool = false;

    #[inline(always)]
    fn answer(found: &Nearest) -> bool {
        found.found()
    }

    #[inline(always)]
    fn alone<S: Simd, C: WideContainer>(simd: S, tree: &WideTree<C>, ray: &Ray) -> Nearest {
        single::nearest::<S, C, NoProbe, true>(simd, tree, ray, &mut NoProbe)
    }
}

/// A ray's nearest hit.
struct Closest;

impl Question for Closest {
    type Answer = Option<Hit>;
    const ANY: bool = false;
    const NOTHING: Option<Hit> = None;

    #[inline(always)]
    fn answer(found: &Nearest) -> Option<Hit> {
        found.hit()
    }

    #[inline(always)]
    fn alone<S: Simd, C: WideContainer>(simd: S, tree: &WideTree<C>, ray: &Ray) -> Nearest {
        single::nearest::<S, C, NoProbe, false>(simd, tree, ray, &mut NoProbe)
    }
}

/// Whether anything lies on each of `rays`, into the first elements of `blocked`.
#[inline(always)]
pub(super) fn any_hits<S: Simd, C: WideContainer>(simd: S, tree: &WideTree<C>, rays: &[Ray], blocked: &mut [bool]) {
    trace::<S, C, Any>(simd, tree, rays, blocked);
}

/// The nearest hits of `rays`, into the first elements of `hits`.
#[inline(always)]
pub(super) fn closest_hits<S: Simd, C: WideContainer>(
    simd: S,
    tree: &WideTree<C>,
    rays: &[Ray],
    hits: &mut [Option<Hit>],
) {
    trace::<S, C, Closest>(simd, tree, rays, hits);
}

#[inline(always)]
fn trace<S: Simd, C: WideContainer, Q: Question>(simd: S, tree: &WideTree<C>, rays: &[Ray], answers: &mut [Q::Answer]) {
    let Some(root) = tree.root else { return answers[..rays.len()].fill(Q::NOTHING) };
    #[allow(clippy::large_stack_arrays, reason = "26 KiB, a part of the smallest stack of any thread")]
    let mut streams = [const { Stream::EMPTY }; STREAMS];
    let mut next = 0;
    // Most rays are taken to be blocked until it is known.
    let (mut traced, mut blocked) = (0, 0);
    loop {
        let mut is_busy = false;
        for stream in &mut streams {
            if stream.top == 0 {
                for (answer, nearest) in answers[stream.first..][..stream.count].iter_mut().zip(&stream.nearest) {
                    *answer = Q::answer(nearest);
                }
                (traced, blocked) = (traced + stream.count, blocked + stream.blocked());
                let coming = &rays[next..rays.len().min(next + RAYS)];
                stream.start(simd, root, next, coming);
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
struct Stream {
    /// The first ray's place in the list, and how many there are.
    first: usize,
    count: usize,
    rays: [PackedRay; RAYS],
    /// How far each ray looks.
    t: [f32; RAYS],
    nearest: [Nearest; RAYS],
    /// The rays that still look.
    open: u32,
    /// What waits, the next one last, with room for all children of a node: where, for which rays, and how far away it is for
    /// the first of them to enter it, or the last one where the farthest goes first.
    top: usize,
    children: [Child; STACK + WIDTH],
    sets: [u32; STACK + WIDTH],
    entries: [f32; STACK + WIDTH],
}

impl Stream {
    const EMPTY: Self = Self {
        first: 0,
        count: 0,
        rays: [PackedRay::EMPTY; RAYS],
        t: [0.0; RAYS],
        nearest: [Nearest::NOTHING; RAYS],
        open: 0,
        top: 0,
        children: [Child::ROOT; STACK + WIDTH],
        sets: [0; STACK + WIDTH],
        entries: [0.0; STACK + WIDTH],
    };

    /// Takes up to 32 rays, of which the first is number `first`.
    #[inline(always)]
    fn start<S: Simd>(&mut self, simd: S, root: Child, first: usize, rays: &[Ray]) {
        (self.first, self.count) = (first, rays.len());
        self.open = 0;
        for (group, rays) in rays.chunks(PACKED).enumerate() {
            let packed = PackedRays::new(simd, rays);
            self.open |= packed.able << (group * PACKED);
            for (lane, ray) in rays.iter().enumerate() {
                let at = (group * PACKED + lane) % RAYS;
                self.rays[at] = packed.get(lane, ray);
                self.t[at] = ray.t_max;
                self.nearest[at] = Nearest::new(ray.t_max);
            }
        }
        (self.children[0], self.sets[0], self.entries[0]) = (root, self.open, 0.0);
        self.top = usize::from(self.open != 0);
    }

    /// Rays that have found something.
    #[inline(always)]
    fn blocked(&self) -> usize {
        self.nearest[..self.count].iter().filter(|nearest| nearest.found()).count()
    }

    /// What comes next, with the rays that still need it; `None` where the stream is done.
    #[inline(always)]
    fn next<S: Simd, const ANY: bool>(&mut self, simd: S) -> Option<(Child, u32)> {
        while self.top > 0 {
            self.top -= 1;
            let mut set = self.sets[self.top] & self.open;
            if !ANY {
                let entry = f32x8::splat(simd, self.entries[self.top]);
                let mut near = 0;
                for (group, t) in self.t.chunks_exact(8).enumerate() {
                    near |= (f32x8::from_slice(simd, t).simd_ge(entry).to_bitmask() as u32) << (8 * group);
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
        set: u32,
        rays: &[Ray],
    ) {
        for block in &tree.blocks[leaf.index()..] {
            for index in bits(set & self.open) {
                let (ray, whole_ray) = (&self.rays[index], &rays[self.first + index]);
                let block_ray = BlockRay::new(simd, ray);
                let nearest = &mut self.nearest[index];
                if ANY {
                    if block_ray.meets(simd, block, ray, whole_ray) {
                        *nearest = Nearest::SOMETHING;
                        self.open &= !(1 << index);
                    }
                } else {
                    block_ray.test(simd, block, ray, whole_ray, nearest);
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
        set: u32,
    ) {
        let node = &tree.nodes[node.index()];
        let nobody = u32x8::splat(simd, 0);
        let mut sets = nobody;
        let mut entries = f32x8::splat(simd, if FARTHEST { -1.0 } else { f32::INFINITY });
        for index in bits(set) {
            let ray = C::prepare(simd, &self.rays[index]);
            let (enters, entry) = C::entered(simd, &node.bounds, &ray, self.t[index]);
            sets |= enters.select(u32x8::splat(simd, 1 << index), nobody);
            if FARTHEST {
                entries = enters.select(entry.max(entries), entries);
            } else if !ANY {
                entries = enters.select(entry.min(entries), entries);
            }
        }
        let entered = !sets.simd_eq(nobody);
        let new = self.top..self.top + entered.to_bitmask().count_ones() as usize;
        let room = self.top % (STACK + 1)..self.top % (STACK + 1) + WIDTH;
        let children = u32x8::load_array_ref(simd, bytemuck::cast_ref(&node.children)).compress(entered);
        self.children[room.clone()].copy_from_slice(bytemuck::cast_slice(children.as_slice()));
        self.sets[room.clone()].copy_from_slice(sets.compress(entered).as_slice());
        if !ANY || FARTHEST {
            self.entries[room].copy_from_slice(entries.compress(entered).as_slice());
            self.sort::<FARTHEST>(new.clone());
        }
        // The next two; what waits longer is often not needed any more when its turn comes.
        for ahead in 1..=2 {
            tree.prefetch_any(self.children[new.end.saturating_sub(ahead)]);
        }
        self.top = new.end;
    }

    /// Puts what goes first last.
    #[inline(always)]
    fn sort<const FARTHEST: bool>(&mut self, range: std::ops::Range<usize>) {
        for at in range.start + 1..range.end {
            let mut at = at;
            while at > range.start {
                let [below, this] = [self.entries[at - 1], self.entries[at]];
                if if FARTHEST { below <= this } else { below >= this } {
                    break;
                }
                self.entries.swap(at - 1, at);
                self.children.swap(at - 1, at);
                self.sets.swap(at - 1, at);
                at -= 1;
            }
        }
    }

    /// Traces what is open once more from the root, each ray with a stack that grows.
    #[cold]
    #[inline(never)]
    fn finish_alone<S: Simd, C: WideContainer, Q: Question>(&mut self, simd: S, tree: &WideTree<C>, rays: &[Ray]) {
        for index in bits(self.open) {
            let ray = &rays[self.first + index];
            self.nearest[index] = simd.vectorize(
                #[inline(always)]
                || Q::alone(simd, tree, ray),
            );
        }
        self.top = 0;
    }
}

/// The numbers of the bits that are set, lowest first.
#[inline(always)]
fn bits(mut set: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(
        #[inline(always)]
        move || {
            let bit = (set != 0).then_some(set.trailing_zeros() as usize % RAYS);
            set &= set.wrapping_sub(1);
            bit
        },
    )
}
