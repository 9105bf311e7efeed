//! Packets through a tree over copies and those of their meshes: the directions of all rays are carried into a mesh at once, a block of its
//! triangles is placed in the world once for all of them.

use std::ops::ControlFlow;

use fearless_simd::{Level, Simd, SimdBase, SimdMask, f32x16};
use glam::Vec3;

use crate::geometry::{Aabb, Hit, LARGEST_DIRECTION, Placement, Ray};
use crate::kernel::bits::bits;
use crate::kernel::each;
use crate::kernel::simd::dispatch;
use crate::tree::traverse::NoProbe;
use crate::wide::block::TriangleBlock;
use crate::wide::layout::BLOCK;
use crate::wide::trace::beam::{Beam, GROUP, GROUPS};
use crate::wide::trace::copies::{Copy, CopyOf, WorldRay, each_hit, placed};
use crate::wide::trace::packet::{Packet, PacketHits, PacketRays, Walk};
use crate::wide::trace::packet_tree::BoxTree;
use crate::wide::tree::WideTree;

/// Traces `rays` as a packet through the copies that `copy` has for the items of `top`: calls `write` with the index, copy and nearest hit
/// of each ray that hits one. `false`, without a call, if they are not coherent enough.
pub(crate) fn closest_hits(
    level: Level,
    top: &WideTree<Aabb>,
    copy: CopyOf<'_, '_>,
    rays: &[Ray],
    write: &mut dyn FnMut(usize, u32, Hit),
) -> bool {
    dispatch!(level, simd => {
        let mut packet = Packet::<Aabb>::empty();
        if !packet.set(simd, rays) {
            return false;
        }
        trace(simd, &mut packet, top, copy, rays);
        for index in 0..rays.len() {
            if let Some(hit) = packet.hits.hit(index) {
                write(index, packet.hits.hit_copy(index), hit);
            }
        }
        true
    })
}

#[inline(always)]
fn trace<S: Simd>(simd: S, packet: &mut Packet<Aabb>, top: &WideTree<Aabb>, copy: CopyOf<'_, '_>, rays: &[Ray]) {
    let Some(start) = top.root else { return };
    let Packet { all_groups, rays: prepared, hits, .. } = packet;
    let world = &prepared.beam;
    let walk = Walk::<Aabb> { start, groups: *all_groups, beam: world, frustum: &() };
    let mut beam = Beam { inverse: [[[0.0; GROUP]; 3]; GROUPS], ..*world };
    walk.each_leaf(
        simd,
        BoxTree::Aabb(top),
        hits,
        #[inline(always)]
        |hits, leaf, active| {
            for block in top.leaves.blocks(leaf) {
                for lane in 0..block.count() {
                    let groups = entering_groups(simd, &walk, block, lane, active, hits);
                    if groups == 0 {
                        continue;
                    }
                    if let Some((index, copy)) = copy(block.primitive_index(lane)) {
                        hits.copy = index;
                        if carry(simd, prepared, copy.place, groups, &mut beam) {
                            trace_copy(simd, copy, prepared, &beam, groups, rays, hits);
                        } else {
                            trace_one_by_one(simd, copy, groups, rays, hits);
                        }
                    }
                }
            }
        },
    );
}

/// The groups out of `active` in which any ray enters the box of an item.
#[inline(always)]
fn entering_groups<S: Simd>(
    simd: S,
    walk: &Walk<'_, Aabb>,
    block: TriangleBlock<'_>,
    lane: usize,
    active: u32,
    hits: &PacketHits,
) -> u32 {
    let Aabb { min, max } = block.triangle(lane).bounds();
    let beam = walk.beam;
    let planes = [min, max];
    let offset = |axis: usize, side: usize| f32x16::splat(simd, planes[side & 1][axis] - beam.origin[axis]);
    let near = each!(axis => offset(axis, beam.near[axis]));
    let far = each!(axis => offset(axis, beam.near[axis] ^ 1));
    walk.entering_groups(simd, &[near, far], active, hits)
}

