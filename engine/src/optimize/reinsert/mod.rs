//! Reinsertion: moves subtrees to where they cost less (Meister, Bittner, *Parallel Reinsertion for Bounding Volume
//! Hierarchy Optimization*, 2018); a move is drawn in [`move_search`](crate::optimize::move_search). Each round searches in
//! parallel for the best moves of the most inefficient subtrees, then applies them in order of gain, each only if no node that
//! it touches has changed in this round and the cost still falls. Every few rounds the largest treelets get their best
//! topologies. So the cost never rises, and the tree is the same for any number of threads.

mod candidates;
mod linked_tree;
mod treelets;

use std::collections::HashSet;

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Aabb;
use crate::kernel::parallel::par_tasks_with;
use crate::optimize::move_search::{LinkedNodes, Move, find_move};
use crate::optimize::reinsert::linked_tree::{LinkedTree, sibling};
use crate::optimize::simd_box::NodeBounds;
use crate::tree::Node;
use crate::tree::statistics::TRAVERSAL_COST;

/// Effort of reinsertion.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Maximum number of rounds.
    pub max_rounds: u32,
    /// Minimum gain of a round, as a fraction of the cost, for another to follow.
    pub min_gain: f64,
    /// Number of primitives per subtree searched in each round.
    pub primitives_per_candidate: usize,
}

impl Effort {
    /// Of the pass over a finished tree. On Sponza the eighth round still gains two thousandths; more rounds of fewer candidates gain more
    /// in the same time.
    pub const PASS: Self = Self { max_rounds: 8, min_gain: 2e-3, primitives_per_candidate: 80 };
}

/// Number of eligible subtrees per candidate of a round. They are selected once, because moves change few scores, and
/// scoring all subtrees again takes longer than the search.
const ELIGIBLE_PER_CANDIDATE: usize = 4;
/// Factor of a subtree's score for each search in a row that finds no move: from a quarter to 0.7 costs the same.
const FAILURE_WEIGHT: f32 = 0.5;
/// The largest treelets are optimized after the second of each this number of rounds: on Sponza that gains half a percent,
/// more than as much time of reinsertion.
const ROUNDS_PER_TREELETS: u32 = 3;
/// Maximum number of nodes that one search visits. On architecture, from median splits, the longest visits some hundred.
const MAX_VISITS: u32 = 1 << 10;
/// Poll for cancellation every 256 candidates or moves.
const CANDIDATES_BETWEEN_CHECKS: usize = 256;

/// Moves subtrees of a tree of this SAH `cost` over `primitives` primitives to better positions. `nodes` may be in any
/// order with siblings together, before and after. Returns the reduction of the cost.
pub fn reinsert<B: NodeBounds>(
    nodes: &mut [Node<B>],
    primitives: usize,
    cost: f64,
    effort: Effort,
    token: &CancelToken,
) -> Result<f64, Cancelled> {
    let mut tree = LinkedTree::new(nodes, token)?;
    let mut total = 0.0;
    let max_count = primitives.div_ceil(effort.primitives_per_candidate);
    let average_cost = (cost / primitives as f64) as f32;
    // Nodes below the average cost of a primitive are too small to matter.
    let eligible = tree.eligible(max_count * ELIGIBLE_PER_CANDIDATE, average_cost, token)?;
    let mut weights = vec![1.0; eligible.len()];
    for round in 0..effort.max_rounds {
        token.check()?;
        let candidates = tree.candidates(&eligible, &weights, max_count);
        let found = find_moves(&tree, &eligible, &candidates, token)?;
        for (&candidate, found) in candidates.iter().zip(&found) {
            let weight = &mut weights[candidate as usize];
            *weight = if found.is_some() { 1.0 } else { *weight * FAILURE_WEIGHT };
        }
        let mut gain = apply_moves(&mut tree, found.into_iter().flatten().collect(), token)?;
        if round % ROUNDS_PER_TREELETS == 1 {
            gain += tree.optimize_treelets(average_cost, token)?;
        }
        gain *= f64::from(TRAVERSAL_COST);
        total += gain;
        if gain < cost * effort.min_gain {
            break;
        }
    }
    Ok(total)
}

/// Moves up to `max_moves` of the subtrees whose parents are the most inefficient to their best positions, in one round. `nodes` may be in
/// any order with siblings together, before and after. Returns the reduction of the summed area of interior nodes.
pub fn reinsert_worst(nodes: &mut [Node<Aabb>], max_moves: usize, token: &CancelToken) -> Result<f64, Cancelled> {
    if nodes.len() < 2 {
        return Ok(0.0);
    }
    let mut tree = LinkedTree::new(nodes, token)?;
    let worst = tree.eligible(max_moves, 0.0, token)?;
    let all: Vec<u32> = (0..worst.len() as u32).collect();
    let moves = find_moves(&tree, &worst, &all, token)?;
    apply_moves(&mut tree, moves.into_iter().flatten().collect(), token)
}

/// The best move, if there is any, of each of the `candidates`, which are positions in `eligible`.
fn find_moves<B: NodeBounds>(
    tree: &LinkedTree<B>,
    eligible: &[u32],
    candidates: &[u32],
    token: &CancelToken,
) -> Result<Vec<Option<Move>>, Cancelled> {
    let batches = candidates.chunks(CANDIDATES_BETWEEN_CHECKS);
    let batches: Vec<Vec<Option<Move>>> = par_tasks_with(batches, token, Vec::new, |stack, batch, _| {
        Ok(batch.iter().map(|&at| find_move(tree, eligible[at as usize], 0.0, MAX_VISITS, stack)).collect())
    })?;
    Ok(batches.concat())
}

/// Applies `moves` in order of gain. Returns the reduction of the summed area of interior nodes.
fn apply_moves<B: NodeBounds>(
    tree: &mut LinkedTree<B>,
    mut moves: Vec<Move>,
    token: &CancelToken,
) -> Result<f64, Cancelled> {
    moves.sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.node.cmp(&b.node)));
    let (mut changed, mut undo, mut gain) = (HashSet::new(), Vec::new(), 0.0);
    for (at, Move { node, target, .. }) in moves.into_iter().enumerate() {
        token.check_every(CANDIDATES_BETWEEN_CHECKS, at)?;
        let touched = [tree.parent(node), node, sibling(node), target];
        let is_stale = touched.iter().any(|index| changed.contains(index));
        // An earlier move may have put one below the other.
        if is_stale || tree.is_ancestor_or_self(node, target) || tree.is_ancestor_or_self(target, node) {
            continue;
        }
        if let Some(reduction) = tree.apply(node, target, &mut undo) {
            gain += reduction;
            changed.extend(touched);
        }
    }
    Ok(gain)
}
