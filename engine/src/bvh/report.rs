//! The report of a build.

use std::time::Duration;

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::stage_times::StageTimes;
use crate::tree::AnyTree;
use crate::tree::statistics::{TreeStats, tree_stats};

/// Times, statistics and sizes of one build.
#[derive(Debug, Clone, PartialEq)]
pub struct BuildReport {
    /// Time of each stage, and which stages were reused from an earlier build.
    pub stages: StageTimes,
    /// Wall-clock time of this build: the sum of the stages that ran. Nothing of an earlier build is counted.
    pub build_time: Duration,
    /// Number of threads in the pool that it ran in.
    pub threads: usize,
    /// Statistics of the binary tree.
    pub stats: TreeStats,
    /// Bytes of nodes and of primitive indices.
    pub tree_bytes: usize,
    /// Bytes of the triangles in leaf order.
    pub triangle_bytes: usize,
}

impl BuildReport {
    /// The report of a `tree` over `triangles` that was made elsewhere: its times are zero.
    ///
    /// # Errors
    ///
    /// Once `token` is cancelled.
    pub fn of_tree(tree: &AnyTree, triangles: &[Triangle], token: &CancelToken) -> Result<Self, Cancelled> {
        Ok(Self {
            stages: StageTimes::default(),
            build_time: Duration::ZERO,
            threads: rayon::current_num_threads(),
            stats: tree_stats(tree, token)?,
            tree_bytes: tree.bytes(),
            triangle_bytes: size_of_val(triangles),
        })
    }

    /// Adds a stage that ran beside the builder's.
    pub fn add_stage(&mut self, name: &'static str, time: Duration) {
        self.stages.stages.push((name, time));
        self.build_time += time;
    }

    fn triangle_count(&self) -> usize {
        self.triangle_bytes / size_of::<Triangle>()
    }

    /// Build rate in millions of triangles per second.
    pub fn mtriangles_per_s(&self) -> f64 {
        self.triangle_count() as f64 / self.build_time.as_secs_f64().max(1e-9) / 1e6
    }

    /// Bytes of the binary tree and of the triangles in leaf order, for each triangle.
    pub fn bytes_per_triangle(&self) -> f64 {
        (self.tree_bytes + self.triangle_bytes) as f64 / self.triangle_count().max(1) as f64
    }
}
