//! The loop that takes one ray through the binary tree, and its stack.

use std::ops::{ControlFlow, Range};

use fearless_simd::Simd;

use super::probe::Probe;
use crate::geometry::{PreparedRay, Shear};
use crate::tree::container::Container;
use crate::tree::node::Tree;

/// A node still to be visited, with the entry distance of the ray.
#[derive(Debug, Clone, Copy)]
pub struct StackEntry {
    node: u32,
    distance: f32,
}

impl StackEntry {
    const NONE: Self = Self { node: 0, distance: 0.0 };
}

/// A traversal stack for trees up to depth `max_depth`: one entry per level, for the sibling of the visited node. It can be reused
/// for any number of rays without clearing.
pub fn new_stack(max_depth: u32) -> Vec<StackEntry> {
    vec![StackEntry::NONE; max_depth as usize]
}

/// Visits the leaves that `ray` reaches. `leaf` tests the primitives of a range of slots and returns the new `t_max`. With
/// `ORDERED` the near child goes first, or the far one with `FARTHEST_FIRST`, and what is entered beyond `t_max` is skipped;
/// without it, nodes are visited in their order.
#[inline(always)]
pub(super) fn walk<S: Simd, C: Container, P: Probe, const ORDERED: bool, const FARTHEST_FIRST: bool>(
    simd: S,
    tree: &Tree<C>,
    ray: &PreparedRay,
    stack: &mut [StackEntry],
    probe: &mut P,
    mut leaf: impl FnMut(Range<usize>, &Shear, &mut P) -> ControlFlow<(), f32>,
) {
    let nodes = &tree.nodes[..];
    let Some(root) = nodes.first() else { return };
    if !ray.can_hit() {
        return;
    }
    let (t_min, mut t_max) = (ray.ray.t_min, ray.ray.t_max);
    // A root that is a leaf is not tested: its primitives are, directly.
    if !root.is_leaf() {
        probe.container_test();
        if root.container.entry(ray, t_min, t_max).is_none() {
            return;
        }
    }
    let mut shear = None;
    let mut node = root;
    let mut top = 0;
    loop {
        if node.is_leaf() {
            let first = node.first as usize;
            let shear = shear.get_or_insert_with(|| Shear::new(ray.ray.direction));
            match leaf(first..first + node.count as usize, shear, probe) {
                ControlFlow::Break(()) => return,
                ControlFlow::Continue(new_t_max) => t_max = new_t_max,
            }
        } else {
            let first = node.first as usize;
            let [left, right] = &nodes[first..first + 2] else { return };
            probe.container_test();
            probe.container_test();
            let pair = C::entry_pair(simd, [&left.container, &right.container], ray, t_min, t_max);
            match pair.hits {
                0 => {}
                1 => {
                    node = left;
                    continue;
                }
                2 => {
                    node = right;
                    continue;
                }
                _ => {
                    let [left_entry, right_entry] = pair.entry;
                    let right_first = if FARTHEST_FIRST { right_entry > left_entry } else { right_entry < left_entry };
                    let swap = ORDERED && right_first;
                    stack[top] = if swap {
                        StackEntry { node: first as u32, distance: left_entry }
                    } else {
                        StackEntry { node: first as u32 + 1, distance: right_entry }
                    };
                    top += 1;
                    node = if swap { right } else { left };
                    continue;
                }
            }
        }
        // Pop the last node that is entered before the nearest hit.
        node = loop {
            if top == 0 {
                return;
            }
            top -= 1;
            let entry = stack[top];
            if !ORDERED || entry.distance <= t_max {
                break &nodes[entry.node as usize];
            }
        };
    }
}

/// Maximum depth of trees for which the stack of a single ray is not allocated on the heap.
const SMALL_STACK: usize = 64;

/// Calls `run` with a stack for a tree of depth `max_depth`.
#[inline(always)]
pub(super) fn with_stack<R>(max_depth: u32, run: impl FnOnce(&mut [StackEntry]) -> R) -> R {
    if max_depth as usize <= SMALL_STACK {
        run(&mut [StackEntry::NONE; SMALL_STACK])
    } else {
        run(&mut vec![StackEntry::NONE; max_depth as usize])
    }
}
