//! The loop that takes one ray through the tree, and its stack.

use std::ops::{ControlFlow, Range};

use fearless_simd::Simd;

use super::probe::Probe;
use crate::geometry::{PreparedRay, Shear};
use crate::tree::container::Container;
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
pub(super) fn walk<S: Simd, C: Container, P: Probe, const ORDERED: bool, const FARTHEST_FIRST: bool>(
    simd: S,
    tree: &Tree<C>,
    ray: &PreparedRay,
    stack: &mut [StackEntry],
    probe: &mut P,
    mut leaf: impl FnMut(Range<usize>, &Shear, &mut P) -> ControlFlow<(), f32>,
) {
    let nodes = &tree.nodes[..];
    let Some(mut node) = nodes.first().filter(|root| ray.can_hit() && enters_root(root, ray, probe)) else { return };
    let mut t_max = ray.ray.t_max;
    let mut shear = None;
    let mut waiting = NodeStack { stack, overflow: Vec::new(), top: 0 };
    loop {
        probe.visited(index_of(nodes, node));
        let next = if node.is_leaf() {
            let first = node.first as usize;
            let shear = shear.get_or_insert_with(|| Shear::new(ray.ray.direction));
            match leaf(first..first + node.count as usize, shear, probe) {
                ControlFlow::Break(()) => return,
                ControlFlow::Continue(new_t_max) => t_max = new_t_max,
            }
            None
        } else if node.count != 0 {
            visit_children::<C, P, ORDERED, FARTHEST_FIRST>(nodes, node, ray, t_max, &mut waiting, probe)
        } else {
            visit_pair::<S, C, P, ORDERED, FARTHEST_FIRST>(simd, nodes, node, ray, t_max, &mut waiting, probe)
        };
        node = match next {
            Some(child) => child,
            None => match waiting.pop::<P, ORDERED>(t_max, probe) {
                Some(index) => &nodes[index as usize],
                None => return,
            },
        };
    }
}

/// Tests the container of the root. A root that is a leaf is not tested: its primitives are, directly.
#[inline(always)]
fn enters_root<C: Container, P: Probe>(root: &Node<C>, ray: &PreparedRay, probe: &mut P) -> bool {
    if root.is_leaf() {
        return true;
    }
    probe.container_test();
    let entry = root.container.entry(ray, ray.ray.t_min, ray.ray.t_max);
    report_test(&root.container, 0, ray, entry, probe);
    entry.is_some()
}

/// Tests the children of `node`, which has their number as its count. Returns the one to visit next; the others that the ray enters
/// wait.
#[inline(always)]
fn visit_children<'a, C: Container, P: Probe, const ORDERED: bool, const FARTHEST_FIRST: bool>(
    nodes: &'a [Node<C>],
    node: &Node<C>,
    ray: &PreparedRay,
    t_max: f32,
    waiting: &mut NodeStack<'_>,
    probe: &mut P,
) -> Option<&'a Node<C>> {
    let children = &nodes[node.first as usize..][..node.arity() as usize];
    (0..children.len()).for_each(|_| probe.container_test());
    let mut entered = Entered::new(children, node.first, ray, ray.ray.t_min, t_max);
    if P::EVENTS {
        for (child, index) in children.iter().zip(node.first..) {
            report_test(&child.container, index, ray, entered.distance_of(index), probe);
        }
    }
    if ORDERED {
        entered.sort(FARTHEST_FIRST);
    }
    let (next, others) = entered.list().split_first()?;
    for &entry in others.iter().rev() {
        waiting.push_overflowing(entry);
        if P::EVENTS {
            probe.pushed(entry.node);
        }
    }
    Some(&nodes[next.node as usize])
}

