//! Streams of incoherent rays through a tree over copies and those of their meshes: the rays that reach a copy are carried into its mesh
//! together and walk the mesh's tree as a stream of their own. A block of its triangles is placed in the world once for all of them.

use std::ops::ControlFlow;

use fearless_simd::{Level, Select, Simd, SimdBase, SimdMask, f32x8};

use crate::geometry::{Aabb, Hit, LEAST_WIDENING, Placement, Ray};
use crate::kernel::bits::bits;
use crate::kernel::each;
use crate::kernel::simd::dispatch;
use crate::tree::traverse::NoProbe;
use crate::wide::block::{BlockRay, TriangleBlock};
use crate::wide::child::Child;
use crate::wide::layout::BLOCK;
use crate::wide::ray_lanes::{RAY_LANES, RayLanes, transposed};
use crate::wide::trace::copies::{Copy, CopyOf, HitOfCopy, WorldRay, each_hit, placed};
use crate::wide::trace::stream::{STACK, Stream};
use crate::wide::tree::WideTree;

/// For each of `rays` whether anything lies on it, written to the first elements of `blocked`, through the copies that `copy` has for the
/// items of `top`. Returns the indices of the rays that it leaves out, as they need a stack that grows.
pub(crate) fn any_hits(
    level: Level,
    top: &WideTree<Aabb>,
    copy: CopyOf<'_, '_>,
    rays: &[Ray],
    blocked: &mut [bool],
) -> Vec<usize> {
    dispatch!(level, simd => {
        trace::<_, true, 64, 2>(simd, top, copy, rays, &mut |index, levels, at| {
            blocked[index] = levels.above.blocked >> at & 1 != 0;
        })
    })
}

/// Calls `write` with the index of each of `rays`, and with the copy and the nearest hit of one that hits any. Returns the indices of the rays
/// that it leaves out.
pub(crate) fn closest_hits(
    level: Level,
    top: &WideTree<Aabb>,
    copy: CopyOf<'_, '_>,
    rays: &[Ray],
    write: &mut dyn FnMut(usize, Option<(u32, Hit)>),
) -> Vec<usize> {
    dispatch!(level, simd => {
        trace::<_, false, 64, 2>(simd, top, copy, rays, &mut |index, levels, at| {
            write(index, levels.above.nearest[at].hit().map(|hit| (levels.hit_copies[at], hit)));
        })
    })
}

/// Streams through the tree over the copies and through that of a mesh.
struct Levels<const RAYS: usize, const WORDS: usize> {
    above: Stream<RAYS, WORDS>,
    below: Stream<RAYS, WORDS>,
    /// The index above of each ray below.
    indices: [u8; RAYS],
    /// For closest-hit queries the copy that each ray above has hit.
    hit_copies: [u32; RAYS],
}

/// Traces `rays` and calls `finish` with the index of each, and its index in the stream above.
#[inline(always)]
fn trace<S: Simd, const ANY: bool, const RAYS: usize, const WORDS: usize>(
    simd: S,
    top: &WideTree<Aabb>,
    copy: CopyOf<'_, '_>,
    rays: &[Ray],
    finish: &mut dyn FnMut(usize, &Levels<RAYS, WORDS>, usize),
) -> Vec<usize> {
    #[allow(clippy::large_stack_arrays, reason = "a part of the smallest stack of any thread")]
    let mut levels = Levels { above: Stream::EMPTY, below: Stream::EMPTY, indices: [0; RAYS], hit_copies: [0; RAYS] };
    let addresses = top.addresses();
    let mut left_out = Vec::new();
    for (chunk, rays) in rays.chunks(RAYS).enumerate() {
        let first = chunk * RAYS;
        // Without copies nothing is hit.
        if let Some(root) = top.root {
            levels.above.start::<S, Aabb, ANY>(simd, root, 0, rays);
        }
        while let Some((child, set)) = levels.above.next::<S, ANY>(simd) {
            if levels.above.top > STACK {
                left_out.extend(bits(levels.above.active).map(|index| first + index));
                levels.above.active = 0;
            } else if child.is_leaf() {
                levels.visit_items::<S, ANY>(simd, top, copy, child, set, rays);
            } else {
                levels.above.enter::<S, Aabb, ANY>(simd, top, &addresses, child, set);
            }
        }
        for index in 0..rays.len() {
            finish(first + index, &levels, index);
        }
    }
    left_out
}

