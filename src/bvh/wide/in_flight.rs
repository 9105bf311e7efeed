//! Many rays that have little in common and only ask whether anything lies on them: several are under way at once, each a
//! step at a time, so that what one waits for (memory, the chain of dependent instructions from a node to its child) passes
//! with the steps of the others. The steps themselves have few branches that nobody could predict.

#![allow(unsafe_code, reason = "fearless_simd has no instruction that gathers the lanes of a mask")]

use arrayvec::ArrayVec;
use fearless_simd::{Level, Simd};

use super::block::BlockRay;
use super::{Child, WIDTH, WideContainer, WideTree, single};
use crate::bvh::traverse::{Nearest, NoProbe, Probe, TestCounts};
use crate::geometry::{PreparedRay, Ray};

/// Rays under way at once. Found by trial: 8 leave some waiting, 32 bring nothing more.
const IN_FLIGHT: usize = 16;
/// Rays that go alone at first.
const FIRST_RAYS: usize = 32;
/// Nodes that a ray visits on average from which on it pays to have many under way: shorter ones are started and ended
/// faster alone. Found by trial on rooms (3 and 5 nodes) and scans (8 and 11).
const LONG_WAY: u64 = 4;
/// Entries of a ray's stack; rays that need more are traced alone.
const STACK: usize = 128;
/// Lies at the bottom of each stack: the ray has seen everything. No tree has that many blocks.
const DONE: Child = Child(u32::MAX);

/// A ray under way.
struct Slot<S: Simd, C: WideContainer> {
    /// Its place in the list.
    index: usize,
    ray: PreparedRay,
    container: C::Prepared<S>,
    block: BlockRay<S>,
    found: bool,
    current: Child,
    /// The children that wait, in no order.
    stack: [u32; STACK],
    top: usize,
}

/// Slots by what they have to do next, first those at nodes, then those at leaves or done.
struct Lists {
    slots: [[u8; IN_FLIGHT]; 2],
    len: [usize; 2],
}

impl Lists {
    #[inline(always)]
    fn push(&mut self, current: Child, slot: u8) {
        // Without a branch, which would be mispredicted every other time.
        let list = usize::from(current.is_leaf());
        self.slots[list][self.len[list] % IN_FLIGHT] = slot;
        self.len[list] += 1;
    }

    #[inline(always)]
    fn take(&mut self, list: usize) -> ([u8; IN_FLIGHT], usize) {
        (self.slots[list], std::mem::take(&mut self.len[list]))
    }
}

/// Whether anything lies on each of `rays`, into the first elements of `blocked`.
#[inline(always)]
pub(super) fn any_hits<S: Simd, C: WideContainer>(simd: S, tree: &WideTree<C>, rays: &[Ray], blocked: &mut [bool]) {
    // The first rays go alone, and tell how far all go.
    let (first, rest) = rays.split_at(if pays(simd) { FIRST_RAYS.min(rays.len()) } else { rays.len() });
    let (blocked_first, blocked) = blocked.split_at_mut(first.len());
    let mut steps = TestCounts::default();
    trace_alone(simd, tree, first, blocked_first, &mut steps);
    if steps.containers < LONG_WAY * first.len() as u64 {
        return trace_alone(simd, tree, rest, blocked, &mut NoProbe);
    }
    let rays = rest;
    let Some(root) = tree.root else { return blocked[..rays.len()].fill(false) };
    let mut next = 0;
    let mut slots = ArrayVec::<Slot<S, C>, IN_FLIGHT>::new();
    let mut lists = Lists { slots: [[0; IN_FLIGHT]; 2], len: [0; 2] };
    while slots.len() < IN_FLIGHT
        && let Some((index, ray)) = next_ray(rays, &mut next, blocked)
    {
        lists.push(root, slots.len() as u8);
        slots.push(Slot {
            index,
            container: C::prepare(simd, &ray),
            block: BlockRay::new(simd, &ray.ray),
            ray,
            found: false,
            current: root,
            stack: [DONE.0; STACK],
            top: 1,
        });
    }
    while lists.len != [0; 2] {
        let (at_nodes, count) = lists.take(0);
        for &number in &at_nodes[..count] {
            let Some(slot) = slots.get_mut(usize::from(number)) else { continue };
            let node = &tree.nodes[slot.current.index()];
            let (hits, _) = C::entries(simd, &node.bounds, &slot.container, slot.ray.ray.t_max);
            if let Some(room) = slot.stack[slot.top..].first_chunk_mut() {
                *room = gathered(simd, bytemuck::cast_ref(&node.children), hits);
                slot.top += hits.count_ones() as usize;
                slot.pop(tree);
            } else {
                slot.trace_alone(simd, tree);
            }
            lists.push(slot.current, number);
        }
        let (at_leaves, count) = lists.take(1);
        for &number in &at_leaves[..count] {
            let Some(slot) = slots.get_mut(usize::from(number)) else { continue };
            if slot.current == DONE {
                blocked[slot.index] = slot.found;
                let Some((index, ray)) = next_ray(rays, &mut next, blocked) else { continue };
                slot.index = index;
                slot.container = C::prepare(simd, &ray);
                slot.block = BlockRay::new(simd, &ray.ray);
                slot.ray = ray;
                slot.found = false;
                slot.current = root;
                slot.top = 1;
            } else {
                let block = &tree.blocks[slot.current.index()];
                let found = &mut slot.found;
                slot.block.test(
                    simd,
                    block,
                    &slot.ray,
                    slot.ray.ray.t_max,
                    #[inline(always)]
                    |_, _| *found = true,
                );
                if slot.found {
                    slot.current = DONE;
                } else if block.is_last() {
                    slot.pop(tree);
                } else {
                    slot.current = Child(slot.current.0 + 1);
                }
            }
            lists.push(slot.current, number);
        }
    }
}

