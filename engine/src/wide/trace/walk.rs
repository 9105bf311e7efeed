//! A single ray through all nodes that it enters, for queries that a nearest hit does not end.

use std::ops::ControlFlow;

use fearless_simd::Simd;

use crate::tree::traverse::Probe;
use crate::wide::bounds::WideContainer;
use crate::wide::box_lanes::LaneTest;
use crate::wide::child::Child;
use crate::wide::trace::single::{Waiting, take_lane};
use crate::wide::trace::stack::Stack;
use crate::wide::tree::WideTree;

/// Where a walk begins, and what it visits.
pub(crate) struct Walk {
    /// The node or leaf.
    pub(crate) start: Child,
    /// The distance up to which leaves are wanted at first.
    pub(crate) t_max: f32,
    /// The nearest child of a node goes first.
    pub(crate) is_ordered: bool,
}

/// Calls `visit` with each leaf that `ray` enters. It returns the distance up to which leaves are wanted from
/// there on, or breaks where no more are. `probe` gets each node and leaf that
/// the ray goes into, and the tests of containers.
///
/// `visit` must be `#[inline(always)]` where it computes with `simd`: each operation is a call where it is compiled apart, without the
/// instructions of the level.
#[inline(always)]
pub(crate) fn each_leaf<S: Simd, C: WideContainer, T: LaneTest<S, C::Bounds>, P: Probe>(
    simd: S,
    tree: &WideTree<C>,
    Walk { start, mut t_max, is_ordered }: Walk,
    ray: &T,
    probe: &mut P,
    mut visit: impl FnMut(Child, &mut P) -> ControlFlow<(), f32>,
) {
    let mut stack = Stack::new();
    let mut current = start;
    loop {
        probe.visited(current.bits());
        if current.is_leaf() {
            match visit(current, probe) {
                ControlFlow::Continue(end) => t_max = end,
                ControlFlow::Break(()) => return,
            }
        } else {
            probe.container_test();
            let mut space = None;
            let (bounds, children) = tree.node(current).unpack(simd, &mut space);
            let (mut entered, entries) = ray.intersect(simd, bounds, t_max);
            if entered != 0 {
                let first = take_lane(&mut entered);
                if entered == 0 {
                    current = children[first];
                    continue;
                }
                let mark = stack.reserve();
                let mut next = Waiting::new(entries[first], children[first]);
                while entered != 0 {
                    let lane = take_lane(&mut entered);
                    let mut other = Waiting::new(entries[lane], children[lane]);
                    if !is_ordered || other < next {
                        std::mem::swap(&mut other, &mut next);
                    }
                    tree.prefetch(other.child());
                    stack.push(other);
                    if is_ordered {
                        stack.sort_last(mark, |a, b| a < b);
                    }
                }
                current = next.child();
                continue;
            }
        }
        current = loop {
            let Some(waiting) = stack.pop() else { return };
            if waiting.entry() <= t_max * T::SLACK {
                break waiting.child();
            }
        };
    }
}
