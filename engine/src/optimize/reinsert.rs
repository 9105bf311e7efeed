//! Reinsertion: moves subtrees to where they cost less (Meister, Bittner, *Parallel Reinsertion for Bounding Volume
//! Hierarchy Optimization*, 2018). Each round searches in parallel for the best moves of the most inefficient subtrees,
//! then applies them in order of gain, each only if no node that it touches has changed in this round and the cost
//! still falls. So the cost never rises, and the tree is the same for any number of threads.

use std::collections::{HashSet, VecDeque};
use std::sync::atomic::{AtomicU32, Ordering};

use glam::Vec3A;
use rayon::prelude::*;

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Aabb;
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
/// Poll for cancellation every 256 candidates.
const CANDIDATES_BETWEEN_CHECKS: usize = 256;
/// Poll for cancellation every 65536 nodes where little else is done with them.
const NODES_BETWEEN_CHECKS: usize = 1 << 16;
/// Number of nodes that are scored sequentially before the subtrees below are scored in parallel.
const TOP_NODES: usize = 256;
/// Number of scores sampled to estimate the threshold of the best.
const SAMPLES: usize = 4096;
/// No node.
const NONE: u32 = u32::MAX;

/// A subtree and its new position.
#[derive(Debug, Clone, Copy)]
struct Move {
    /// Reduction of the summed area of interior nodes.
    gain: f32,
    node: u32,
    /// The new sibling.
    target: u32,
}

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
    let eligible = tree.eligible(max_count * ELIGIBLE_PER_CANDIDATE, (cost / primitives as f64) as f32);
    for _ in 0..MAX_ROUNDS {
        token.check()?;
        changed.clear();
        let candidates = tree.candidates(&eligible, max_count);
        let found: Vec<Vec<Move>> = candidates
            .par_chunks(CANDIDATES_BETWEEN_CHECKS)
            .map(|batch| {
                token.check()?;
                let mut stack = Vec::new();
                Ok(batch.iter().filter_map(|&node| tree.find_move(node, &mut stack)).collect())
            })
            .collect::<Result<_, _>>()?;
        let mut moves: Vec<Move> = found.into_iter().flatten().collect();
        moves.sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.node.cmp(&b.node)));
        let mut gain = 0.0;
        for Move { node, target, .. } in moves {
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

/// The `max_count` elements of `lists` with the largest scores, and few others; all if there are no more.
fn prefilter(lists: &[Vec<(f32, u32)>], max_count: usize) -> Vec<(f32, u32)> {
    let len: usize = lists.iter().map(Vec::len).sum();
    // Estimate the threshold from a sample.
    let step = (len / SAMPLES).max(1);
    let mut sample: Vec<f32> = lists.iter().flatten().step_by(step).map(|candidate| candidate.0).collect();
    let rank = max_count * 5 / 4 / step + SAMPLES / 64;
    if rank < sample.len() {
        let (_, &mut threshold, _) = sample.select_nth_unstable_by(rank, |a, b| b.total_cmp(a));
        let large: Vec<Vec<(f32, u32)>> = lists
            .par_iter()
            .map(|list| list.iter().filter(|candidate| candidate.0 >= threshold).copied().collect())
            .collect();
        if large.iter().map(Vec::len).sum::<usize>() >= max_count {
            return large.concat();
        }
    }
    lists.concat()
}

/// The nodes with the `max_count` largest scores, sorted by index, because neighbours search the same nodes.
fn best(mut scored: Vec<(f32, u32)>, max_count: usize) -> Vec<u32> {
    if scored.len() > max_count {
        scored.select_nth_unstable_by(max_count, |a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        scored.truncate(max_count);
    }
    let mut nodes: Vec<u32> = scored.into_iter().map(|candidate| candidate.1).collect();
    nodes.sort_unstable();
    nodes
}

/// The other child of the parent: pairs begin at odd indices.
#[inline(always)]
fn sibling(node: u32) -> u32 {
    ((node - 1) ^ 1) + 1
}

/// A box in SIMD registers.
#[derive(Debug, Clone, Copy)]
struct SimdBox {
    min: Vec3A,
    max: Vec3A,
}

impl SimdBox {
    const EMPTY: Self = Self { min: Vec3A::INFINITY, max: Vec3A::NEG_INFINITY };

    #[inline(always)]
    fn new(container: &Aabb) -> Self {
        Self { min: container.min.into(), max: container.max.into() }
    }

    #[inline(always)]
    fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Half the surface area; the box must not be empty.
    #[inline(always)]
    fn half_area(&self) -> f32 {
        let d = self.max - self.min;
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

/// A tree with parent links.
struct LinkedTree<'a> {
    nodes: &'a mut [Node<Aabb>],
    /// For each pair of siblings the parent. Filled by many threads, later changed by one only.
    parents: Vec<AtomicU32>,
}

impl<'a> LinkedTree<'a> {
    fn new(nodes: &'a mut [Node<Aabb>], token: &CancelToken) -> Result<Self, Cancelled> {
        let parents: Vec<AtomicU32> = (0..nodes.len() / 2).map(|_| AtomicU32::new(NONE)).collect();
        nodes.par_chunks(NODES_BETWEEN_CHECKS).enumerate().try_for_each(|(chunk, chunk_nodes)| {
            token.check()?;
            for (index, node) in (chunk * NODES_BETWEEN_CHECKS..).zip(chunk_nodes) {
                if !node.is_leaf() {
                    parents[node.first as usize / 2].store(index as u32, Ordering::Relaxed);
                }
            }
            Ok(())
        })?;
        Ok(Self { nodes, parents })
    }

    /// The parent of `node`; [`NONE`] for the root.
    #[inline(always)]
    fn parent(&self, node: u32) -> u32 {
        if node == 0 { NONE } else { self.parents[(node as usize - 1) / 2].load(Ordering::Relaxed) }
    }

    #[inline(always)]
    fn bounds(&self, node: u32) -> SimdBox {
        SimdBox::new(&self.nodes[node as usize].container)
    }

    /// The `max_count` nodes with the most inefficient parents, out of those whose parents have an area of at least
    /// `min_area`.
    fn eligible(&self, max_count: usize, min_area: f32) -> Vec<u32> {
        // The root's children could only move below each other.
        let root = &self.nodes[0];
        let mut queue = VecDeque::from(if root.is_leaf() { Vec::new() } else { vec![root.first, root.first + 1] });
        let mut scored: Vec<(f32, u32)> = Vec::new();
        // A few nodes at the top sequentially, then everything below in parallel.
        for _ in 0..TOP_NODES {
            let Some(index) = queue.pop_front() else { break };
            queue.extend(self.score(index, min_area, &mut scored).into_iter().flatten());
        }
        let lists = Vec::from(queue).into_par_iter().map(|top| {
            // Breadth first, so that loads do not depend on one another.
            let (mut scored, mut queue, mut next) = (Vec::new(), vec![top], 0);
            while let Some(&index) = queue.get(next) {
                queue.extend(self.score(index, min_area, &mut scored).into_iter().flatten());
                next += 1;
            }
            scored
        });
        let mut lists: Vec<_> = lists.collect();
        lists.push(scored);
        best(prefilter(&lists, max_count), max_count)
    }

    /// The `max_count` of `eligible` whose parents are the most inefficient now.
    fn candidates(&self, eligible: &[u32], max_count: usize) -> Vec<u32> {
        let scored = eligible.par_iter().map(|&node| (self.inefficiency(self.parent(node)), node)).collect();
        best(scored, max_count)
    }

    /// Scores the children of node `index`, if its area is large enough, and returns them.
    #[inline(always)]
    fn score(&self, index: u32, min_area: f32, scored: &mut Vec<(f32, u32)>) -> Option<[u32; 2]> {
        let node = &self.nodes[index as usize];
        if node.is_leaf() || node.container.half_area() < min_area {
            return None;
        }
        let pair = [node.first, node.first + 1];
        let inefficiency = self.inefficiency(index);
        if inefficiency > 0.0 {
            scored.extend(pair.map(|child| (inefficiency, child)));
        }
        Some(pair)
    }

    /// Inefficiency of the interior node `index`: the product of its area and the ratios of its area to the mean and to
    /// the smallest area of its children, up to a constant factor (Bittner, Hapala, Havran, *Fast Insertion-Based
    /// Optimization of Bounding Volume Hierarchies*, 2013).
    #[inline(always)]
    fn inefficiency(&self, index: u32) -> f32 {
        let area = self.bounds(index).half_area();
        let first = self.nodes[index as usize].first;
        let [left, right] = [first, first + 1].map(|child| self.bounds(child).half_area());
        // Avoids division by zero for flat containers.
        area * (area / (left + right + 1e-6 * area)) * (area / (left.min(right) + 1e-3 * area))
    }

    /// The best new position of `node`, if any is better than the present one: branch and bound over the siblings of
    /// its ancestors and everything below them.
    fn find_move(&self, node: u32, stack: &mut Vec<(f32, u32)>) -> Option<Move> {
        let bounds = self.bounds(node);
        let area = bounds.half_area();
        let parent = self.parent(node);
        let mut best = Move { gain: 0.0, node, target: NONE };
        // Gain of removing the node: its parent vanishes, and all ancestors shrink.
        let mut freed = self.bounds(parent).half_area();
        let mut remaining = SimdBox::EMPTY;
        let (mut pivot, mut pivot_child) = (parent, node);
        while pivot != NONE {
            let other = sibling(pivot_child);
            stack.push((freed, other));
            // Gain before the cost of the new parent, on the way down to a node.
            while let Some((freed_below, index)) = stack.pop() {
                // The new parent is at least as large as the node.
                if freed_below - area <= best.gain {
                    continue;
                }
                let target = &self.nodes[index as usize];
                let target_bounds = SimdBox::new(&target.container);
                let gain = freed_below - target_bounds.union(&bounds).half_area();
                let is_current_position = pivot_child == node && index == other;
                if gain > best.gain && !is_current_position {
                    (best.gain, best.target) = (gain, index);
                }
                // Further down, the target grows around the node.
                let freed_below = gain + target_bounds.half_area();
                if !target.is_leaf() && freed_below - area > best.gain {
                    stack.extend([(freed_below, target.first + 1), (freed_below, target.first)]);
                }
            }
            if pivot == parent {
                remaining = self.bounds(other);
            } else {
                remaining = remaining.union(&self.bounds(other));
                freed += self.bounds(pivot).half_area() - remaining.half_area();
            }
            pivot_child = pivot;
            pivot = self.parent(pivot);
        }
        (best.target != NONE).then_some(best)
    }

    /// Whether `node` is `descendant` or one of its ancestors.
    fn is_ancestor_or_self(&self, node: u32, mut descendant: u32) -> bool {
        while descendant != NONE && descendant != node {
            descendant = self.parent(descendant);
        }
        descendant == node
    }

    /// Removes `node` and joins it with `target`, which must be neither its ancestor, descendant nor sibling: the
    /// sibling replaces the parent, and the freed pair takes target and node. Undone if the summed area does not fall.
    /// Returns the reduction of the area.
    fn apply(&mut self, node: u32, target: u32, undo: &mut Vec<(u32, Aabb)>) -> Option<f64> {
        let parent = self.parent(node);
        let pair = node.min(sibling(node));
        let slots = [parent, pair, pair + 1, target];
        let old = slots.map(|index| self.nodes[index as usize]);
        let moved = self.nodes[node as usize];
        self.set(parent, self.nodes[sibling(node) as usize]);
        let partner = self.nodes[target as usize];
        self.set(pair, partner);
        self.set(pair + 1, moved);
        let joined = Node { container: partner.container.union(&moved.container), first: pair, count: 0 };
        self.set(target, joined);
        let mut gain = f64::from(old[0].container.half_area()) - f64::from(joined.container.half_area());
        undo.clear();
        gain -= self.refit(self.parent(parent), undo);
        gain -= self.refit(self.parent(target), undo);
        if gain > 0.0 {
            return Some(gain);
        }
        for &(index, container) in undo.iter().rev() {
            self.nodes[index as usize].container = container;
        }
        for (index, node) in slots.into_iter().zip(old) {
            self.set(index, node);
        }
        None
    }

    /// Refits the containers from `node` upwards until one is unchanged. Returns the growth of their areas.
    fn refit(&mut self, mut node: u32, undo: &mut Vec<(u32, Aabb)>) -> f64 {
        let mut growth = 0.0;
        while node != NONE {
            let Node { container, first, .. } = self.nodes[node as usize];
            let [left, right] = [first, first + 1].map(|child| self.nodes[child as usize].container);
            let fitted = left.union(&right);
            if fitted == container {
                break;
            }
            growth += f64::from(fitted.half_area()) - f64::from(container.half_area());
            undo.push((node, container));
            self.nodes[node as usize].container = fitted;
            node = self.parent(node);
        }
        growth
    }

    fn set(&mut self, index: u32, node: Node<Aabb>) {
        self.nodes[index as usize] = node;
        if !node.is_leaf() {
            *self.parents[node.first as usize / 2].get_mut() = index;
        }
    }
}
