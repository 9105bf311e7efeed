//! Statistics of a finished tree.

use serde::Serialize;

use super::AnyTree;
use crate::geometry::Triangle;

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
    /// (Goldsmith and Salmon 1987; MacDonald and Booth 1990).
    pub sah_cost: f32,
}

/// Counts and costs of `tree`.
pub fn tree_stats(_tree: &AnyTree) -> TreeStats {
    todo!("bvh")
}

/// End-point overlap (Aila, Karras, Laine: *On Quality Metrics of Bounding Volume Hierarchies*, HPG 2013, section 4): the
/// cost of the surface of the scene that lies inside nodes that do not hold it, over the total surface. Exact for up to
/// `max_samples` triangles, estimated from that many evenly spread ones beyond. 0 for a tree without overlap.
pub fn end_point_overlap(_tree: &AnyTree, _triangles: &[Triangle], _max_samples: usize) -> f32 {
    todo!("bvh")
}