/// Carries the directions of `groups` into the coordinates of a mesh; `false` if they are not coherent there.
#[inline(always)]
fn carry<S: Simd>(simd: S, rays: &PacketRays, place: &Placement, groups: u32, beam: &mut Beam) -> bool {
    let Some(carried) = place.carry_point(Vec3::from_array(rays.beam.origin)) else { return false };
    let factors = each!(axis => each!(from => f32x16::splat(simd, place.inverse[axis][from])));
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    let mut lowest = [f32x16::splat(simd, f32::INFINITY); 3];
    let mut highest = [f32x16::splat(simd, f32::NEG_INFINITY); 3];
    let mut largest = zero;
    for group in bits(u64::from(groups)) {
        let group = group % GROUPS;
        let direction = each!(axis => f32x16::load_array_ref(simd, &rays.directions[group][axis]));
        for axis in 0..3 {
            let [x, y, z] = factors[axis];
            let along = direction[0] * x + direction[1] * y + direction[2] * z;
            let inverse = one / along;
            largest = largest.max(along.abs());
            lowest[axis] = lowest[axis].min(inverse);
            highest[axis] = highest[axis].max(inverse);
            beam.inverse[group][axis] = inverse.to_array();
        }
    }
    for axis in 0..3 {
        let [low, high] = [lowest[axis].reduce_min(), highest[axis].reduce_max()];
        // One sign, and none of them zero, infinite or NaN.
        if !(low > 0.0 && high <= f32::MAX || high < 0.0 && low >= f32::MIN) {
            return false;
        }
        let is_negative = high < 0.0;
        beam.range[axis] = [low, high];
        beam.near[axis] = usize::from(is_negative);
        // Towards the near planes at the entry, away from the far ones at the exit.
        let pad = if is_negative { -carried.widening[axis] } else { carried.widening[axis] };
        let point = carried.point[axis];
        (beam.plane_origins[0][axis], beam.plane_origins[1][axis]) = (point + pad, point - pad);
    }
    largest.simd_le(f32x16::splat(simd, LARGEST_DIRECTION)).all_true()
}

/// Traces `groups` through the tree of a mesh, in whose coordinates `beam` has them.
#[inline(always)]
fn trace_copy<S: Simd>(
    simd: S,
    copy: Copy<'_>,
    prepared: &PacketRays,
    beam: &Beam,
    groups: u32,
    rays: &[Ray],
    hits: &mut PacketHits,
) {
    let walk = Walk::<Aabb> { start: copy.start, groups, beam, frustum: &() };
    walk.each_leaf(
        simd,
        BoxTree::Aabb(copy.tree),
        hits,
        #[inline(always)]
        |hits, leaf, active| {
            for block in copy.tree.leaves.blocks(leaf) {
                let window = placed(simd, block, copy.place);
                let block = TriangleBlock::<BLOCK> { window: &window, count: block.count };
                prepared.test_block(simd, block, active, rays, hits);
            }
        },
    );
}

/// Traces the rays of `groups` through a copy each by itself.
#[cold]
#[inline(never)]
fn trace_one_by_one<S: Simd>(simd: S, copy: Copy<'_>, groups: u32, rays: &[Ray], hits: &mut PacketHits) {
    simd.vectorize(
        #[inline(always)]
        || {
            for group in bits(u64::from(groups)) {
                let group = group % GROUPS;
                for lane in 0..GROUP {
                    let ray = &rays[(group * GROUP + lane).min(rays.len() - 1)];
                    let Some(world) = WorldRay::new(simd, ray) else { continue };
                    let t_max = hits.t[group][lane];
                    each_hit(simd, copy, &world, t_max, &mut NoProbe, &mut |hit, primitive_index| {
                        hits.offer(group, lane, hit, primitive_index);
                        ControlFlow::Continue(hits.t[group][lane])
                    });
                }
                hits.update_group(group);
            }
        },
    );
}
