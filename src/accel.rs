//! What rays are traced against: a tree with its triangles in leaf order, the inputs that it was made from and its report.

use std::sync::Arc;
use std::time::Duration;

use crate::bvh::builders::{BuildError, StageTimes, build};
use crate::bvh::overlap::end_point_overlap;
use crate::bvh::stats::{TreeStats, tree_stats};
use crate::bvh::traverse::{self, NoProbe, Probe, Traversal};
use crate::bvh::{AnyTree, BuildSettings};
use crate::cancel::CancelToken;
use crate::geometry::{Hit, Ray, Triangle};
use crate::scene::Scene;
use crate::with_tree;

/// Triangles sampled for the end-point overlap of a large scene.
const EPO_SAMPLES: usize = 2_000;

/// A built tree, ready to be traced.
#[derive(Debug)]
pub struct Accel {
    /// The scene that it was built from.
    pub scene: Arc<Scene>,
    /// The settings that it was built with.
    pub settings: BuildSettings,
    /// The hierarchy.
    pub tree: AnyTree,
    /// The triangles in leaf order, so that a leaf's range indexes them directly.
    pub leaf_triangles: Vec<Triangle>,
    /// Where the time went and what came out.
    pub report: BuildReport,
}

/// How a build went.
#[derive(Debug, Clone, PartialEq)]
pub struct BuildReport {
    /// Time by stage.
    pub stages: StageTimes,
    /// Wall-clock time of the build: the sum of its stages.
    pub build_time: Duration,
    /// Threads of the pool that it ran in.
    pub threads: usize,
    /// Counts and costs.
    pub stats: TreeStats,
    /// End-point overlap, estimated from a sample on large scenes.
    pub epo: f32,
    /// Bytes of nodes and of primitive indices.
    pub tree_bytes: usize,
    /// Bytes of the triangles in leaf order.
    pub triangle_bytes: usize,
}

impl Accel {
    /// Builds the tree of `scene` in the calling thread's rayon pool. In debug builds the result passes the validator.
    pub fn build(scene: &Arc<Scene>, settings: &BuildSettings, token: &CancelToken) -> Result<Self, BuildError> {
        let (tree, stages) = build(&scene.triangles, settings, token)?;
        if cfg!(debug_assertions)
            && let Err(broken) = crate::bvh::validate::validate(&tree, &scene.triangles)
        {
            unreachable!("the builder made a broken tree: {broken}");
        }
        token.check()?;
        let leaf_triangles: Vec<Triangle> =
            tree.primitive_indices().iter().map(|&index| scene.triangles[index as usize]).collect();
        let stats = tree_stats(&tree);
        token.check()?;
        let epo = end_point_overlap(&tree, &scene.triangles, EPO_SAMPLES);
        let report = BuildReport {
            build_time: stages.total(),
            stages,
            threads: rayon::current_num_threads(),
            stats,
            epo,
            tree_bytes: with_tree!(&tree, tree => size_of_val(&tree.nodes[..]) + size_of_val(&tree.primitive_indices[..])),
            triangle_bytes: size_of_val(&leaf_triangles[..]),
        };
        Ok(Self { scene: Arc::clone(scene), settings: *settings, tree, leaf_triangles, report })
    }

    /// The nearest hit. Where many rays are traced, match on [`Accel::tree`] once outside the loop instead.
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.closest_hit_with(ray, Traversal::Ordered, &mut NoProbe)
    }

    /// The nearest hit in the chosen order, watched by `probe`.
    pub fn closest_hit_with<P: Probe>(&self, ray: &Ray, traversal: Traversal, probe: &mut P) -> Option<Hit> {
        with_tree!(&self.tree, tree => traverse::closest_hit(tree, &self.leaf_triangles, ray, traversal, probe))
    }

    /// Whether anything lies on `ray` between its `t_min` and `t_max`.
    pub fn any_hit(&self, ray: &Ray) -> bool {
        with_tree!(&self.tree, tree => traverse::any_hit(tree, &self.leaf_triangles, ray))
    }

    /// The leaf that holds the triangle `primitive_index` and the path to it: node indices from the root to the leaf.
    /// Empty where there is no such triangle.
    pub fn path_to(&self, primitive_index: u32) -> Vec<u32> {
        let Some(position) = self.tree.primitive_indices().iter().position(|&index| index == primitive_index) else {
            return Vec::new();
        };
        with_tree!(&self.tree, tree => {
            let leaf = tree.nodes.iter().position(|node| {
                node.is_leaf() && (node.first as usize..(node.first + node.count) as usize).contains(&position)
            });
            let Some(leaf) = leaf else { return Vec::new() };
            let parents = tree.parents();
            let mut path = vec![leaf as u32];
            while let Some(&node) = path.last() && node != 0 {
                path.push(parents[node as usize]);
            }
            path.reverse();
            path
        })
    }
}
