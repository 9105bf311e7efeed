//! Reinsertion: subtrees move to where they cost less (Meister, Bittner, *Parallel Reinsertion for Bounding Volume Hierarchy
//! Optimization*, 2018). In rounds: a parallel search over the most promising subtrees, then the moves that were found, the
//! best first, each only where nothing it touches has changed in this round and the cost still falls. So the cost never
//! rises, and the tree is the same on any number of threads.

use rayon::prelude::*;

use super::sweep::Bounds;
use crate::bvh::Node;
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Aabb;

/// Rounds of search and moves.
const ROUNDS: u32 = 3;
/// One in so many nodes is looked at in each round.
const NODES_PER_CANDIDATE: usize = 50;
/// Candidates between two looks at the token.
const BATCH: usize = 256;
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

/// Moves subtrees to better places. `nodes` may stand in any order, siblings together, before and after.
pub fn reinsert(nodes: &mut [Node<Aabb>], token: &CancelToken) -> Result<(), Cancelled> {
    let mut links = Links::new(nodes);
    // The round in which a node was last changed.
    let mut changed = vec![0; links.nodes.len()];
    let mut undo = Vec::new();
    for round in 1..=ROUNDS {
        let candidates = links.candidates();
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
        for Move { node, target, .. } in moves {
            let touched = [links.parent(node), node, sibling(node), target];
            let settled = touched.iter().any(|&at| changed[at as usize] == round);
            // An earlier move may have brought one below the other.
            if settled || links.is_above(node, target) || links.is_above(target, node) {
                continue;
            }
            if links.make(node, target, &mut undo) {
                for at in touched {
                    changed[at as usize] = round;
                }
            }
        }
    }
    Ok(())
}

/// The other child of the parent: pairs begin at odd numbers.
#[inline(always)]
fn sibling(node: u32) -> u32 {
    ((node - 1) ^ 1) + 1
}

/// A tree whose parts can be moved about.
struct Links<'a> {
    nodes: &'a mut [Node<Aabb>],
    /// For each pair of siblings their parent.
    parents: Vec<u32>,
}

impl<'a> Links<'a> {
    fn new(nodes: &'a mut [Node<Aabb>]) -> Self {
        let mut parents = vec![NONE; nodes.len() / 2];
        for (at, node) in nodes.iter().enumerate() {
            if !node.is_leaf() {
                parents[node.first as usize / 2] = at as u32;
            }
        }
        Self { nodes, parents }
    }

    /// The parent; [`NONE`] of the root.
    #[inline(always)]
    fn parent(&self, node: u32) -> u32 {
        if node == 0 { NONE } else { self.parents[(node as usize - 1) / 2] }
    }

    #[inline(always)]
    fn bounds(&self, node: u32) -> Bounds {
        Bounds::new(&self.nodes[node as usize].container)
    }

    /// The nodes by which most is to be gained: those whose parents are large, and much larger than what they hold (Bittner, Hapala,
    /// Havran, *Fast Insertion-Based Optimization of Bounding Volume Hierarchies*, 2013).
    fn candidates(&self) -> Vec<u32> {
        let score = |at: u32| {
            let [own, other, parent] = [at, sibling(at), self.parent(at)].map(|at| self.bounds(at).half_area());
            // Flat containers must not divide by zero.
            parent * (parent / (own + other + 1e-6 * parent)) * (parent / (own.min(other) + 1e-3 * parent))
        };
        // The root's children have nowhere to go but below each other.
        let nodes = (1..self.nodes.len() as u32).into_par_iter().with_min_len(BATCH);
        let movable = |&at: &u32| self.parent(at) != 0 && self.bounds(self.parent(at)).half_area() > 0.0;
        let scored = nodes.filter(movable).map(|at| (score(at), at));
        let mut scored: Vec<(f32, u32)> = scored.collect();
        let count = scored.len().div_ceil(NODES_PER_CANDIDATE);
        if count > 0 {
            scored.select_nth_unstable_by(count - 1, |a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        }
        let mut candidates: Vec<u32> = scored[..count].iter().map(|one| one.1).collect();
        // Neighbours search the same nodes.
        candidates.sort_unstable();
        candidates
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
    /// the parent's place, and the pair that becomes free takes target and node. Undone where the summed area does not
    /// fall. Whether it was done.
    fn make(&mut self, node: u32, target: u32, undo: &mut Vec<(u32, Aabb)>) -> bool {
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
        let mut change = f64::from(joined.container.half_area()) - f64::from(before[0].container.half_area());
        undo.clear();
        change += self.refit(self.parent(parent), undo);
        change += self.refit(self.parent(target), undo);
        if change < 0.0 {
            return true;
        }
        for &(at, container) in undo.iter().rev() {
            self.nodes[at as usize].container = container;
        }
        for (at, node) in places.into_iter().zip(before) {
            self.set(at, node);
        }
        false
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
            self.parents[node.first as usize / 2] = at;
        }
    }
}
