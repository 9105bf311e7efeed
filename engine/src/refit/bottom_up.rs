//! One pass over all nodes, children before parents, on all threads.
//!
//! Nodes are divided into chunks as they lie in memory. In each, the nodes are done whose descendants lie in it too; of a tree in
//! depth-first order these are all but a path of them. The others, listed as pending, follow on one thread.

#![allow(clippy::inline_always, reason = "called for each node")]

use rayon::prelude::*;

use crate::aac::ClusterContainer;
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::kernel::prefetch::prefetch_whole;
use crate::tree::{Container, Node, Tree};

/// Nodes of a chunk: 256 kB, which fit a core's second-level cache, and few nodes reach beyond. Even, so that siblings of a binary tree lie
/// in the same chunk.
const CHUNK: usize = 1 << 13;

/// Number of leaves ahead of which triangles are prefetched.
const LEAVES_AHEAD: usize = 12;

/// Nodes that one thread does between two polls for cancellation.
const NODES_BETWEEN_CHECKS: usize = 1 << 12;

impl<C: Container> Node<C> {
    /// Fits the container of the interior node `index` of a part of a tree, whose first node has the index `offset`, to its children.
    #[inline(always)]
    pub(super) fn fit_to_children(nodes: &mut [Self], offset: usize, index: usize) {
        let first = nodes[index].first as usize - offset;
        let children = &nodes[first..first + nodes[index].arity() as usize];
        // Nearly all trees are binary.
        nodes[index].container = match children {
            [left, right] => left.container.union(&right.container),
            [first, others @ ..] => others.iter().fold(first.container, |all, child| all.union(&child.container)),
            [] => return,
        };
    }
}

/// Fits the leaves of a tree by what `keep` makes of a leaf and the container of its triangles, and interior nodes by `interior`, all of
/// whose descendants are done then; see [`fit_bottom_up`].
pub(super) fn fit<C: ClusterContainer>(
    tree: &mut Tree<C>,
    triangles: &[Triangle],
    keep: impl Fn(&Node<C>, C) -> C + Sync,
    interior: impl Fn(&mut [Node<C>], usize, usize) + Sync,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    token.begin_stage("refit");
    let indices = &tree.primitive_indices;
    let around = |slot: usize| C::of_triangle(&triangles[indices[slot] as usize]);
    let leaf = |node: &Node<C>| {
        let first = node.first as usize;
        let others = first + 1..first + node.count as usize;
        keep(node, others.fold(around(first), |all, slot| all.union(&around(slot))))
    };
    let prefetch_leaf = |node: &Node<C>| prefetch_whole(triangles, indices[node.first as usize] as usize);
    fit_bottom_up(&mut tree.nodes, leaf, prefetch_leaf, interior, token)
}

/// Gives each leaf the container that `leaf` returns, and calls `interior` for each interior node once all of its descendants are done:
/// with a part of the nodes, the index of its first node, and the place of the node in it. All of the node's descendants lie in the part; their
/// order in it may be changed, as long as the node has the same descendants.
fn fit_bottom_up<C: Copy + Send + Sync>(
    nodes: &mut [Node<C>],
    leaf: impl Fn(&Node<C>) -> C + Sync,
    prefetch_leaf: impl Fn(&Node<C>) + Sync,
    interior: impl Fn(&mut [Node<C>], usize, usize) + Sync,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    let Some((_, below_root)) = nodes.split_first_mut() else { return Ok(()) };
    let fork = token.fork();
    let chunks = below_root.par_chunks_mut(CHUNK).enumerate().map_init(Lists::default, |lists, (chunk, nodes)| {
        fork.task(|token| {
            token.check()?;
            Ok(lists.fit(nodes, 1 + chunk * CHUNK, &leaf, &prefetch_leaf, &interior))
        })
    });
    let pending: Vec<Vec<u32>> = chunks.collect::<Result<_, Cancelled>>()?;
    fork.join();
    for (at, &index) in pending.iter().rev().flatten().enumerate() {
        if at.is_multiple_of(NODES_BETWEEN_CHECKS) {
            token.check()?;
        }
        interior(nodes, 0, index as usize);
    }
    if nodes[0].is_leaf() {
        nodes[0].container = leaf(&nodes[0]);
    } else {
        interior(nodes, 0, 0);
    }
    Ok(())
}

/// Leaves and interior nodes of a chunk, by their places in it.
struct Lists {
    leaves: Vec<u16>,
    interior: Vec<u16>,
    is_pending: Vec<bool>,
}

impl Default for Lists {
    fn default() -> Self {
        Self { leaves: vec![0; CHUNK + 1], interior: vec![0; CHUNK + 1], is_pending: vec![false; CHUNK] }
    }
}

impl Lists {
    /// Does all nodes whose descendants lie in the chunk, and returns the others, the last one first.
    #[inline(always)]
    fn fit<C: Copy>(
        &mut self,
        nodes: &mut [Node<C>],
        offset: usize,
        leaf: impl Fn(&Node<C>) -> C,
        prefetch_leaf: impl Fn(&Node<C>),
        interior: impl Fn(&mut [Node<C>], usize, usize),
    ) -> Vec<u32> {
        // Both lists first: a branch for each node could not be predicted.
        let (mut leaf_count, mut interior_count) = (0, 0);
        for (at, node) in nodes.iter().enumerate() {
            self.leaves[leaf_count] = at as u16;
            self.interior[interior_count] = at as u16;
            leaf_count += usize::from(node.is_leaf());
            interior_count += usize::from(!node.is_leaf());
        }
        let leaves = &self.leaves[..leaf_count];
        for (k, &at) in leaves.iter().enumerate() {
            if let Some(&ahead) = leaves.get(k + LEAVES_AHEAD) {
                prefetch_leaf(&nodes[usize::from(ahead)]);
            }
            let node = &mut nodes[usize::from(at)];
            node.container = leaf(node);
        }
        self.is_pending.fill(false);
        let mut pending = Vec::new();
        for &at in self.interior[..interior_count].iter().rev() {
            let at = usize::from(at);
            let first = (nodes[at].first as usize).wrapping_sub(offset);
            let end = first.wrapping_add(nodes[at].arity() as usize);
            let is_pending = match self.is_pending.get(first..end).filter(|_| end <= nodes.len()) {
                Some([left, right]) => left | right,
                Some(children) => children.contains(&true),
                None => true,
            };
            if is_pending {
                self.is_pending[at] = true;
                pending.push((offset + at) as u32);
            } else {
                interior(nodes, offset, at);
            }
        }
        pending
    }
}
