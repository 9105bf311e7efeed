//! Best topologies of the largest treelets (Karras, Aila, *Fast Parallel Construction of High-Quality Bounding Volume
//! Hierarchies*, 2013, section 3). Only of the largest: these cost most, and reinsertion, which moves one subtree at a
//! time, leaves them in local optima.

use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::parallel::par_tasks;
use crate::optimize::divisions::cheapest_division;
use crate::optimize::move_search::LinkedNodes;
use crate::optimize::reinsert::linked_tree::LinkedTree;
use crate::optimize::simd_box::{Bounds, NodeBounds};
use crate::tree::Node;

/// Minimum area of a treelet's root, as a multiple of the average cost of a primitive: at half of it, treelets take
/// twice the time and gain nothing.
const MIN_RELATIVE_AREA: f32 = 64.0;
/// Maximum number of subtrees that a treelet joins: the work grows threefold with each, and eight gain no more.
const TREELET_LEAVES: usize = 7;
/// Number of sets of them.
const SUBSETS: usize = 1 << TREELET_LEAVES;
/// Minimum gain of a topology, as a fraction of its area: less is rounding.
const MIN_GAIN: f32 = 1e-5;
/// Number of treelets that are searched together, and between two polls for cancellation.
const BATCH: usize = 128;

/// The best subtree over a set of a treelet's leaves.
#[derive(Clone, Copy)]
struct Best<S> {
    bounds: S,
    /// Summed area of its interior nodes.
    area: f32,
    /// One of the two sets that it divides into.
    part: usize,
}

/// A treelet and its best topology.
struct Improvement<B> {
    /// The slots of its pairs of siblings: n − 1 for n leaves, in any topology.
    pairs: Vec<u32>,
    /// Interior nodes and leaves by slot, parents first.
    nodes: Vec<(u32, Node<B>)>,
    /// Reduction of the summed area of its interior nodes.
    gain: f32,
}

impl<B: NodeBounds> LinkedTree<'_, B> {
    /// Gives the treelets under the largest nodes their best topologies, by falling area. `average_cost` is that of a
    /// primitive. Returns the reduction of the summed area of interior nodes.
    pub fn optimize_treelets(&mut self, average_cost: f32, token: &CancelToken) -> Result<f64, Cancelled> {
        let mut gain = 0.0;
        for batch in self.largest(average_cost * MIN_RELATIVE_AREA).chunks(BATCH) {
            let found = par_tasks(batch, token, |&root, _| Ok(self.best_topology(root)))?;
            let mut changed: Vec<u32> = Vec::new();
            for (&root, mut found) in batch.iter().zip(found) {
                // Pairs begin at odd indices. Another node may be in the root's slot by now.
                let own_pair = root.saturating_sub(1) | 1;
                let is_stale =
                    |found: &Improvement<B>| found.pairs.iter().chain([&own_pair]).any(|pair| changed.contains(pair));
                if found.as_ref().is_some_and(is_stale) {
                    found = self.best_topology(root);
                }
                if let Some(Improvement { pairs, nodes, gain: reduction }) = found {
                    for (slot, node) in nodes {
                        self.set(slot, node);
                    }
                    changed.extend(pairs);
                    gain += f64::from(reduction);
                }
            }
        }
        Ok(gain)
    }

    /// The nodes of at least `min_area` by falling area.
    fn largest(&self, min_area: f32) -> Vec<u32> {
        let mut nodes = vec![(self.nodes[0].container.mean_half_area(), 0)];
        let mut next = 0;
        while let Some(&(_, index)) = nodes.get(next) {
            let children = self.children(index).into_iter().flatten();
            let children = children.map(|child| (self.bounds(child).half_area(), child));
            nodes.extend(children.filter(|child| child.0 >= min_area));
            next += 1;
        }
        nodes.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        nodes.into_iter().map(|node| node.1).collect()
    }

    /// The best topology of the treelet under `root`; `None` if it has that.
    fn best_topology(&self, root: u32) -> Option<Improvement<B>> {
        let (leaves, pairs, old_area) = self.treelet(root)?;
        let mut best = [Best { bounds: B::Simd::EMPTY, area: 0.0, part: 0 }; SUBSETS];
        let all = (1 << leaves.len()) - 1;
        for set in 1..=all {
            best[set] = best_of(&leaves, set, &best);
        }
        let gain = old_area - best[all].area;
        if gain <= MIN_GAIN * old_area {
            return None;
        }
        let (mut stack, mut nodes) = (vec![(all, root)], Vec::with_capacity(2 * leaves.len()));
        for &first in &pairs {
            let (set, slot) = stack.pop()?;
            let Best { bounds, part, .. } = best[set];
            nodes.push((slot, Node { container: B::of_simd(&bounds), first, count: 0 }));
            for (part, slot) in [part, set & !part].into_iter().zip(first..) {
                if part.is_power_of_two() {
                    nodes.push((slot, leaves[part.trailing_zeros() as usize]));
                } else {
                    stack.push((part, slot));
                }
            }
        }
        Some(Improvement { pairs, nodes, gain })
    }

    /// The leaves of the treelet under `root`, its pairs of siblings, and the summed area of its interior nodes: the
    /// largest node is opened until there are enough leaves. `None` if there is only one topology.
    fn treelet(&self, root: u32) -> Option<(Vec<Node<B>>, Vec<u32>, f32)> {
        let (mut leaves, mut pairs, mut summed_area) = (vec![root], Vec::new(), 0.0);
        while leaves.len() < TREELET_LEAVES {
            let area = |at: usize| self.bounds(leaves[at]).half_area();
            let interior = (0..leaves.len()).filter(|&at| !self.nodes[leaves[at] as usize].is_leaf());
            let Some(largest) = interior.max_by(|&a, &b| area(a).total_cmp(&area(b)).then(b.cmp(&a))) else { break };
            summed_area += area(largest);
            let first = self.nodes[leaves.swap_remove(largest) as usize].first;
            leaves.extend([first, first + 1]);
            pairs.push(first);
        }
        let leaves: Vec<Node<B>> = leaves.into_iter().map(|leaf| self.nodes[leaf as usize]).collect();
        (leaves.len() > 2).then_some((leaves, pairs, summed_area))
    }
}

