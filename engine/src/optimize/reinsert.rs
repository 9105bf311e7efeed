//! Reinsertion: subtrees move to where they cost less (Meister, Bittner, *Parallel Reinsertion for Bounding Volume Hierarchy
//! Optimization*, 2018). In rounds: a parallel search over the most promising subtrees, then the moves that were found, the
//! best first, each only where nothing it touches has changed in this round and the cost still falls. So the cost never
//! rises, and the tree is the same on any number of threads.

use std::collections::{HashSet, VecDeque};
use std::sync::atomic::{AtomicU32, Ordering};

use glam::Vec3A;
use rayon::prelude::*;

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Aabb;
use crate::tree::Node;
use crate::tree::statistics::TRAVERSAL_COST;

/// Most rounds of search and moves: on architecture the sixth still gains a thousandth.
const ROUNDS: u32 = 5;
/// Share of the cost that a round must gain for another to follow.
const MIN_GAIN: f64 = 2e-3;
/// One subtree for so many primitives is looked at in each round: twice as many gain two thousandths more, in twice the time.
const PRIMITIVES_PER_CANDIDATE: usize = 40;
/// One round's candidates are the best of so many times as many, which are chosen before the first: moves change few scores, and
/// scoring all again takes longer than the search.
const ELIGIBLE_PER_CANDIDATE: usize = 2;
/// Candidates between two looks at the token.
const BATCH: usize = 256;
/// Nodes that one task looks at where nothing else is done with them.
const NODES_PER_LOOK: usize = 1 << 16;
/// Nodes that one thread looks at before the rest is shared out.
const TOP_NODES: usize = 256;
/// So many of those that are scored tell where the best begin.
const SAMPLES: usize = 4096;
/// No node.
const NONE: u32 = u32::MAX;

/// Who moves where.
#[derive(Debug, Clone, Copy)]
struct Move {
    /// By how much the summed area of interior nodes falls.
    gain: f32,
    node: u32,
    /// Its new sibling.
    target: u32,
}

