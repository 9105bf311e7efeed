//! The loop that takes one ray through the tree, and its stack.

use std::ops::{ControlFlow, Range};

use fearless_simd::Simd;

use super::probe::Probe;
use crate::geometry::Container;
use crate::geometry::{PreparedRay, Shear};
use crate::tree::node::{Node, Tree};

/// A node still to be visited, with the entry distance of the ray.
#[derive(Debug, Clone, Copy)]
pub struct StackEntry {
    node: u32,
    distance: f32,
}

impl StackEntry {
    const NONE: Self = Self { node: 0, distance: 0.0 };
}

/// A traversal stack for trees up to depth `max_depth`: one entry per level, for the sibling of the visited node in a binary
/// tree, and at least 256. Nodes with more children can need more, which a ray then allocates. It can be reused for any number
/// of rays without clearing.
pub fn new_stack(max_depth: u32) -> Vec<StackEntry> {
    vec![StackEntry::NONE; (max_depth as usize).max(LEAST_STACK)]
}

/// Least length of a [`new_stack`], 2 KiB: enough for all siblings on 36 levels of eight children, and on 8 of 32.
const LEAST_STACK: usize = 256;

/// Visits the leaves that `ray` reaches. `leaf` tests the primitives of a range of slots and returns the new `t_max`. With
/// `ORDERED` the nearest child goes first, or the farthest one with `FARTHEST_FIRST`, then the others in this order, and what
/// is entered beyond `t_max` is skipped; without it, nodes are visited in their order. Children at equal distances keep their
/// order.
#[inline(always)]
#[expect(clippy::too_many_lines, reason = "the loop of every ray, whose variables stay in registers")]
pub(crate) fn walk<S: Simd, C: Container, P: Probe, const ORDERED: bool, const FARTHEST_FIRST: bool>(
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
    let part = &C::ray_part(ray);
    // A root that is a leaf is not tested: its primitives are, directly.
    if !root.is_leaf() {
        probe.container_test();
        let entry = root.container.entry(ray, part, t_min, t_max);
        report_test(&root.container, 0, ray, part, entry, probe);
        if entry.is_none() {
            return;
        }
    }
    let mut shear = None;
    let mut node = root;
    let mut top = 0;
    // Entries beyond the stack's capacity: none in a binary tree.
    let mut overflow: Vec<StackEntry> = Vec::new();
    loop {
        probe.visited(index_of(nodes, node));
        if node.is_leaf() {
            let first = node.first as usize;
            let shear = shear.get_or_insert_with(|| Shear::new(ray.ray.direction));
            match leaf(first..first + node.count as usize, shear, probe) {
                ControlFlow::Break(()) => return,
                ControlFlow::Continue(new_t_max) => t_max = new_t_max,
            }
        } else if node.count != 0 {
            let children = &nodes[node.first as usize..][..node.arity() as usize];
            (0..children.len()).for_each(|_| probe.container_test());
            let mut entered = Entered::new(children, node.first, ray, part, t_min, t_max);
            if P::EVENTS {
                for (child, index) in children.iter().zip(node.first..) {
                    report_test(&child.container, index, ray, part, entered.distance_of(index), probe);
                }
            }
            if ORDERED {
                entered.sort(FARTHEST_FIRST);
            }
            if let [next, others @ ..] = entered.list() {
                for &entry in others.iter().rev() {
                    push(stack, &mut overflow, top, entry);
                    if P::EVENTS {
                        probe.pushed(entry.node);
                    }
                    top += 1;
                }
                node = &nodes[next.node as usize];
                continue;
            }
        } else {
            let first = node.first as usize;
            let [left, right] = &nodes[first..first + 2] else { return };
            probe.container_test();
            probe.container_test();
            let pair = C::entry_pair(simd, [&left.container, &right.container], ray, part, t_min, t_max);
            if P::EVENTS {
                for (side, child) in [left, right].into_iter().enumerate() {
                    let entry = (pair.hits >> side & 1 != 0).then_some(pair.entry[side]);
                    report_test(&child.container, node.first + side as u32, ray, part, entry, probe);
                }
            }
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
                    let entry = if swap {
                        StackEntry { node: first as u32, distance: left_entry }
                    } else {
                        StackEntry { node: first as u32 + 1, distance: right_entry }
                    };
                    match stack.get_mut(top) {
                        Some(slot) => *slot = entry,
                        None => push(stack, &mut overflow, top, entry),
                    }
                    if P::EVENTS {
                        probe.pushed(entry.node);
                    }
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
            let entry = match stack.get(top) {
                Some(entry) => *entry,
                None => overflow[top - stack.len()],
            };
            if P::EVENTS {
                probe.popped(entry.node);
            }
            if !ORDERED || entry.distance <= t_max {
                break &nodes[entry.node as usize];
            }
            if P::EVENTS {
                probe.culled(entry.node, entry.distance);
            }
        };
    }
}

