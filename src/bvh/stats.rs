//! Statistics of a finished tree.

use rayon::prelude::*;
use serde::Serialize;

use super::levels::{Place, top_and_subtrees, walk};
use super::{AnyTree, Container, Tree};
use crate::with_tree;

/// Cost of testing one container, in the unit of [`INTERSECTION_COST`].
pub const TRAVERSAL_COST: f32 = 1.0;
/// Cost of testing one primitive.
pub const INTERSECTION_COST: f32 = 1.0;

/// What a tree looks like in numbers. All are finite for every tree.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct TreeStats {
    /// Nodes, leaves included.
    pub nodes: usize,
    /// Nodes that hold primitives.
    pub leaves: usize,
    /// Depth of the deepest node; the root's is 0.
    pub max_depth: u32,
    /// Mean depth over the leaves.
    pub mean_leaf_depth: f32,
    /// Smallest number of primitives in a leaf.
    pub min_leaf_size: u32,
    /// Mean number of primitives in a leaf.
    pub mean_leaf_size: f32,
    /// Largest number of primitives in a leaf.
    pub max_leaf_size: u32,
    /// Number of nodes at each depth, root first.
    pub nodes_per_depth: Vec<u32>,
    /// Number of leaves of each size; index 0 is unused.
    pub leaf_size_histogram: Vec<u32>,
    /// SAH cost: Σ interior area·[`TRAVERSAL_COST`] + Σ leaf area·primitives·[`INTERSECTION_COST`], over the root's area
    /// (Goldsmith and Salmon: *Automatic Creation of Object Hierarchies*, 1987). 0 where the root has no area.
    pub sah_cost: f32,
}

/// Counts and costs of `tree`.
pub fn tree_stats(tree: &AnyTree) -> TreeStats {
    with_tree!(tree, tree => stats_of(tree))
}

/// What is added up over nodes.
struct Sums {
    interior_area: f64,
    leaf_area: f64,
    leaf_depth: u64,
    nodes_per_depth: Vec<u32>,
    leaf_sizes: Vec<u32>,
}

impl Sums {
    fn new(max_depth: u32) -> Self {
        let nodes_per_depth = vec![0; max_depth as usize + 1];
        Self { interior_area: 0.0, leaf_area: 0.0, leaf_depth: 0, nodes_per_depth, leaf_sizes: vec![0; 2] }
    }

    fn add<C: Container>(&mut self, tree: &Tree<C>, (index, depth): Place) {
        let node = &tree.nodes[index as usize];
        self.nodes_per_depth[depth as usize] += 1;
        let area = f64::from(node.container.relative_area());
        if node.is_leaf() {
            let size = node.count as usize;
            if size >= self.leaf_sizes.len() {
                self.leaf_sizes.resize(size + 1, 0);
            }
            self.leaf_sizes[size] += 1;
            self.leaf_area += area * f64::from(node.count);
            self.leaf_depth += u64::from(depth);
        } else {
            self.interior_area += area;
        }
    }

    fn plus(mut self, other: &Self) -> Self {
        fn add(sums: &mut Vec<u32>, others: &[u32]) {
            sums.resize(sums.len().max(others.len()), 0);
            sums.iter_mut().zip(others).for_each(|(sum, other)| *sum += other);
        }
        self.interior_area += other.interior_area;
        self.leaf_area += other.leaf_area;
        self.leaf_depth += other.leaf_depth;
        add(&mut self.nodes_per_depth, &other.nodes_per_depth);
        add(&mut self.leaf_sizes, &other.leaf_sizes);
        self
    }
}

fn stats_of<C: Container>(tree: &Tree<C>) -> TreeStats {
    let Some(root) = tree.nodes.first() else { return TreeStats::default() };
    let (top, subtrees) = top_and_subtrees(tree);
    let mut at_top = Sums::new(tree.max_depth);
    for place in top {
        at_top.add(tree, place);
    }
    let parts: Vec<Sums> = subtrees
        .into_par_iter()
        .map(|subtree| {
            let mut sums = Sums::new(tree.max_depth);
            walk(tree, subtree, |place| sums.add(tree, place));
            sums
        })
        .collect();
    // One after the other, so that the sums do not depend on the number of threads.
    let sums = parts.iter().fold(at_top, Sums::plus);
    let leaves: usize = sums.leaf_sizes.iter().map(|&count| count as usize).sum();
    let root_area = f64::from(root.container.relative_area());
    let cost = sums.interior_area * f64::from(TRAVERSAL_COST) + sums.leaf_area * f64::from(INTERSECTION_COST);
    TreeStats {
        nodes: tree.nodes.len(),
        leaves,
        max_depth: tree.max_depth,
        mean_leaf_depth: (sums.leaf_depth as f64 / leaves.max(1) as f64) as f32,
        min_leaf_size: sums.leaf_sizes.iter().position(|&count| count > 0).unwrap_or(0) as u32,
        mean_leaf_size: (tree.primitive_indices.len() as f64 / leaves.max(1) as f64) as f32,
        max_leaf_size: sums.leaf_sizes.len() as u32 - 1,
        nodes_per_depth: sums.nodes_per_depth,
        leaf_size_histogram: sums.leaf_sizes,
        sah_cost: share(cost, root_area) as f32,
    }
}

/// SAH cost of `tree` if each subtree were one leaf wherever that is cheaper: trees with and without large leaves compare
/// by it. Same constants and normalisation as [`TreeStats::sah_cost`].
pub fn collapsed_sah_cost(tree: &AnyTree) -> f64 {
    with_tree!(tree, tree => collapsed_cost_of(tree))
}

/// [`collapsed_sah_cost`] of a tree of one kind.
pub fn collapsed_cost_of<C: Container>(tree: &Tree<C>) -> f64 {
    let Some(root) = tree.nodes.first() else { return 0.0 };
    let mut counts = vec![0_u32; tree.nodes.len()];
    let mut costs = vec![0.0_f64; tree.nodes.len()];
    // Children come after their parents: backwards, they are done first.
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        let area = f64::from(node.container.relative_area());
        let (count, below) = if node.is_leaf() {
            (node.count, f64::INFINITY)
        } else {
            let first = node.first as usize;
            (counts[first] + counts[first + 1], costs[first] + costs[first + 1])
        };
        counts[index] = count;
        costs[index] =
            (area * f64::from(TRAVERSAL_COST) + below).min(area * f64::from(count) * f64::from(INTERSECTION_COST));
    }
    share(costs[0], f64::from(root.container.relative_area()))
}

/// `part / whole`; 0 where the whole is nothing, as in a scene of points.
pub(crate) fn share(part: f64, whole: f64) -> f64 {
    if whole > 0.0 && part.is_finite() && whole.is_finite() { part / whole } else { 0.0 }
}
