//! Reinsertion: moves subtrees to where they cost less (Meister, Bittner, *Parallel Reinsertion for Bounding Volume
//! Hierarchy Optimization*, 2018). Each round searches in parallel for the best moves of the most inefficient subtrees,
//! then applies them in order of gain, each only if no node that it touches has changed in this round and the cost
//! still falls. So the cost never rises, and the tree is the same for any number of threads.

mod candidates;
mod linked_tree;

use std::collections::HashSet;

use rayon::prelude::*;

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Aabb;
use crate::optimize::move_search::{LinkedNodes, Move, find_move};
use crate::optimize::reinsert::linked_tree::{LinkedTree, sibling};
use crate::tree::Node;
use crate::tree::statistics::TRAVERSAL_COST;

/// Maximum number of rounds: on architecture a sixth still gains a thousandth.
const MAX_ROUNDS: u32 = 5;
/// Minimum gain of a round, as a fraction of the cost, for another to follow.
const MIN_GAIN: f64 = 2e-3;
/// Number of primitives per subtree searched in each round: half as many gain two thousandths more in twice the time.
const PRIMITIVES_PER_CANDIDATE: usize = 40;
/// Number of eligible subtrees per candidate of a round. They are selected once, because moves change few scores, and
/// scoring all subtrees again takes longer than the search.
const ELIGIBLE_PER_CANDIDATE: usize = 2;
/// Maximum number of nodes that one search visits. On architecture, from median splits, the longest visits some hundred.
const MAX_VISITS: u32 = 1 << 10;
/// Poll for cancellation every 256 candidates or moves.
const CANDIDATES_BETWEEN_CHECKS: usize = 256;

/// Moves subtrees of a tree of this SAH `cost` over `primitives` primitives to better positions. `nodes` may be in any
/// order with siblings together, before and after. Returns the reduction of the cost.
pub fn reinsert(nodes: &mut [Node<Aabb>], primitives: usize, cost: f64, token: &CancelToken) -> Result<f64, Cancelled> {
    let mut tree = LinkedTree::new(nodes, token)?;
    // Nodes changed in this round.
    let mut changed = HashSet::new();
    let mut undo = Vec::new();
    let mut total = 0.0;
    let max_count = primitives.div_ceil(PRIMITIVES_PER_CANDIDATE);
    // Nodes below the average cost of a primitive are too small to matter.
    let eligible = tree.eligible(max_count * ELIGIBLE_PER_CANDIDATE, (cost / primitives as f64) as f32, token)?;
    for _ in 0..MAX_ROUNDS {
        token.check()?;
        changed.clear();
        let candidates = tree.candidates(&eligible, max_count);
        let found: Vec<Vec<Move>> = candidates
            .par_chunks(CANDIDATES_BETWEEN_CHECKS)
            .map(|batch| {
                token.check()?;
                let mut stack = Vec::new();
                Ok(batch.iter().filter_map(|&node| find_move(&tree, node, 0.0, MAX_VISITS, &mut stack)).collect())
            })
            .collect::<Result<_, _>>()?;
        let mut moves: Vec<Move> = found.into_iter().flatten().collect();
        moves.sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.node.cmp(&b.node)));
        let mut gain = 0.0;
        for (at, Move { node, target, .. }) in moves.into_iter().enumerate() {
            if at % CANDIDATES_BETWEEN_CHECKS == 0 {
                token.check()?;
            }
            let touched = [tree.parent(node), node, sibling(node), target];
            let is_stale = touched.iter().any(|index| changed.contains(index));
            // An earlier move may have put one below the other.
            if is_stale || tree.is_ancestor_or_self(node, target) || tree.is_ancestor_or_self(target, node) {
                continue;
            }
            if let Some(reduction) = tree.apply(node, target, &mut undo) {
                gain += reduction * f64::from(TRAVERSAL_COST);
                changed.extend(touched);
            }
        }
        total += gain;
        if gain < cost * MIN_GAIN {
            break;
        }
    }
    Ok(total)
}