/// The best subtree over the `leaves` in `set`, from those over its subsets.
#[inline(always)]
fn best_of<B: NodeBounds>(leaves: &[Node<B>], set: usize, best: &[Best<B::Simd>; SUBSETS]) -> Best<B::Simd> {
    let first = leaves[set.trailing_zeros() as usize].container.to_simd();
    // All but the first.
    let rest = set & (set - 1);
    if rest == 0 {
        return Best { bounds: first, area: 0.0, part: 0 };
    }
    let bounds = best[rest].bounds.union(&first);
    let (least, part) = cheapest_division(set, |part| best[part].area);
    Best { bounds, area: bounds.half_area() + least, part }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::geometry::Aabb;
    use crate::kernel::mix::next_unit;

    /// A list of `boxes`: each interior node has one as its first child.
    fn list(boxes: &[Aabb]) -> Vec<Node<Aabb>> {
        let mut nodes = vec![Node { container: Aabb::EMPTY, first: 0, count: 0 }];
        for (at, &container) in boxes.iter().enumerate() {
            let leaf = Node { container, first: at as u32, count: 1 };
            let (last, rest) = (nodes.len() - 1, boxes[at..].iter().fold(Aabb::EMPTY, |all, one| all.union(one)));
            if at + 1 == boxes.len() {
                nodes[last] = leaf;
            } else {
                nodes[last] = Node { container: rest, first: nodes.len() as u32, count: 0 };
                nodes.extend([leaf; 2]);
            }
        }
        nodes
    }

    /// The least summed area of interior nodes of all trees over `boxes`, by trying each.
    fn least(boxes: &[Aabb]) -> f32 {
        if boxes.len() < 2 {
            return 0.0;
        }
        let divisions = 1..(1_usize << (boxes.len() - 1));
        let area_of = |set: usize| {
            let part = |side: usize| -> Vec<Aabb> {
                (0..boxes.len()).filter(|at| set >> at & 1 == side).map(|at| boxes[at]).collect()
            };
            least(&part(0)) + least(&part(1))
        };
        let all = boxes.iter().fold(Aabb::EMPTY, |all, one| all.union(one));
        all.half_area() + divisions.map(area_of).fold(f32::INFINITY, f32::min)
    }

    #[test]
    fn a_treelet_becomes_the_best_of_all_its_topologies() -> Result<(), Cancelled> {
        let (token, mut random) = (CancelToken::new(), 7);
        for count in [2, 3, 5, 7] {
            let mut point = || Vec3::from_array([(); 3].map(|()| next_unit(&mut random) as f32));
            let corners = (0..count).map(|_| [point() * 4.0, point()]);
            let boxes: Vec<Aabb> = corners.map(|[min, size]| Aabb { min, max: min + size }).collect();
            let mut nodes = list(&boxes);
            let old_area: f32 =
                nodes.iter().filter(|node| !node.is_leaf()).map(|node| node.container.half_area()).sum();
            let gain = LinkedTree::new(&mut nodes, &token)?.optimize_treelets(0.0, &token)?;
            let interior = nodes.iter().filter(|node| !node.is_leaf());
            let area: f32 = interior.map(|node| node.container.half_area()).sum();
            assert!((area - least(&boxes)).abs() < 1e-4 * area, "{count} boxes: {area}");
            assert!((old_area - area - gain as f32).abs() < 1e-4 * area);
            let mut leaves: Vec<u32> = nodes.iter().filter(|node| node.is_leaf()).map(|leaf| leaf.first).collect();
            leaves.sort_unstable();
            assert_eq!(leaves, (0..count).collect::<Vec<u32>>());
        }
        Ok(())
    }

    /// Treelets that share nodes are searched together, and each is applied to the tree that the others left.
    #[test]
    fn overlapping_treelets_leave_a_fitted_tree() -> Result<(), Cancelled> {
        let (token, mut random) = (CancelToken::new(), 3);
        let mut point = || Vec3::from_array([(); 3].map(|()| next_unit(&mut random) as f32));
        let corners = (0..400).map(|_| [point() * 9.0, point()]);
        let boxes: Vec<Aabb> = corners.map(|[min, size]| Aabb { min, max: min + size }).collect();
        let mut nodes = list(&boxes);
        let sum = |nodes: &[Node<Aabb>]| -> f32 {
            nodes.iter().filter(|node| !node.is_leaf()).map(|node| node.container.half_area()).sum()
        };
        let before = sum(&nodes);
        let gain = LinkedTree::new(&mut nodes, &token)?.optimize_treelets(0.0, &token)? as f32;
        assert!(gain > 0.2 * before && (before - sum(&nodes) - gain).abs() < 1e-3 * before, "{gain} of {before}");
        let (mut stack, mut reached) = (vec![0], 0);
        while let Some(index) = stack.pop() {
            let Node { container, first, count } = nodes[index as usize];
            if count > 0 {
                reached += 1;
                continue;
            }
            let [left, right] = [first, first + 1].map(|child| nodes[child as usize].container);
            assert_eq!(container, left.union(&right), "node {index}");
            stack.extend([first, first + 1]);
        }
        assert_eq!(reached, boxes.len());
        Ok(())
    }
}