/// One ray after the other.
#[inline(always)]
fn trace_alone<S: Simd, C: WideContainer, P: Probe>(
    simd: S,
    tree: &WideTree<C>,
    rays: &[Ray],
    blocked: &mut [bool],
    probe: &mut P,
) {
    for (blocked, ray) in blocked.iter_mut().zip(rays) {
        *blocked = single::any_hit(simd, tree, ray, probe);
    }
}

/// The next ray that can hit something; nothing blocks those that cannot.
#[inline(always)]
fn next_ray(rays: &[Ray], next: &mut usize, blocked: &mut [bool]) -> Option<(usize, PreparedRay)> {
    loop {
        let (index, ray) = (*next, PreparedRay::new(*rays.get(*next)?));
        *next += 1;
        if ray.can_hit() {
            return Some((index, ray));
        }
        blocked[index] = false;
    }
}

impl<S: Simd, C: WideContainer> Slot<S, C> {
    /// Goes on with what waits on top of the stack, and has it fetched.
    #[inline(always)]
    fn pop(&mut self, tree: &WideTree<C>) {
        self.top -= 1;
        self.current = Child(self.stack[self.top % STACK]);
        tree.prefetch(self.current);
    }

    /// Once more from the root, with a stack that grows.
    #[cold]
    fn trace_alone(&mut self, simd: S, tree: &WideTree<C>) {
        let mut nearest = Nearest::new(self.ray.ray.t_max);
        single::walk::<S, C, _, true>(simd, tree, &self.ray, &mut nearest, &mut NoProbe);
        self.found = nearest.found();
        self.current = DONE;
    }
}

/// Whether [`gathered`] is fast. Without that, rays one by one have been as fast or faster.
#[inline(always)]
fn pays<S: Simd>(simd: S) -> bool {
    match simd.level() {
        #[cfg(target_arch = "x86_64")]
        Level::Avx2(_) | Level::Avx512(_) => true,
        _ => false,
    }
}

/// For each set of lanes their numbers, first to last.
#[cfg(target_arch = "x86_64")]
static LANES: [[u8; WIDTH]; 256] = {
    let mut lanes = [[0; WIDTH]; 256];
    let mut set = 0;
    while set < 256 {
        let (mut lane, mut count) = (0, 0);
        while lane < WIDTH {
            if set >> lane & 1 != 0 {
                lanes[set][count] = lane as u8;
                count += 1;
            }
            lane += 1;
        }
        set += 1;
    }
    lanes
};

/// The values of the lanes in `set`, one after the other; anything behind them.
#[inline(always)]
fn gathered<S: Simd>(simd: S, values: &[u32; WIDTH], set: u32) -> [u32; WIDTH] {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{
            _mm_loadl_epi64, _mm256_cvtepu8_epi32, _mm256_loadu_si256, _mm256_maskz_compress_epi32,
            _mm256_permutevar8x32_epi32,
        };
        if let Level::Avx512(_) = simd.level() {
            // SAFETY: the level says that the machine has AVX-512F and VL; the load reads the eight values.
            return bytemuck::cast(unsafe {
                _mm256_maskz_compress_epi32(set as u8, _mm256_loadu_si256(values.as_ptr().cast()))
            });
        }
        if let Level::Avx2(_) = simd.level() {
            let lanes = &LANES[set as usize % 256];
            // SAFETY: the level says that the machine has AVX2; the loads read the eight lanes and the eight values.
            return bytemuck::cast(unsafe {
                let lanes = _mm256_cvtepu8_epi32(_mm_loadl_epi64(lanes.as_ptr().cast()));
                _mm256_permutevar8x32_epi32(_mm256_loadu_si256(values.as_ptr().cast()), lanes)
            });
        }
    }
    let _ = simd;
    let (mut gathered, mut rest) = ([0; WIDTH], set);
    for place in &mut gathered {
        if rest == 0 {
            break;
        }
        *place = values[rest.trailing_zeros() as usize % WIDTH];
        rest &= rest - 1;
    }
    gathered
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_level_gathers_the_lanes_of_every_set() {
        let values = [10, 11, 12, 13, 14, 15, 16, 17];
        for level in crate::bvh::SimdLevel::ALL.map(crate::bvh::SimdLevel::level) {
            for set in 0..256 {
                let wanted: Vec<u32> = (0..8).filter(|lane| set >> lane & 1 != 0).map(|lane| 10 + lane).collect();
                let gathered = fearless_simd::dispatch!(level, simd => gathered(simd, &values, set));
                assert_eq!(gathered[..wanted.len()], wanted[..], "{set:b}");
            }
        }
    }
}
