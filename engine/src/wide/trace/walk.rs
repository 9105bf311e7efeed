//! A single ray through all nodes that it enters, for queries that a nearest hit does not end.

use std::ops::ControlFlow;

use fearless_simd::Simd;

use crate::wide::bounds::WideContainer;
use crate::wide::box_lanes::LaneTest;
use crate::wide::child::Child;
use crate::wide::trace::single::{Waiting, take_lane};
use crate::wide::trace::stack::Stack;
use crate::wide::tree::WideTree;

/// Calls `visit` with each leaf below `start` that `ray` enters up to `t_max`. It returns the distance up to which leaves are wanted from
/// there on, or breaks where no more are. Where `is_ordered`, the nearest child of a node goes first.
#[inline(always)]
pub(crate) fn each_leaf<S: Simd, C: WideContainer, T: LaneTest<S, C::Bounds>>(
    simd: S,
    tree: &WideTree<C>,
    start: Child,
    ray: &T,
    mut t_max: f32,
    is_ordered: bool,
    mut visit: impl FnMut(Child) -> ControlFlow<(), f32>,
) {
    let mut stack = Stack::new();
    stack.push(Waiting::new(0.0, start));
    while let Some(waiting) = stack.pop() {
        let current = waiting.child();
        if waiting.entry() > t_max * T::SLACK {
            continue;
        }
        if current.is_leaf() {
            match visit(current) {
                ControlFlow::Continue(end) => t_max = end,
                ControlFlow::Break(()) => return,
            }
            continue;
        }
        let mut space = None;
        let (bounds, children) = tree.node(current).unpack(simd, &mut space);
        let (mut entered, entries) = ray.intersect(simd, bounds, t_max);
        let mark = stack.reserve();
        while entered != 0 {
            let lane = take_lane(&mut entered);
            tree.prefetch(children[lane]);
            stack.push(Waiting::new(entries[lane], children[lane]));
            if is_ordered {
                stack.sort_last(mark, |a, b| a < b);
            }
        }
    }
}
