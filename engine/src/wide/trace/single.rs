//! Traversal of a single ray.

use fearless_simd::Simd;

use crate::geometry::{Hit, Ray};
use crate::tree::traverse::{Nearest, Probe};
use crate::wide::block::BlockRay;
use crate::wide::bounds::WideContainer;
use crate::wide::layout::WIDTH;
use crate::wide::ray_lanes::{RAY_LANES, RayLanes};
use crate::wide::trace::stack::{Stack, StackEntry};
use crate::wide::tree::WideTree;

/// The closest hit of `ray`: exactly that of the binary tree. `probe` counts nodes as containers and blocks as
/// primitives.
#[inline(always)]
pub fn closest_hit<S: Simd, C: WideContainer, P: Probe>(
    simd: S,
    tree: &WideTree<C>,
    ray: &Ray,
    probe: &mut P,
) -> Option<Hit> {
    nearest::<S, C, P, false>(simd, tree, ray, probe).hit()
}

/// Whether anything lies on `ray` between its `t_min` and `t_max`.
#[inline(always)]
pub fn any_hit<S: Simd, C: WideContainer, P: Probe>(simd: S, tree: &WideTree<C>, ray: &Ray, probe: &mut P) -> bool {
    nearest::<S, C, P, true>(simd, tree, ray, probe).found()
}

/// The closest hit; with `ANY` the first one found.
#[inline(always)]
pub(crate) fn nearest<S: Simd, C: WideContainer, P: Probe, const ANY: bool>(
    simd: S,
    tree: &WideTree<C>,
    ray: &Ray,
    probe: &mut P,
) -> Nearest {
    let mut nearest = Nearest::new(ray.t_max);
    let Some(mut current) = tree.root else { return nearest };
    let mut lanes = RayLanes::<RAY_LANES>::EMPTY;
    if lanes.set::<S, C>(simd, 0, std::slice::from_ref(ray)) == 0 {
        return nearest;
    }
    let container_ray = C::prepare(simd, &lanes, 0);
    let block_ray = BlockRay::new(simd, &lanes, 0);
    let mut stack = Stack::default();
    loop {
        if current.is_leaf() {
            for block in &tree.blocks[current.index()..] {
                probe.primitive_test();
                block_ray.closest_hit(simd, block, ray, &mut nearest);
                if block.is_last() {
                    break;
                }
            }
            if ANY && nearest.found() {
                return nearest;
            }
        } else {
            probe.container_test();
            let node = &tree.nodes[current.index()];
            let (mut hits, entries) = C::intersect_mask(simd, &node.bounds, &container_ray, nearest.t());
            if hits != 0 {
                let stack_entry = |lane: u32| {
                    let lane = lane as usize % WIDTH;
                    StackEntry { entry: entries[lane], child: node.children[lane], groups: 0 }
                };
                let mut next = stack_entry(hits.trailing_zeros());
                hits &= hits - 1;
                let mark = stack.mark();
                while hits != 0 {
                    let mut other = stack_entry(hits.trailing_zeros());
                    hits &= hits - 1;
                    // For any hit, visit the farthest child first: what a ray starts from rarely blocks it.
                    let is_next = if ANY { other.entry > next.entry } else { other.entry < next.entry };
                    if is_next {
                        std::mem::swap(&mut other, &mut next);
                    }
                    tree.prefetch(other.child);
                    stack.push(other);
                    if !ANY {
                        stack.sort_last(mark);
                    }
                }
                current = next.child;
                continue;
            }
        }
        current = loop {
            let Some(stack_entry) = stack.pop() else { return nearest };
            if stack_entry.entry <= nearest.t() {
                break stack_entry.child;
            }
        };
    }
}
