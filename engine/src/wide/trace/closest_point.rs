//! The point of the triangles that is nearest to another.

use fearless_simd::{Simd, SimdBase, SimdMask, f32x4, f32x8};

use crate::kernel::bits::bits;
use crate::kernel::each;
use crate::query::NearestPoint;
use crate::wide::block::TriangleBlock;
use crate::wide::bounds::WideContainer;
use crate::wide::child::Child;
use crate::wide::layout::WIDTH;
use crate::wide::trace::single::{Waiting, take_lane};
use crate::wide::trace::stack::Stack;
use crate::wide::tree::WideTree;

/// Offers to `nearest` every triangle that may have a nearer point: the containers of eight children are measured side by side, the
/// nearest is visited first, and what is farther than the nearest point so far is skipped.
#[inline(always)]
pub(crate) fn closest_point<S: Simd, C: WideContainer>(simd: S, tree: &WideTree<C>, nearest: &mut NearestPoint) {
    let Some(root) = tree.root else { return };
    let point = nearest.point();
    let lanes = each!(axis => f32x8::splat(simd, point[axis]));
    let mut stack = Stack::new();
    stack.push(Waiting::new(0.0, root));
    while let Some(waiting) = stack.pop() {
        let current = waiting.child();
        if waiting.entry() > nearest.reach() {
            continue;
        }
        if current.is_leaf() {
            for block in tree.leaves.blocks(current) {
                visit_block(simd, block, nearest);
            }
            continue;
        }
        let mut space = None;
        let (bounds, children) = tree.node(current).unpack(simd, &mut space);
        let distances = C::distances_squared(simd, bounds, lanes);
        let mut near = distances.simd_le(f32x8::splat(simd, nearest.reach())).to_bitmask() as u32;
        if nearest.reach() == f32::INFINITY {
            near &= used_lanes(children);
        }
        let distances = distances.to_array();
        let mark = stack.reserve();
        while near != 0 {
            let lane = take_lane(&mut near);
            tree.prefetch(children[lane]);
            stack.push(Waiting::new(distances[lane], children[lane]));
            stack.sort_last(mark, |a, b| a < b);
        }
    }
}

/// One bit for each lane that has a child: unused ones refer to the root.
#[inline(always)]
fn used_lanes(children: &[Child; WIDTH]) -> u32 {
    children.iter().enumerate().fold(0, |lanes, (lane, child)| lanes | u32::from(*child != Child::ROOT) << lane)
}

/// Offers the triangles of `block` whose boxes are near enough.
#[inline(always)]
fn visit_block<S: Simd>(simd: S, block: TriangleBlock<'_>, nearest: &mut NearestPoint) {
    let point = nearest.point();
    let distances = block.distances_squared(simd, each!(axis => f32x4::splat(simd, point[axis])));
    let near = distances.simd_le(f32x4::splat(simd, nearest.reach())).to_bitmask() as u32 & block.lanes();
    let distances = distances.to_array();
    for lane in bits(u64::from(near)) {
        if distances[lane] <= nearest.reach() {
            nearest.offer(&block.triangle(lane), block.primitive_index(lane));
        }
    }
}
