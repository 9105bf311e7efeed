//! A single ray through a tree over copies and those of their meshes, in one function for both.

use std::ops::ControlFlow;

use fearless_simd::Simd;

use crate::geometry::{Aabb, Ray};
use crate::kernel::bits::bits;
use crate::tree::traverse::NoProbe;
use crate::wide::block::{BlockRay, TriangleBlock};
use crate::wide::fused_box::FusedBoxRay;
use crate::wide::layout::BLOCK;
use crate::wide::trace::copies::{Copy, HitOfCopy, WorldRay, each_hit, placed};
use crate::wide::trace::walk::{Walk, each_leaf};
use crate::wide::tree::WideTree;

/// The nearest hit of `ray` with the copies that `copy_of` has for the items of `top`; with `ANY` the first one found. `None` for the few rays
/// that the shorter test of boxes does not serve.
#[inline(always)]
pub(crate) fn nearest<'a, S: Simd, const ANY: bool>(
    simd: S,
    top: &WideTree<Aabb>,
    copy_of: impl Fn(u32) -> Option<(u32, Copy<'a>)>,
    ray: &Ray,
) -> Option<HitOfCopy> {
    let (boxes, world) = WorldRay::fused(simd, ray)?;
    let mut nearest = HitOfCopy::new(world.ray.t_max);
    let Some(start) = top.root else { return Some(nearest) };
    let block_ray = BlockRay::new(&world.lanes, 0);
    let walk = Walk { start, t_max: nearest.t(), is_ordered: !ANY };
    each_leaf(
        simd,
        top,
        walk,
        &boxes,
        &mut NoProbe,
        #[inline(always)]
        |leaf, _| {
            for block in top.leaves.blocks(leaf) {
                let (entered, entries) = block_ray.entered(simd, block, nearest.t());
                for lane in bits(u64::from(entered)) {
                    if entries[lane % BLOCK] <= nearest.t()
                        && let Some((index, copy)) = copy_of(block.primitive_index(lane))
                    {
                        trace_copy::<S, ANY>(simd, index, copy, &world, &mut nearest);
                        if ANY && nearest.found() {
                            return ControlFlow::Break(());
                        }
                    }
                }
            }
            ControlFlow::Continue(nearest.t())
        },
    );
    Some(nearest)
}

/// Offers the hits with a copy to `nearest`; with `ANY` up to the first.
#[inline(always)]
fn trace_copy<S: Simd, const ANY: bool>(
    simd: S,
    index: u32,
    copy: Copy<'_>,
    world: &WorldRay,
    nearest: &mut HitOfCopy,
) {
    let t_max = nearest.t();
    let Some(carried) = copy.place.carry(&Ray { t_max, ..world.ray }) else {
        return trace_outlined::<S, ANY>(simd, index, copy, world, nearest);
    };
    let Some(boxes) = FusedBoxRay::widened(simd, &carried.ray, carried.widening) else {
        return trace_outlined::<S, ANY>(simd, index, copy, world, nearest);
    };
    let block_ray = BlockRay::new(&world.lanes, 0);
    let walk = Walk { start: copy.start, t_max: carried.distance(t_max), is_ordered: !ANY };
    each_leaf(
        simd,
        copy.tree,
        walk,
        &boxes,
        &mut NoProbe,
        #[inline(always)]
        |leaf, _| {
            for block in copy.tree.leaves.blocks(leaf) {
                let window = placed(simd, block, copy.place);
                let block = TriangleBlock::<BLOCK> { window: &window, count: block.count };
                let t_max = nearest.t();
                block_ray.each_hit(simd, block, &world.ray, t_max, |hit, primitive_index| {
                    nearest.offer(index, hit, primitive_index);
                });
                if ANY && nearest.found() {
                    return ControlFlow::Break(());
                }
            }
            ControlFlow::Continue(carried.distance(nearest.t()))
        },
    );
}

/// [`trace_copy`] for a ray that the shorter test of boxes does not serve in the mesh.
#[cold]
#[inline(never)]
fn trace_outlined<S: Simd, const ANY: bool>(
    simd: S,
    index: u32,
    copy: Copy<'_>,
    world: &WorldRay,
    nearest: &mut HitOfCopy,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            each_hit(simd, copy, world, nearest.t(), &mut NoProbe, &mut |hit, primitive_index| {
                nearest.offer(index, hit, primitive_index);
                if ANY { ControlFlow::Break(()) } else { ControlFlow::Continue(nearest.t()) }
            });
        },
    );
}
