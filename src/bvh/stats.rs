//! Statistics of a finished tree.

use rayon::prelude::*;
use serde::Serialize;

use super::{AnyTree, Container, Node, Tree};
use crate::cancel::{CancelToken, Cancelled};
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
    // Nobody else has this token.
    tree_stats_unless(tree, &CancelToken::new()).unwrap_or_default()
}

/// [`tree_stats`], unless `token` is cancelled.
pub fn tree_stats_unless(tree: &AnyTree, token: &CancelToken) -> Result<TreeStats, Cancelled> {
    with_tree!(tree, tree => stats_of(tree, token))
}

/// Nodes whose sums one task adds up; always the same, so that the sums do not depend on the number of threads.
const SUMMED_AT_ONCE: usize = 1 << 14;

/// What is added up over nodes.
#[derive(Default)]
struct Sums {
    interior_area: f64,
    leaf_area: f64,
    leaf_depth: u64,
    nodes_per_depth: Vec<u32>,
    leaf_sizes: Vec<u32>,
}

impl Sums {
    fn of<C: Container>(nodes: &[Node<C>], depths: &[u32]) -> Self {
        let mut sums = Self::default();
        for (node, &depth) in nodes.iter().zip(depths) {
            count(&mut sums.nodes_per_depth, depth, 1);
            let area = f64::from(node.container.relative_area());
            if node.is_leaf() {
                count(&mut sums.leaf_sizes, node.count, 1);
                sums.leaf_area += area * f64::from(node.count);
                sums.leaf_depth += u64::from(depth);
            } else {
                sums.interior_area += area;
            }
        }
        sums
    }

    fn plus(mut self, other: &Self) -> Self {
        self.interior_area += other.interior_area;
        self.leaf_area += other.leaf_area;
        self.leaf_depth += other.leaf_depth;
        for (sums, others) in
            [(&mut self.nodes_per_depth, &other.nodes_per_depth), (&mut self.leaf_sizes, &other.leaf_sizes)]
        {
            others.iter().zip(0..).for_each(|(&number, place)| count(sums, place, number));
        }
        self
    }
}

/// Adds `number` in a place of a list, which grows as needed.
fn count(list: &mut Vec<u32>, place: u32, number: u32) {
    let place = place as usize;
    if place >= list.len() {
        list.resize(place + 1, 0);
    }
    list[place] += number;
}

/// [`tree_stats`] of a tree of one kind.
pub(super) fn stats_of<C: Container>(tree: &Tree<C>, token: &CancelToken) -> Result<TreeStats, Cancelled> {
    let Some(root) = tree.nodes.first() else { return Ok(TreeStats::default()) };
    let depths = tree.depths_unless(token)?;
    let parts: Vec<Sums> = tree
        .nodes
        .par_chunks(SUMMED_AT_ONCE)
        .zip(depths.par_chunks(SUMMED_AT_ONCE))
        .map(|(nodes, depths)| {
            token.check()?;
            Ok(Sums::of(nodes, depths))
        })
        .collect::<Result<_, Cancelled>>()?;
    let sums = parts.iter().fold(Sums::default(), Sums::plus);
    let leaves: usize = sums.leaf_sizes.iter().map(|&count| count as usize).sum();
    let root_area = f64::from(root.container.relative_area());
    let cost = sums.interior_area * f64::from(TRAVERSAL_COST) + sums.leaf_area * f64::from(INTERSECTION_COST);
    Ok(TreeStats {
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
    })
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
