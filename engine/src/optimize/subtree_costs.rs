//! Costs of all subtrees, bottom-up, and leaf collapse (Goldsmith, Salmon, *Automatic Creation of Object Hierarchies
//! for Ray Tracing*, 1987).

use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::parallel::{par_tasks, zeros};
use crate::optimize::sah::{leaf_cost, node_or_leaf_cost};
use crate::tree::{Container, Node};

/// Number of nodes per task, whose costs fit a core's second-level cache.
const CHUNK_NODES: usize = 16_384;

/// Cost and size of a subtree.
#[derive(Debug, Clone, Copy, Default, bytemuck::Zeroable)]
pub struct SubtreeCost {
    /// SAH cost, not normalised.
    pub cost: f32,
    /// Number of primitives; 0 while unknown.
    pub count: u32,
    /// Number of leaves.
    pub leaves: u32,
}

/// Computes the cost of every subtree. Parents must precede their children, and primitives be in leaf order. If
/// `collapses`, nodes that are cheaper as leaves become leaves, and those below become unreachable. Also returns the
/// SAH cost before that, not normalised.
pub fn subtree_costs<C: Container>(
    nodes: &mut [Node<C>],
    collapses: bool,
    token: &CancelToken,
) -> Result<(Vec<SubtreeCost>, f64), Cancelled> {
    let mut costs: Vec<SubtreeCost> = zeros(nodes.len(), token)?;
    // Chunks backwards and independently: most children are near their parents, and those in later chunks are handled
    // below.
    let chunks = nodes.chunks_mut(CHUNK_NODES).zip(costs.chunks_mut(CHUNK_NODES)).enumerate();
    let chunks = par_tasks(chunks, token, |(chunk, (nodes, costs)), _| {
        let offset = chunk * CHUNK_NODES;
        let (mut pending, mut cost) = (Vec::new(), 0.0);
        for index in (0..nodes.len()).rev() {
            let node = &nodes[index];
            let first = node.first as usize;
            cost += f64::from(node_cost(node));
            let children = if node.is_leaf() { None } else { costs.get(first - offset..first - offset + 2) };
            let children = [0, 1].map(|side| children.map_or(SubtreeCost::default(), |pair| pair[side]));
            let is_complete = children[0].count > 0 && children[1].count > 0;
            if is_complete || node.is_leaf() {
                costs[index] = collapse_node(nodes, offset, index, children, collapses);
            } else {
                pending.push(offset + index);
            }
        }
        Ok((pending, cost))
    })?;
    for &index in chunks.iter().rev().flat_map(|(pending, _)| pending) {
        let first = nodes[index].first as usize;
        costs[index] = collapse_node(nodes, 0, index, [costs[first], costs[first + 1]], collapses);
    }
    Ok((costs, chunks.iter().map(|(_, cost)| cost).sum()))
}

/// SAH cost of the node alone.
#[inline(always)]
fn node_cost<C: Container>(node: &Node<C>) -> f32 {
    let area = node.container.relative_area();
    if node.is_leaf() { leaf_cost(area, node.count) } else { area * C::KIND.traversal_cost() }
}

/// Cost of the subtree under node `index` from those of its children; `nodes[0]` has index `offset` in the tree. The
/// node becomes a leaf if that is cheaper and `collapses`.
#[inline(always)]
fn collapse_node<C: Container>(
    nodes: &mut [Node<C>],
    offset: usize,
    index: usize,
    [left, right]: [SubtreeCost; 2],
    collapses: bool,
) -> SubtreeCost {
    let node = nodes[index];
    let area = node.container.relative_area();
    if node.is_leaf() {
        return SubtreeCost { cost: leaf_cost(area, node.count), count: node.count, leaves: 1 };
    }
    let count = left.count + right.count;
    let (cost, is_leaf) = node_or_leaf_cost::<C>(area, count, left.cost + right.cost, collapses);
    if !is_leaf {
        return SubtreeCost { cost, count, leaves: left.leaves + right.leaves };
    }
    let mut first = node;
    while !first.is_leaf() {
        first = nodes[first.first as usize - offset];
    }
    (nodes[index].first, nodes[index].count) = (first.first, count);
    SubtreeCost { cost, count, leaves: 1 }
}
