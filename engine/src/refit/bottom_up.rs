//! One pass over all nodes, children before parents, on all threads.
//!
//! Nodes are divided into chunks as they lie in memory. In each, the nodes are done whose descendants lie in it too; of a tree in
//! depth-first order these are all but a path of them. The others, listed as pending, follow on one thread.

#![allow(clippy::inline_always, reason = "called for each node")]

use crate::aac::ClusterContainer;
use crate::cancel::{CancelToken, Cancelled, HEAVY_STEPS};
use crate::geometry::Triangle;
use crate::kernel::parallel::par_tasks_with;
use crate::kernel::prefetch::prefetch_whole;
use crate::tree::{Container, Node, Tree};

/// Nodes of a chunk: 256 kB, which fit a core's second-level cache, and few nodes reach beyond. Even, so that siblings of a binary tree lie
/// in the same chunk.
const CHUNK: usize = 1 << 13;

/// Number of leaves ahead of which triangles are prefetched.
const LEAVES_AHEAD: usize = 12;

/// Fits an interior node of a part of a tree, all of whose descendants are done. A trait rather than a closure, so that it is inlined.
pub(super) trait FitInterior<C>: Sync {
    /// Fits the node `index` of a part of a tree, whose first node has the index `offset`. All of the node's descendants lie in the part;
    /// their order in it may be changed, as long as the node has the same descendants.
    fn fit(&self, nodes: &mut [Node<C>], offset: usize, index: usize);
}

/// Fits the container of an interior node to its children.
pub(super) struct ToChildren;

impl<C: Container> FitInterior<C> for ToChildren {
    #[inline(always)]
    fn fit(&self, nodes: &mut [Node<C>], offset: usize, index: usize) {
        let Node { first, count, .. } = nodes[index];
        let first = first as usize - offset;
        // Nearly all trees are binary.
        let container = match nodes.get(first..first + 2) {
            Some([left, right]) if count == 0 => left.container.union(&right.container),
            _ => {
                let others = nodes[first + 1..first + nodes[index].arity() as usize].iter();
                others.fold(nodes[first].container, |all, child| all.union(&child.container))
            }
        };
        nodes[index].container = container;
    }
}

/// The triangles of a tree.
struct Leaves<'a, K> {
    triangles: &'a [Triangle],
    indices: &'a [u32],
    /// Makes the container of a leaf from the leaf and the container of its triangles.
    keep: &'a K,
}

impl<K> Leaves<'_, K> {
    #[inline(always)]
    fn fit<C: ClusterContainer>(&self, node: &Node<C>) -> C
    where
        K: Fn(&Node<C>, C) -> C,
    {
        let around = |slot: u32| C::of_triangle(&self.triangles[self.indices[slot as usize] as usize]);
        let others = node.first + 1..node.first + node.count;
        (self.keep)(node, others.fold(around(node.first), |all, slot| all.union(&around(slot))))
    }

    #[inline(always)]
    fn prefetch<C>(&self, node: &Node<C>) {
        prefetch_whole(self.triangles, self.indices[node.first as usize] as usize);
    }
}

/// Fits the leaves of a tree by what `keep` makes of a leaf and the container of its triangles, then interior nodes by `interior`, children
/// before parents.
pub(super) fn fit<C: ClusterContainer>(
    tree: &mut Tree<C>,
    triangles: &[Triangle],
    keep: impl Fn(&Node<C>, C) -> C + Sync,
    interior: &impl FitInterior<C>,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    token.begin_stage("refit");
    let leaves = Leaves { triangles, indices: &tree.primitive_indices, keep: &keep };
    let nodes = &mut tree.nodes[..];
    let Some((_, below_root)) = nodes.split_first_mut() else { return Ok(()) };
    let chunks = below_root.chunks_mut(CHUNK).enumerate();
    let pending = par_tasks_with(chunks, token, Lists::default, |lists, (chunk, nodes), _| {
        Ok(lists.fit(nodes, 1 + chunk * CHUNK, &leaves, interior))
    })?;
    for (at, &index) in pending.iter().rev().flatten().enumerate() {
        token.check_every(HEAVY_STEPS, at)?;
        interior.fit(nodes, 0, index as usize);
    }
    if nodes[0].is_leaf() {
        nodes[0].container = leaves.fit(&nodes[0]);
    } else {
        interior.fit(nodes, 0, 0);
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
        Self { leaves: vec![0; CHUNK], interior: vec![0; CHUNK], is_pending: vec![false; CHUNK] }
    }
}

impl Lists {
    /// Does all nodes whose descendants lie in the chunk, and returns the others, the last one first.
    #[inline(always)]
    fn fit<C: ClusterContainer, K: Fn(&Node<C>, C) -> C>(
        &mut self,
        nodes: &mut [Node<C>],
        offset: usize,
        fitter: &Leaves<'_, K>,
        fit_interior: &impl FitInterior<C>,
    ) -> Vec<u32> {
        let (leaves, interior) = (&mut self.leaves[..CHUNK], &mut self.interior[..CHUNK]);
        // Both lists first: a branch for each node could not be predicted. The masks, which change nothing, spare tests of bounds.
        let (mut leaf_count, mut interior_count) = (0, 0);
        for (at, node) in nodes.iter().enumerate() {
            leaves[leaf_count & (CHUNK - 1)] = at as u16;
            interior[interior_count & (CHUNK - 1)] = at as u16;
            leaf_count += usize::from(node.is_leaf());
            interior_count += usize::from(!node.is_leaf());
        }
        let leaves = &leaves[..leaf_count];
        let mut ahead = leaves.iter().skip(LEAVES_AHEAD);
        for &at in leaves {
            if let Some(&ahead) = ahead.next() {
                fitter.prefetch(&nodes[usize::from(ahead)]);
            }
            let node = &mut nodes[usize::from(at)];
            node.container = fitter.fit(node);
        }
        let is_pending = &mut self.is_pending[..nodes.len()];
        is_pending.fill(false);
        let mut pending = Vec::new();
        for &at in interior[..interior_count].iter().rev() {
            let at = usize::from(at);
            let first = (nodes[at].first as usize).wrapping_sub(offset);
            let is_done = match is_pending.get(first..first.wrapping_add(2)) {
                Some([left, right]) if nodes[at].count == 0 => !(left | right),
                _ => {
                    let children = is_pending.get(first..first.wrapping_add(nodes[at].arity() as usize));
                    children.is_some_and(|children| !children.contains(&true))
                }
            };
            if is_done {
                fit_interior.fit(nodes, offset, at);
            } else {
                is_pending[at] = true;
                pending.push((offset + at) as u32);
            }
        }
        pending
    }
}
