//! Costs of all subtrees, bottom-up, and the leaves that they give (Goldsmith, Salmon, *Automatic Creation of Object
//! Hierarchies*, 1987).

use rayon::prelude::*;

use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::par_collect::zeros;
use crate::optimize::sah::{joined_cost, leaf_cost};
use crate::tree::statistics::TRAVERSAL_COST;
use crate::tree::{Container, Node};

/// Nodes that one task looks at, whose weights fit a core's second cache.
const CHUNK: usize = 16_384;

/// What is known of a node from what lies below.
#[derive(Debug, Clone, Copy, Default, bytemuck::Zeroable)]
pub struct Weight {
    /// SAH cost, not normalised.
    pub cost: f32,
    /// Number of primitives; 0 while it is not known.
    pub count: u32,
    /// Number of leaves.
    pub leaves: u32,
}

/// Weighs every node; parents come before children, and primitives stand from left to right. Where it `collapses`, a node that is
/// cheaper as a leaf becomes one, and nothing leads to those below it any more. Also returns the SAH cost as it was, not
/// normalised.
pub fn weigh<C: Container>(
    nodes: &mut [Node<C>],
    collapses: bool,
    token: &CancelToken,
) -> Result<(Vec<Weight>, f64), Cancelled> {
    let mut weights: Vec<Weight> = zeros(nodes.len(), token)?;
    // Each chunk by itself, backwards, which is fast as children are near their parents; some have theirs in later chunks.
    let chunks = nodes.par_chunks_mut(CHUNK).zip(weights.par_chunks_mut(CHUNK)).enumerate();
    let chunks = chunks.map(|(chunk, (nodes, weights))| {
        token.check()?;
        let offset = chunk * CHUNK;
        let (mut waiting, mut cost) = (Vec::new(), 0.0);
        for at in (0..nodes.len()).rev() {
            let node = &nodes[at];
            let first = node.first as usize;
            cost += f64::from(node_cost(node));
            let children = if node.is_leaf() { None } else { weights.get(first - offset..first - offset + 2) };
            let children = [0, 1].map(|side| children.map_or(Weight::default(), |pair| pair[side]));
            let known = children[0].count > 0 && children[1].count > 0;
            if known || node.is_leaf() {
                weights[at] = weight(nodes, offset, at, children, collapses);
            } else {
                waiting.push(offset + at);
            }
        }
        Ok((waiting, cost))
    });
    let chunks: Vec<(Vec<usize>, f64)> = chunks.collect::<Result<_, _>>()?;
    for &at in chunks.iter().rev().flat_map(|(waiting, _)| waiting) {
        let first = nodes[at].first as usize;
        weights[at] = weight(nodes, 0, at, [weights[first], weights[first + 1]], collapses);
    }
    Ok((weights, chunks.iter().map(|(_, cost)| cost).sum()))
}

/// SAH cost of the node alone.
#[inline(always)]
fn node_cost<C: Container>(node: &Node<C>) -> f32 {
    let area = node.container.relative_area();
    if node.is_leaf() { leaf_cost(area, node.count) } else { area * TRAVERSAL_COST }
}

/// The weight of the node at `at` in `nodes`, the first of which has the number `offset`, by those of its children.
#[inline(always)]
fn weight<C: Container>(
    nodes: &mut [Node<C>],
    offset: usize,
    at: usize,
    [left, right]: [Weight; 2],
    collapses: bool,
) -> Weight {
    let node = nodes[at];
    let area = node.container.relative_area();
    if node.is_leaf() {
        return Weight { cost: leaf_cost(area, node.count), count: node.count, leaves: 1 };
    }
    let count = left.count + right.count;
    let (cost, is_leaf) = joined_cost(area, count, left.cost + right.cost, collapses);
    if !is_leaf {
        return Weight { cost, count, leaves: left.leaves + right.leaves };
    }
    let mut first = node;
    while !first.is_leaf() {
        first = nodes[first.first as usize - offset];
    }
    (nodes[at].first, nodes[at].count) = (first.first, count);
    Weight { cost, count, leaves: 1 }
}