/// [`visit_children`] of a `node` with two children, in SIMD.
#[inline(always)]
fn visit_pair<'a, S: Simd, C: Container, P: Probe, const ORDERED: bool, const FARTHEST_FIRST: bool>(
    simd: S,
    nodes: &'a [Node<C>],
    node: &Node<C>,
    ray: &PreparedRay,
    t_max: f32,
    waiting: &mut NodeStack<'_>,
    probe: &mut P,
) -> Option<&'a Node<C>> {
    let first = node.first as usize;
    let [left, right] = nodes.get(first..first + 2)? else { return None };
    probe.container_test();
    probe.container_test();
    let pair = C::entry_pair(simd, [&left.container, &right.container], ray, ray.ray.t_min, t_max);
    if P::EVENTS {
        for (side, child) in [left, right].into_iter().enumerate() {
            let entry = (pair.hits >> side & 1 != 0).then_some(pair.entry[side]);
            report_test(&child.container, node.first + side as u32, ray, entry, probe);
        }
    }
    match pair.hits {
        0 => None,
        1 => Some(left),
        2 => Some(right),
        _ => {
            let [left_entry, right_entry] = pair.entry;
            let right_first = if FARTHEST_FIRST { right_entry > left_entry } else { right_entry < left_entry };
            let swap = ORDERED && right_first;
            let entry = if swap {
                StackEntry { node: first as u32, distance: left_entry }
            } else {
                StackEntry { node: first as u32 + 1, distance: right_entry }
            };
            waiting.push(entry);
            if P::EVENTS {
                probe.pushed(entry.node);
            }
            Some(if swap { right } else { left })
        }
    }
}

/// The nodes still to be visited, the next one on top.
struct NodeStack<'a> {
    stack: &'a mut [StackEntry],
    /// The entries for which the stack has no room: none in a binary tree.
    overflow: Vec<StackEntry>,
    /// Number of entries.
    top: usize,
}

impl NodeStack<'_> {
    #[inline(always)]
    fn push(&mut self, entry: StackEntry) {
        if let Some(slot) = self.stack.get_mut(self.top) {
            *slot = entry;
            self.top += 1;
        } else {
            self.push_overflowing(entry);
        }
    }

    #[cold]
    #[inline(never)]
    fn push_overflowing(&mut self, entry: StackEntry) {
        if let Some(slot) = self.stack.get_mut(self.top) {
            *slot = entry;
        } else {
            self.overflow.truncate(self.top - self.stack.len());
            self.overflow.push(entry);
        }
        self.top += 1;
    }

    /// Removes nodes until one is entered before the nearest hit, at `t_max`. Returns it.
    #[inline(always)]
    fn pop<P: Probe, const ORDERED: bool>(&mut self, t_max: f32, probe: &mut P) -> Option<u32> {
        loop {
            self.top = self.top.checked_sub(1)?;
            let entry = match self.stack.get(self.top) {
                Some(entry) => *entry,
                None => self.overflow[self.top - self.stack.len()],
            };
            if P::EVENTS {
                probe.popped(entry.node);
            }
            if !ORDERED || entry.distance <= t_max {
                return Some(entry.node);
            }
            if P::EVENTS {
                probe.culled(entry.node, entry.distance);
            }
        }
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
    fn new<C: Container>(children: &[Node<C>], first: u32, ray: &PreparedRay, t_min: f32, t_max: f32) -> Self {
        let mut entered = Self { entries: [StackEntry::NONE; MAX_ARITY], count: 0 };
        for (child, node) in children.iter().zip(first..) {
            if let Some(distance) = child.container.entry(ray, t_min, t_max) {
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

/// Reports the test of the container of `node`, which gave `entry`, to a probe with events. A test that ends at
/// the nearest hit has the same result for a container behind it and one that is missed; a test to the end of the ray separates them.
#[inline(always)]
fn report_test<C: Container, P: Probe>(container: &C, node: u32, ray: &PreparedRay, entry: Option<f32>, probe: &mut P) {
    if !P::EVENTS {
        return;
    }
    if let Some(t) = entry {
        probe.entered(node, t);
    } else if let Some(t) = container.entry(ray, ray.ray.t_min, ray.ray.t_max) {
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
pub(super) fn with_stack<R>(max_depth: u32, run: impl FnOnce(&mut [StackEntry]) -> R) -> R {
    if max_depth as usize <= SMALL_STACK {
        run(&mut [StackEntry::NONE; SMALL_STACK])
    } else {
        run(&mut vec![StackEntry::NONE; max_depth as usize])
    }
}
