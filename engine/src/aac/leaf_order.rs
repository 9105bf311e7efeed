//! Numbers the leaves of a tree whose nodes are all in place: from left to right, so that the primitives below any node
//! are neighbours.

use rayon::prelude::*;

use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::par_collect::zeros;
use crate::tree::statistics::Sums;
use crate::tree::{Container, Node};

/// The nodes that one task made.
pub struct TaskTree<'a, C> {
    /// Its part of the list of nodes. Leaves hold the number of their primitive in the input.
    pub nodes: &'a mut [Node<C>],
    /// Number of the first of these nodes.
    pub offset: usize,
    /// The first child of each cluster that it left; anything for a single primitive.
    pub roots: Vec<u32>,
}

/// What lies below one of a task's clusters.
#[derive(Default)]
struct Branch<'a> {
    /// Depth of the cluster.
    depth: u32,
    /// Number of its first leaf.
    first_leaf: u32,
    /// The primitives of its leaves.
    primitives: &'a mut [u32],
}

/// Numbers the leaves below `top`, the first nodes of the list, which refer to the tasks' clusters by numbers from
/// `top.len()` on. All nodes have their number of primitives, `count` at the root, which interior ones lose here.
/// Returns each leaf's primitive and the depth of the deepest leaf, and fills `sums`.
pub fn order_leaves<C: Container>(
    top: &mut [Node<C>],
    tasks: &mut [TaskTree<C>],
    count: usize,
    mut sums: Option<&mut Sums>,
    token: &CancelToken,
) -> Result<(Vec<u32>, u32), Cancelled> {
    let mut primitive_indices = zeros(count, token)?;
    let roots: Vec<u32> = tasks.iter().flat_map(|task| &task.roots).copied().collect();
    let mut branches: Vec<Branch> = roots.iter().map(|_| Branch::default()).collect();

    // The top, one node after the other from left to right.
    let (mut max_depth, mut first_leaf, mut rest) = (0, 0, &mut primitive_indices[..]);
    let top_len = top.len();
    let mut open = vec![(0, 0)];
    while let Some((at, depth)) = open.pop() {
        let node = &mut top[at];
        max_depth = max_depth.max(depth);
        if let Some(sums) = &mut sums {
            sums.add_nodes(std::slice::from_ref(node), depth);
        }
        if node.count > 1 && (node.first as usize) < top_len {
            let first = node.first as usize;
            node.count = 0;
            open.extend([(first + 1, depth + 1), (first, depth + 1)]);
            continue;
        }
        let primitives;
        (primitives, rest) = rest.split_at_mut(node.count as usize);
        let leaf = first_leaf;
        first_leaf += node.count;
        if node.count == 1 {
            primitives[0] = std::mem::replace(&mut node.first, leaf);
        } else {
            let root = node.first as usize - top_len;
            (node.first, node.count) = (roots[root], 0);
            branches[root] = Branch { depth, first_leaf: leaf, primitives };
        }
    }

    // What is below, each task by itself.
    let mut parts = Vec::with_capacity(tasks.len());
    let mut rest = &mut branches[..];
    for task in tasks {
        let own;
        (own, rest) = rest.split_at_mut(task.roots.len());
        parts.push((task, own));
    }
    let below = parts.into_par_iter().map(|(task, branches)| {
        token.check()?;
        if sums.is_none() {
            return Ok((order_task::<C, false>(task, branches, &mut Sums::default()), None));
        }
        let mut own = Sums::default();
        Ok((order_task::<C, true>(task, branches, &mut own), Some(own)))
    });
    let below: Vec<(u32, Option<Sums>)> = below.collect::<Result<_, Cancelled>>()?;
    let max_depth = below.iter().fold(max_depth, |deepest, (depth, _)| deepest.max(*depth));
    if let Some(sums) = sums {
        // In the order of the tasks, so that any number of threads gives the same.
        *sums = below.iter().filter_map(|(_, own)| own.as_ref()).fold(std::mem::take(sums), Sums::plus);
    }
    Ok((primitive_indices, max_depth))
}

/// What a pair of siblings learns from their parent.
#[derive(Clone, Copy, Default)]
struct Place {
    /// Number of the first leaf below them, within the task.
    leaf: u32,
    /// What is added to that for the number in the whole tree.
    offset: u32,
    depth: u32,
}

/// Numbers the leaves of `task`, whose clusters are `branches`, in one pass over its nodes as they lie in memory.
/// Returns the depth of the deepest leaf. Adds its nodes to `sums` where it shall.
fn order_task<C: Container, const SUMS: bool>(task: &mut TaskTree<C>, branches: &mut [Branch], sums: &mut Sums) -> u32 {
    let pair_of = |node: u32| (node as usize - task.offset) / 2;
    let mut places = vec![Place::default(); task.nodes.len() / 2];
    let mut count = 0;
    for (branch, root) in branches.iter().zip(&task.roots).filter(|(branch, _)| !branch.primitives.is_empty()) {
        places[pair_of(*root)] =
            Place { leaf: count, offset: branch.first_leaf.wrapping_sub(count), depth: branch.depth + 1 };
        count += branch.primitives.len() as u32;
    }
    let mut primitives = vec![0; count as usize];
    let mut max_depth = 0;
    for at in 0..places.len() {
        let Place { mut leaf, offset, depth } = places[at];
        max_depth = max_depth.max(depth);
        if SUMS {
            sums.add_nodes(&task.nodes[2 * at..2 * at + 2], depth);
        }
        for node in &mut task.nodes[2 * at..2 * at + 2] {
            let count = node.count;
            if count == 1 {
                primitives[leaf as usize] = std::mem::replace(&mut node.first, leaf.wrapping_add(offset));
            } else {
                places[pair_of(node.first)] = Place { leaf, offset, depth: depth + 1 };
                node.count = 0;
            }
            leaf += count;
        }
    }
    let mut rest = &primitives[..];
    for branch in branches {
        let own;
        (own, rest) = rest.split_at(branch.primitives.len());
        branch.primitives.copy_from_slice(own);
    }
    max_depth
}
