//! Rays through a tree of items of the caller's own: where each leaf has their boxes, as stand-ins for triangles.

use std::ops::ControlFlow;

use fearless_simd::Simd;

use crate::geometry::Ray;
use crate::kernel::bits::bits;
use crate::tree::traverse::Probe;
use crate::wide::block::BlockRay;
use crate::wide::bounds::WideContainer;
use crate::wide::box_lanes::LaneTest;
use crate::wide::ray_lanes::{RayLanes, TriangleLanes};
use crate::wide::trace::walk::{Walk, each_leaf};
use crate::wide::tree::WideTree;

/// Called with an item whose box the ray meets and with the distance up to which hits are wanted; returns that distance from there on,
/// or that no more are wanted.
pub type Visit<'a> = &'a mut dyn FnMut(u32, f32) -> ControlFlow<(), f32>;

/// Calls `visit` with each item whose box `ray` meets, items of nearer containers first, and with `probe`, which observes.
#[inline(always)]
pub(crate) fn visit_items<S: Simd, C: WideContainer, P: Probe>(
    simd: S,
    tree: &WideTree<C>,
    ray: &Ray,
    probe: &mut P,
    visit: Visit<'_>,
) {
    // As for all hits, the shorter test may enter more containers.
    if let Some((container_ray, lanes)) = C::prepare_fused(simd, ray) {
        walk(simd, tree, ray, &lanes, &container_ray, probe, visit);
    } else if let Some(lanes) = RayLanes::single::<S, C>(simd, ray) {
        walk(simd, tree, ray, &lanes.triangles, &C::prepare(simd, &lanes, 0), probe, visit);
    }
}

/// [`visit_items`] for a ray that was prepared as `lanes` and `container_ray`.
#[inline(always)]
fn walk<S: Simd, C: WideContainer, T: LaneTest<S, C::Bounds>, P: Probe>(
    simd: S,
    tree: &WideTree<C>,
    ray: &Ray,
    lanes: &TriangleLanes<1>,
    container_ray: &T,
    probe: &mut P,
    visit: Visit<'_>,
) {
    let Some(start) = tree.root else { return };
    let mut t_max = ray.t_max;
    let block_ray = BlockRay::new(lanes, 0);
    let walk = Walk { start, t_max, is_ordered: true };
    each_leaf(
        simd,
        tree,
        walk,
        container_ray,
        probe,
        #[inline(always)]
        |leaf, probe| {
            for block in tree.leaves.blocks(leaf) {
                probe.primitive_test();
                let (entered, entries) = block_ray.entered(simd, block, t_max);
                for lane in bits(u64::from(entered)) {
                    if entries[lane] <= t_max {
                        t_max = match visit(block.primitive_index(lane), t_max) {
                            ControlFlow::Continue(end) => end,
                            ControlFlow::Break(()) => return ControlFlow::Break(()),
                        };
                    }
                }
            }
            ControlFlow::Continue(t_max)
        },
    );
}