/// Moves subtrees of a tree over so many primitives, with so much SAH cost, to better places. `nodes` may stand in any order,
/// siblings together, before and after. Returns by how much the cost falls.
pub fn reinsert(nodes: &mut [Node<Aabb>], primitives: usize, cost: f64, token: &CancelToken) -> Result<f64, Cancelled> {
    let mut links = Links::new(nodes, token)?;
    // Nodes that were changed in this round.
    let mut changed = HashSet::new();
    let mut undo = Vec::new();
    let mut total = 0.0;
    let most = primitives.div_ceil(PRIMITIVES_PER_CANDIDATE);
    // Nodes of less than the average cost of a primitive are too small to matter.
    let eligible = links.eligible(most * ELIGIBLE_PER_CANDIDATE, (cost / primitives as f64) as f32);
    for _ in 0..ROUNDS {
        token.check()?;
        changed.clear();
        let candidates = links.candidates(&eligible, most);
        let found: Vec<Vec<Move>> = candidates
            .par_chunks(BATCH)
            .map(|batch| {
                token.check()?;
                let mut stack = Vec::new();
                Ok(batch.iter().filter_map(|&node| links.search(node, &mut stack)).collect())
            })
            .collect::<Result<_, _>>()?;
        let mut moves: Vec<Move> = found.into_iter().flatten().collect();
        moves.sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.node.cmp(&b.node)));
        let mut gain = 0.0;
        for Move { node, target, .. } in moves {
            let touched = [links.parent(node), node, sibling(node), target];
            let settled = touched.iter().any(|at| changed.contains(at));
            // An earlier move may have brought one below the other.
            if settled || links.is_above(node, target) || links.is_above(target, node) {
                continue;
            }
            if let Some(fall) = links.make(node, target, &mut undo) {
                gain += fall * f64::from(TRAVERSAL_COST);
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

/// At least the `most` of `parts` whose first numbers are the largest, and few others; all where there are no more.
fn most_wasteful(parts: &[Vec<(f32, u32)>], most: usize) -> Vec<(f32, u32)> {
    let len: usize = parts.iter().map(Vec::len).sum();
    // A sample tells about where they begin.
    let step = (len / SAMPLES).max(1);
    let mut sample: Vec<f32> = parts.iter().flatten().step_by(step).map(|one| one.0).collect();
    let place = most * 5 / 4 / step + SAMPLES / 64;
    if place < sample.len() {
        let (_, &mut least, _) = sample.select_nth_unstable_by(place, |a, b| b.total_cmp(a));
        let large: Vec<Vec<(f32, u32)>> =
            parts.par_iter().map(|part| part.iter().filter(|one| one.0 >= least).copied().collect()).collect();
        if large.iter().map(Vec::len).sum::<usize>() >= most {
            return large.concat();
        }
    }
    parts.concat()
}

/// The nodes of the `most` of `scored` whose first numbers are the largest; neighbours, which search the same nodes, together.
fn best(mut scored: Vec<(f32, u32)>, most: usize) -> Vec<u32> {
    if scored.len() > most {
        scored.select_nth_unstable_by(most, |a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        scored.truncate(most);
    }
    let mut nodes: Vec<u32> = scored.into_iter().map(|one| one.1).collect();
    nodes.sort_unstable();
    nodes
}

/// The other child of the parent: pairs begin at odd numbers.
#[inline(always)]
fn sibling(node: u32) -> u32 {
    ((node - 1) ^ 1) + 1
}

/// A box for arithmetic: four lanes a corner.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    min: Vec3A,
    max: Vec3A,
}

impl Bounds {
    const EMPTY: Self = Self { min: Vec3A::INFINITY, max: Vec3A::NEG_INFINITY };

    #[inline(always)]
    fn new(container: &Aabb) -> Self {
        Self { min: container.min.into(), max: container.max.into() }
    }

    #[inline(always)]
    fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Half of the surface area; must not be asked of an empty box.
    #[inline(always)]
    fn half_area(&self) -> f32 {
        let d = self.max - self.min;
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

/// A tree whose parts can be moved about.
struct Links<'a> {
    nodes: &'a mut [Node<Aabb>],
    /// For each pair of siblings their parent. Many threads find them; from then on one alone changes them.
    parents: Vec<AtomicU32>,
}

impl<'a> Links<'a> {
    fn new(nodes: &'a mut [Node<Aabb>], token: &CancelToken) -> Result<Self, Cancelled> {
        let parents: Vec<AtomicU32> = (0..nodes.len() / 2).map(|_| AtomicU32::new(NONE)).collect();
        nodes.par_chunks(NODES_PER_LOOK).enumerate().try_for_each(|(chunk, chunk_nodes)| {
            token.check()?;
            for (at, node) in (chunk * NODES_PER_LOOK..).zip(chunk_nodes) {
                if !node.is_leaf() {
                    parents[node.first as usize / 2].store(at as u32, Ordering::Relaxed);
                }
            }
            Ok(())
        })?;
        Ok(Self { nodes, parents })
    }

    /// The parent; [`NONE`] of the root.
    #[inline(always)]
    fn parent(&self, node: u32) -> u32 {
        if node == 0 { NONE } else { self.parents[(node as usize - 1) / 2].load(Ordering::Relaxed) }
    }

    #[inline(always)]
    fn bounds(&self, node: u32) -> Bounds {
        Bounds::new(&self.nodes[node as usize].container)
    }

    /// The `most` nodes by which most is to be gained, among those whose parents are `least` in area at least.
    fn eligible(&self, most: usize, least: f32) -> Vec<u32> {
        // The root's children have nowhere to go but below each other.
        let root = &self.nodes[0];
        let mut open = VecDeque::from(if root.is_leaf() { Vec::new() } else { vec![root.first, root.first + 1] });
        let mut scored: Vec<(f32, u32)> = Vec::new();
        // A few nodes at the top, then everything below them in parallel.
        for _ in 0..TOP_NODES {
            let Some(at) = open.pop_front() else { break };
            open.extend(self.score(at, least, &mut scored).into_iter().flatten());
        }
        let parts = Vec::from(open).into_par_iter().map(|top| {
            // Breadth first, so that loads do not wait for one another.
            let (mut scored, mut open, mut next) = (Vec::new(), vec![top], 0);
            while let Some(&at) = open.get(next) {
                open.extend(self.score(at, least, &mut scored).into_iter().flatten());
                next += 1;
            }
            scored
        });
        let mut parts: Vec<_> = parts.collect();
        parts.push(scored);
        best(most_wasteful(&parts, most), most)
    }

    /// The `most` of `eligible` by which most is to be gained now.
    fn candidates(&self, eligible: &[u32], most: usize) -> Vec<u32> {
        let scored = eligible.par_iter().map(|&node| (self.waste(self.parent(node)), node)).collect();
        best(scored, most)
    }

    /// Adds the children of `at`, each with what is to be gained, where it is large enough. Returns them.
    #[inline(always)]
    fn score(&self, at: u32, least: f32, scored: &mut Vec<(f32, u32)>) -> Option<[u32; 2]> {
        let node = &self.nodes[at as usize];
        if node.is_leaf() || node.container.half_area() < least {
            return None;
        }
        let pair = [node.first, node.first + 1];
        let waste = self.waste(at);
        if waste > 0.0 {
            scored.extend(pair.map(|child| (waste, child)));
        }
        Some(pair)
    }

    /// What is to be gained by moving a child of the interior node `at`: the more, the larger it is, and the larger than what it holds
    /// (Bittner, Hapala, Havran, *Fast Insertion-Based Optimization of Bounding Volume Hierarchies*, 2013).
    #[inline(always)]
    fn waste(&self, at: u32) -> f32 {
        let area = self.bounds(at).half_area();
        let first = self.nodes[at as usize].first;
        let [left, right] = [first, first + 1].map(|child| self.bounds(child).half_area());
        // Flat containers must not divide by zero.
        area * (area / (left + right + 1e-6 * area)) * (area / (left.min(right) + 1e-3 * area))
    }

    /// Where `node` costs least, where that is less than now: branch and bound over the siblings of its ancestors and everything
    /// below them.
    fn search(&self, node: u32, stack: &mut Vec<(f32, u32)>) -> Option<Move> {
        let bounds = self.bounds(node);
        let area = bounds.half_area();
        let parent = self.parent(node);
        let mut best = Move { gain: 0.0, node, target: NONE };
        // What taking the node out gains: its parent vanishes, what is above shrinks to what is left.
        let mut freed = self.bounds(parent).half_area();
        let mut left = Bounds::EMPTY;
        let (mut pivot, mut below) = (parent, node);
        while pivot != NONE {
            let other = sibling(below);
            stack.push((freed, other));
            // What is gained before the new parent is paid for, having gone down to a node.
            while let Some((reach, at)) = stack.pop() {
                // The new parent is at least as large as the node.
                if reach - area <= best.gain {
                    continue;
                }
                let target = &self.nodes[at as usize];
                let own = Bounds::new(&target.container);
                let gain = reach - own.union(&bounds).half_area();
                let is_where_it_is = below == node && at == other;
                if gain > best.gain && !is_where_it_is {
                    (best.gain, best.target) = (gain, at);
                }
                // Going further down, the target grows around the node.
                let reach = gain + own.half_area();
                if !target.is_leaf() && reach - area > best.gain {
                    stack.extend([(reach, target.first + 1), (reach, target.first)]);
                }
            }
            if pivot == parent {
                left = self.bounds(other);
            } else {
                left = left.union(&self.bounds(other));
                freed += self.bounds(pivot).half_area() - left.half_area();
            }
            below = pivot;
            pivot = self.parent(pivot);
        }
        (best.target != NONE).then_some(best)
    }

    /// Whether `node` is `of` or above it.
    fn is_above(&self, node: u32, mut of: u32) -> bool {
        while of != NONE && of != node {
            of = self.parent(of);
        }
        of == node
    }

    /// Takes `node` out and joins it with `target`, which must be neither above nor below it nor its sibling: the sibling takes
    /// the parent's place, and the pair that becomes free takes target and node. Undone where the summed area does not fall.
    /// By how much it fell.
    fn make(&mut self, node: u32, target: u32, undo: &mut Vec<(u32, Aabb)>) -> Option<f64> {
        let parent = self.parent(node);
        let pair = node.min(sibling(node));
        let places = [parent, pair, pair + 1, target];
        let before = places.map(|at| self.nodes[at as usize]);
        let moved = self.nodes[node as usize];
        self.set(parent, self.nodes[sibling(node) as usize]);
        let partner = self.nodes[target as usize];
        self.set(pair, partner);
        self.set(pair + 1, moved);
        let joined = Node { container: partner.container.union(&moved.container), first: pair, count: 0 };
        self.set(target, joined);
        let mut fall = f64::from(before[0].container.half_area()) - f64::from(joined.container.half_area());
        undo.clear();
        fall -= self.refit(self.parent(parent), undo);
        fall -= self.refit(self.parent(target), undo);
        if fall > 0.0 {
            return Some(fall);
        }
        for &(at, container) in undo.iter().rev() {
            self.nodes[at as usize].container = container;
        }
        for (at, node) in places.into_iter().zip(before) {
            self.set(at, node);
        }
        None
    }

    /// Fits the containers from `node` up, until nothing changes. By how much their areas grow.
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

    fn set(&mut self, at: u32, node: Node<Aabb>) {
        self.nodes[at as usize] = node;
        if !node.is_leaf() {
            *self.parents[node.first as usize / 2].get_mut() = at;
        }
    }
}
