//! Orders the leaves of a tree whose nodes are all written: from left to right, so that the primitives below any node are
//! contiguous.

#![allow(clippy::inline_always, reason = "loops over all leaves call them")]

use crate::aac::cluster::item;
use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::parallel::{par_tasks, zeros};
use crate::tree::statistics::Sums;
use crate::tree::{Container, Node};

/// The items that become leaves.
pub trait LeafItems: Sync {
    /// Writes the primitives of the item `index` to `leaf`, which has their number.
    fn write(&self, index: u32, leaf: &mut [u32]);
}

/// Single primitives.
pub struct Primitives;

impl LeafItems for Primitives {
    #[inline(always)]
    fn write(&self, index: u32, leaf: &mut [u32]) {
        leaf[0] = index;
    }
}

/// The nodes that one task wrote.
pub struct TaskNodes<'a, C> {
    /// The task's slice of the list of nodes, as clusters have become nodes.
    pub nodes: &'a mut [Node<C>],
    /// Index of the slice's first node in the whole list.
    pub offset: usize,
    /// Index of the first child of each cluster that the task left; unused for an item.
    pub roots: Vec<u32>,
}

/// The leaves below one of the clusters that a task left.
#[derive(Default)]
struct RootLeaves<'a> {
    /// Depth of the cluster's node.
    depth: u32,
    /// Slot of its first primitive in the whole tree.
    first_slot: u32,
    /// The primitives of its leaves.
    primitives: &'a mut [u32],
}

/// Orders the leaves of the tree, each of which is one of `items`. `top` are the first nodes of the list; they refer to the clusters that
/// `tasks` left, in order, by every second index from `top.len()` on. Before, the `count` of each node is its number of primitives,
/// `count` at the root; afterwards it is 0 for interior nodes, and leaves refer to the returned list. Returns the primitives of the
/// leaves and the maximum depth of a leaf, and adds all nodes to `sums`, where each leaf has one primitive.
pub fn order_leaves<C: Container>(
    items: &impl LeafItems,
    top: &mut [Node<C>],
    tasks: &mut [TaskNodes<C>],
    count: usize,
    mut sums: Option<&mut Sums>,
    token: &CancelToken,
) -> Result<(Vec<u32>, u32), Cancelled> {
    let mut primitive_indices = zeros(count, token)?;
    let roots: Vec<u32> = tasks.iter().flat_map(|task| &task.roots).copied().collect();
    let mut root_leaves: Vec<RootLeaves> = roots.iter().map(|_| RootLeaves::default()).collect();

    // The nodes above the tasks, from left to right.
    let (mut max_depth, mut first_slot, mut remaining) = (0, 0, &mut primitive_indices[..]);
    let top_len = top.len();
    let mut stack = vec![(0, 0)];
    while let Some((index, depth)) = stack.pop() {
        let node = &mut top[index];
        max_depth = max_depth.max(depth);
        if let Some(sums) = &mut sums {
            sums.add_nodes(std::slice::from_ref(node), depth);
        }
        let (item, first) = (item(node.first), node.first as usize);
        if item.is_none() && first < top_len {
            node.count = 0;
            stack.extend([(first + 1, depth + 1), (first, depth + 1)]);
            continue;
        }
        let primitives;
        (primitives, remaining) = remaining.split_at_mut(node.count as usize);
        let slot = first_slot;
        first_slot += node.count;
        if let Some(item) = item {
            items.write(item, primitives);
            node.first = slot;
        } else {
            let root = (first - top_len) / 2;
            (node.first, node.count) = (roots[root], 0);
            root_leaves[root] = RootLeaves { depth, first_slot: slot, primitives };
        }
    }

    // The nodes of the tasks, in parallel.
    let mut parts = Vec::with_capacity(tasks.len());
    let mut remaining = &mut root_leaves[..];
    for task in tasks {
        let own;
        (own, remaining) = remaining.split_at_mut(task.roots.len());
        parts.push((task, own));
    }
    let results = par_tasks(parts, token, |(task, root_leaves), _| {
        if sums.is_none() {
            return Ok((order_task::<C, false>(items, task, root_leaves, &mut Sums::default()), None));
        }
        let mut own = Sums::default();
        Ok((order_task::<C, true>(items, task, root_leaves, &mut own), Some(own)))
    })?;
    let max_depth = results.iter().fold(max_depth, |deepest, (depth, _)| deepest.max(*depth));
    if let Some(sums) = sums {
        // In the order of the tasks, so that rounding does not depend on the number of threads.
        *sums = results.iter().filter_map(|(_, own)| own.as_ref()).fold(std::mem::take(sums), Sums::plus);
    }
    Ok((primitive_indices, max_depth))
}

/// Leaves that a pair of siblings inherits from its parent.
#[derive(Clone, Copy, Default)]
struct PairLeaves {
    /// Slot of the first primitive below the pair, within the task.
    slot: u32,
    /// Difference between this slot and that in the whole tree.
    offset: u32,
    depth: u32,
}

/// Orders the leaves of `task`, whose clusters have the leaves `root_leaves`, in one pass over its nodes in memory order. Returns
/// the maximum depth of a leaf. Adds all nodes to `sums` if `SUMS`.
fn order_task<C: Container, const SUMS: bool>(
    items: &impl LeafItems,
    task: &mut TaskNodes<C>,
    root_leaves: &mut [RootLeaves],
    sums: &mut Sums,
) -> u32 {
    let pair_of = |node: u32| (node as usize - task.offset) / 2;
    let mut pairs = vec![PairLeaves::default(); task.nodes.len() / 2];
    let mut count = 0;
    for (own, root) in root_leaves.iter().zip(&task.roots).filter(|(own, _)| !own.primitives.is_empty()) {
        pairs[pair_of(*root)] =
            PairLeaves { slot: count, offset: own.first_slot.wrapping_sub(count), depth: own.depth + 1 };
        count += own.primitives.len() as u32;
    }
    let mut primitives = vec![0; count as usize];
    let mut max_depth = 0;
    for pair in 0..pairs.len() {
        let PairLeaves { mut slot, offset, depth } = pairs[pair];
        max_depth = max_depth.max(depth);
        if SUMS {
            sums.add_nodes(&task.nodes[2 * pair..2 * pair + 2], depth);
        }
        for node in &mut task.nodes[2 * pair..2 * pair + 2] {
            let count = node.count;
            if let Some(item) = item(node.first) {
                items.write(item, &mut primitives[slot as usize..(slot + count) as usize]);
                node.first = slot.wrapping_add(offset);
            } else {
                pairs[pair_of(node.first)] = PairLeaves { slot, offset, depth: depth + 1 };
                node.count = 0;
            }
            slot += count;
        }
    }
    let mut remaining = &primitives[..];
    for own in root_leaves {
        let leaves;
        (leaves, remaining) = remaining.split_at(own.primitives.len());
        own.primitives.copy_from_slice(leaves);
    }
    max_depth
}
