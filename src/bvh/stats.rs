//! Statistics of a finished tree.

use serde::Serialize;

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

fn stats_of<C: Container>(tree: &Tree<C>) -> TreeStats {
    let Some(root) = tree.nodes.first() else { return TreeStats::default() };
    let mut depths = vec![0_u32; tree.nodes.len()];
    let mut nodes_per_depth = vec![0_u32; tree.max_depth as usize + 1];
    let mut leaf_size_histogram = vec![0_u32; 2];
    let (mut interior_area, mut leaf_area, mut leaf_depth_sum) = (0.0_f64, 0.0_f64, 0_u64);
    // Parents come first, so that one pass knows each node's depth.
    for (index, node) in tree.nodes.iter().enumerate() {
        let depth = depths[index];
        nodes_per_depth[depth as usize] += 1;
        let area = f64::from(node.container.relative_area());
        if node.is_leaf() {
            let size = node.count as usize;
            if size >= leaf_size_histogram.len() {
                leaf_size_histogram.resize(size + 1, 0);
            }
            leaf_size_histogram[size] += 1;
            leaf_area += area * f64::from(node.count);
            leaf_depth_sum += u64::from(depth);
        } else {
            let first = node.first as usize;
            depths[first..first + 2].fill(depth + 1);
            interior_area += area;
        }
    }
    let leaves: usize = leaf_size_histogram.iter().map(|&count| count as usize).sum();
    let root_area = f64::from(root.container.relative_area());
    let cost = interior_area * f64::from(TRAVERSAL_COST) + leaf_area * f64::from(INTERSECTION_COST);
    TreeStats {
        nodes: tree.nodes.len(),
        leaves,
        max_depth: tree.max_depth,
        mean_leaf_depth: (leaf_depth_sum as f64 / leaves.max(1) as f64) as f32,
        min_leaf_size: leaf_size_histogram.iter().position(|&count| count > 0).unwrap_or(0) as u32,
        mean_leaf_size: (tree.primitive_indices.len() as f64 / leaves.max(1) as f64) as f32,
        max_leaf_size: leaf_size_histogram.len() as u32 - 1,
        nodes_per_depth,
        leaf_size_histogram,
        sah_cost: share(cost, root_area) as f32,
    }
}

/// `part / whole`; 0 where the whole is nothing, as in a scene of points.
pub(crate) fn share(part: f64, whole: f64) -> f64 {
    if whole > 0.0 && part.is_finite() && whole.is_finite() { part / whole } else { 0.0 }
}