/// Puts `entry` at `top` of the stack, which is full up to there.
#[cold]
#[inline(never)]
fn push(stack: &mut [StackEntry], overflow: &mut Vec<StackEntry>, top: usize, entry: StackEntry) {
    if let Some(slot) = stack.get_mut(top) {
        *slot = entry;
    } else {
        overflow.truncate(top - stack.len());
        overflow.push(entry);
    }
}

/// The children of a node that a ray enters.
struct Entered {
    entries: [StackEntry; MAX_ARITY],
    count: usize,
}

const MAX_ARITY: usize = Node::<()>::MAX_ARITY as usize;

impl Entered {
    /// Those of `children`, which are the nodes from `first` on, in their order. Not inlined, so that nodes of two children,
    /// which nearly all trees consist of, have the registers for themselves.
    #[cold]
    #[inline(never)]
    fn new<C: Container>(
        children: &[Node<C>],
        first: u32,
        ray: &PreparedRay,
        part: &C::RayPart,
        t_min: f32,
        t_max: f32,
    ) -> Self {
        let mut entered = Self { entries: [StackEntry::NONE; MAX_ARITY], count: 0 };
        for (child, node) in children.iter().zip(first..) {
            if let Some(distance) = child.container.entry(ray, part, t_min, t_max) {
                entered.entries[entered.count] = StackEntry { node, distance };
                entered.count += 1;
            }
        }
        entered
    }

    /// Sorts them by distance, nearest or farthest first; equal ones keep their order.
    #[cold]
    #[inline(never)]
    fn sort(&mut self, farthest_first: bool) {
        let list = &mut self.entries[..self.count];
        for sorted in 1..list.len() {
            let mut at = sorted;
            while at > 0 && {
                let [before, after] = [list[at - 1].distance, list[at].distance];
                if farthest_first { after > before } else { after < before }
            } {
                list.swap(at - 1, at);
                at -= 1;
            }
        }
    }

    fn list(&self) -> &[StackEntry] {
        &self.entries[..self.count]
    }

    /// The entry distance of `node`; `None` where the ray misses it.
    fn distance_of(&self, node: u32) -> Option<f32> {
        self.list().iter().find(|entry| entry.node == node).map(|entry| entry.distance)
    }
}

/// Index of `node`, one of `nodes`: computed only for probes that use it, where a variable beside the reference would cost all.
#[inline(always)]
fn index_of<C>(nodes: &[Node<C>], node: &Node<C>) -> u32 {
    nodes.element_offset(node).unwrap_or_default() as u32
}

/// Reports the test of the container of `node`, which gave `entry`, to a probe that wants events. A test up to the nearest hit does
/// not tell a container behind it from one that is missed: up to the end of the ray it does.
#[inline(always)]
fn report_test<C: Container, P: Probe>(
    container: &C,
    node: u32,
    ray: &PreparedRay,
    part: &C::RayPart,
    entry: Option<f32>,
    probe: &mut P,
) {
    if !P::EVENTS {
        return;
    }
    if let Some(t) = entry {
        probe.entered(node, t);
    } else if let Some(t) = container.entry(ray, part, ray.ray.t_min, ray.ray.t_max) {
        probe.entered(node, t);
        probe.culled(node, t);
    } else {
        probe.missed(node);
    }
}

/// Maximum depth of trees for which the stack of a single ray is not allocated on the heap.
const SMALL_STACK: usize = 64;

/// Calls `run` with a stack for a tree of depth `max_depth`.
#[inline(always)]
pub(crate) fn with_stack<R>(max_depth: u32, run: impl FnOnce(&mut [StackEntry]) -> R) -> R {
    if max_depth as usize <= SMALL_STACK {
        run(&mut [StackEntry::NONE; SMALL_STACK])
    } else {
        run(&mut vec![StackEntry::NONE; max_depth as usize])
    }
}