impl<const RAYS: usize, const WORDS: usize> Levels<RAYS, WORDS> {
    /// Traces the rays of `set` through the copies in a leaf of the tree above whose boxes they enter.
    #[inline(always)]
    fn visit_items<S: Simd, const ANY: bool>(
        &mut self,
        simd: S,
        top: &WideTree<Aabb>,
        copy: CopyOf<'_, '_>,
        leaf: Child,
        set: u64,
        rays: &[Ray],
    ) {
        for block in top.leaves.blocks(leaf) {
            let mut sets = [0; BLOCK];
            for index in bits(set & self.above.active) {
                let index = index % RAYS;
                let ray = BlockRay::new(&self.above.rays.triangles, index);
                let (entered, _) = ray.entered(simd, block, self.above.t[index]);
                for (lane, set) in sets.iter_mut().enumerate() {
                    *set |= u64::from(entered >> lane & 1) << index;
                }
            }
            for lane in 0..block.count() {
                let set = sets[lane % BLOCK] & self.above.active;
                if set != 0
                    && let Some((index, copy)) = copy(block.primitive_index(lane))
                {
                    self.trace_copy::<S, ANY>(simd, index, copy, set, rays);
                }
            }
        }
    }

    /// Traces the rays of `set` through a copy.
    #[inline(always)]
    fn trace_copy<S: Simd, const ANY: bool>(&mut self, simd: S, index: u32, copy: Copy<'_>, set: u64, rays: &[Ray]) {
        let not_carried = self.carry(simd, copy, set, rays);
        let addresses = copy.tree.addresses();
        let mut single = not_carried;
        self.below.start_at(copy.start);
        while let Some((child, set)) = self.below.next::<S, ANY>(simd) {
            if self.below.top > STACK {
                single |=
                    bits(self.below.active).map(|at| 1 << self.indices[at % RAYS]).fold(0, |all, bit: u64| all | bit);
                self.below.active = 0;
            } else if child.is_leaf() {
                self.visit_triangles::<S, ANY>(simd, index, copy, child, set, rays);
            } else {
                self.below.enter::<S, Aabb, ANY>(simd, copy.tree, &addresses, child, set);
            }
        }
        if single != 0 {
            self.trace_one_by_one::<S, ANY>(simd, index, copy, single, rays);
        }
    }

    /// Carries the rays of `set` into the coordinates of a mesh. Returns those for which single precision does not do.
    #[inline(always)]
    fn carry<S: Simd>(&mut self, simd: S, copy: Copy<'_>, set: u64, rays: &[Ray]) -> u64 {
        let (mut remaining, mut count, mut not_carried) = (set, 0, 0);
        self.below.active = 0;
        while remaining != 0 {
            let mut group = [rays[0]; RAY_LANES];
            let mut size = 0;
            while remaining != 0 && size < RAY_LANES {
                let index = remaining.trailing_zeros() as usize % RAYS;
                remaining &= remaining - 1;
                group[size] = rays[index];
                self.indices[(count + size) % RAYS] = index as u8;
                self.below.t[(count + size) % RAYS] = self.above.t[index];
                size += 1;
            }
            let able = carry_group(simd, copy.place, &group, &mut self.below.rays, count % RAYS) & !(u32::MAX << size);
            self.below.active |= u64::from(able) << count;
            for lane in bits(u64::from(!able & !(u32::MAX << size))) {
                not_carried |= 1 << self.indices[(count + lane) % RAYS];
            }
            count += size;
        }
        not_carried
    }

