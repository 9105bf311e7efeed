//! All hits of a single ray.

use std::ops::ControlFlow;

use fearless_simd::Simd;

use crate::geometry::Ray;
use crate::query::HitList;
use crate::tree::traverse::NoProbe;
use crate::wide::block::BlockRay;
use crate::wide::bounds::WideContainer;
use crate::wide::box_lanes::LaneTest;
use crate::wide::child::Child;
use crate::wide::ray_lanes::{RayLanes, TriangleLanes};
use crate::wide::trace::walk::{Walk, each_leaf};
use crate::wide::tree::WideTree;

/// Adds the hits of `ray` to `list`.
#[inline(always)]
pub(crate) fn all_hits<S: Simd, C: WideContainer>(simd: S, tree: &WideTree<C>, ray: &Ray, list: &mut HitList<'_>) {
    let Some(root) = tree.root else { return };
    // The shorter test may enter more containers, which have no more hits: a triangle's own box decides about that.
    if let Some((container_ray, lanes)) = C::prepare_fused(simd, ray) {
        walk(simd, tree, root, ray, &lanes, &container_ray, list);
    } else if let Some(lanes) = RayLanes::single::<S, C>(simd, ray) {
        walk(simd, tree, root, ray, &lanes.triangles, &C::prepare(simd, &lanes, 0), list);
    }
}

/// [`all_hits`] from `root` on, for a ray that was prepared as `lanes` and `container_ray`. For a list with a limit the nearest child
/// goes first, so that it is soon full of near hits.
#[inline(always)]
fn walk<S: Simd, C: WideContainer, T: LaneTest<S, C::Bounds>>(
    simd: S,
    tree: &WideTree<C>,
    root: Child,
    ray: &Ray,
    lanes: &TriangleLanes<1>,
    container_ray: &T,
    list: &mut HitList<'_>,
) {
    let block_ray = BlockRay::new(lanes, 0);
    let walk = Walk { start: root, t_max: list.t_max(), is_ordered: list.is_limited() };
    each_leaf(
        simd,
        tree,
        walk,
        container_ray,
        &mut NoProbe,
        #[inline(always)]
        |leaf, _| {
            let t_max = list.t_max();
            for block in tree.leaves.blocks(leaf) {
                block_ray.each_hit(simd, block, ray, t_max, |hit, index| list.add(hit.of(index)));
            }
            ControlFlow::Continue(list.t_max())
        },
    );
}