    /// Tests the triangles of a leaf in the world.
    #[inline(always)]
    fn visit_triangles<S: Simd, const ANY: bool>(
        &mut self,
        simd: S,
        index: u32,
        copy: Copy<'_>,
        leaf: Child,
        set: u64,
        rays: &[Ray],
    ) {
        for block in copy.tree.leaves.blocks(leaf) {
            let set = set & self.below.active;
            if set == 0 {
                return;
            }
            let window = placed(simd, block, copy.place);
            let block = TriangleBlock::<BLOCK> { window: &window, count: block.count };
            for at in bits(set) {
                let at = at % RAYS;
                let ray_index = usize::from(self.indices[at]) % RAYS;
                let (ray, t_max) = (&rays[ray_index], self.below.t[at]);
                let block_ray = BlockRay::new(&self.above.rays.triangles, ray_index);
                if ANY {
                    let meets = u64::from(block_ray.any_hit(simd, block, ray, t_max));
                    self.below.active &= !(meets << at);
                    self.block(meets << ray_index);
                } else {
                    let mut hit = self.hit(ray_index);
                    block_ray.each_hit(simd, block, ray, t_max, |found, primitive_index| {
                        hit.offer(index, found, primitive_index);
                    });
                    self.set_hit(ray_index, hit);
                    self.below.t[at] = self.above.t[ray_index];
                }
            }
        }
    }

    /// Marks rays as blocked.
    #[inline(always)]
    fn block(&mut self, rays: u64) {
        self.above.blocked |= rays;
        self.above.active &= !rays;
    }

    /// The nearest hit of a ray so far.
    #[inline(always)]
    fn hit(&self, ray: usize) -> HitOfCopy {
        HitOfCopy { nearest: self.above.nearest[ray], copy: self.hit_copies[ray] }
    }

    #[inline(always)]
    fn set_hit(&mut self, ray: usize, HitOfCopy { nearest, copy }: HitOfCopy) {
        (self.above.nearest[ray], self.above.t[ray], self.hit_copies[ray]) = (nearest, nearest.t(), copy);
    }

    /// Traces the rays of `set` through a copy each by itself.
    #[cold]
    #[inline(never)]
    fn trace_one_by_one<S: Simd, const ANY: bool>(
        &mut self,
        simd: S,
        index: u32,
        copy: Copy<'_>,
        set: u64,
        rays: &[Ray],
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                for ray in bits(set) {
                    let Some(world) = WorldRay::new(simd, &rays[ray]) else { continue };
                    let t_max = self.above.t[ray];
                    each_hit(simd, copy, &world, t_max, &mut NoProbe, &mut |hit, primitive_index| {
                        if ANY {
                            self.block(1 << ray);
                            return ControlFlow::Break(());
                        }
                        let mut nearest = self.hit(ray);
                        nearest.offer(index, hit, primitive_index);
                        self.set_hit(ray, nearest);
                        ControlFlow::Continue(self.above.t[ray])
                    });
                }
            },
        );
    }
}

/// Carries eight rays into the coordinates of a mesh and stores them from index `first` on. Returns a mask of those whose numbers stay
/// within the range of single precision.
#[inline(always)]
fn carry_group<S: Simd, const RAYS: usize>(
    simd: S,
    place: &Placement,
    group: &[Ray; RAY_LANES],
    lanes: &mut RayLanes<RAYS>,
    first: usize,
) -> u32 {
    let splat = |value| f32x8::splat(simd, value);
    let [ox, oy, oz, dx, dy, dz, t_min, t_max] = transposed(simd, group);
    let reach = ox.abs().max(oy.abs()).max(oz.abs()) + splat(place.reach);
    let from_origin = [ox, oy, oz];
    let relative = each!(axis => from_origin[axis] - splat(place.rows[axis][3]));
    let (mut origin, mut direction) = ([splat(0.0); 3], [splat(0.0); 3]);
    for axis in 0..3 {
        let [x, y, z] = each!(from => splat(place.inverse[axis][from]));
        origin[axis] = relative[0] * x + relative[1] * y + relative[2] * z;
        direction[axis] = dx * x + dy * y + dz * z;
    }
    let widening = each!(axis => reach * splat(place.widening[axis]));
    let able = lanes.set_slabs(
        simd,
        first,
        [origin, direction],
        [t_min, t_max],
        // Towards the near planes at the entry, away from the far ones at the exit.
        #[inline(always)]
        |axis, pad, is_negative| pad + is_negative.select(-widening[axis], widening[axis]),
    );
    let narrowest = widening[0].min(widening[1]).min(widening[2]);
    (able & narrowest.simd_ge(splat(LEAST_WIDENING))).to_bitmask() as u32
}
