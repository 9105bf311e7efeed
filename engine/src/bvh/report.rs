//! The report of a build.

use std::sync::OnceLock;
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

/// A report whose statistics are taken on the first request, as they take as long as a fifth of a fast build.
#[derive(Debug)]
pub(super) struct LazyReport {
    stages: StageTimes,
    threads: usize,
    triangle_bytes: usize,
    report: OnceLock<BuildReport>,
}

impl LazyReport {
    /// Of a build in the calling thread's rayon pool, over triangles or items of so many bytes.
    pub(super) fn new(stages: StageTimes, triangle_bytes: usize) -> Self {
        Self { stages, threads: rayon::current_num_threads(), triangle_bytes, report: OnceLock::new() }
    }

    /// The report; `tree` is the one that was built.
    pub(super) fn of(&self, tree: &AnyTree) -> &BuildReport {
        self.report.get_or_init(|| {
            let Ok(stats) = tree_stats(tree, &CancelToken::new()) else {
                unreachable!("this token is never cancelled")
            };
            BuildReport {
                threads: self.threads,
                ..BuildReport::new(self.stages.clone(), tree, stats, self.triangle_bytes)
            }
        })
    }
}

impl BuildReport {
    /// Of a build in the calling thread's rayon pool.
    pub(super) fn new(stages: StageTimes, tree: &AnyTree, stats: TreeStats, triangle_bytes: usize) -> Self {
        let (build_time, threads, tree_bytes) = (stages.total(), rayon::current_num_threads(), tree.bytes());
        Self { stages, build_time, threads, stats, tree_bytes, triangle_bytes }
    }

    /// The report of a `tree` over `triangles` that was made elsewhere: its times are zero.
    ///
    /// # Errors
    ///
    /// Once `token` is cancelled.
    pub fn of_tree(tree: &AnyTree, triangles: &[Triangle], token: &CancelToken) -> Result<Self, Cancelled> {
        Ok(Self::new(StageTimes::default(), tree, tree_stats(tree, token)?, size_of_val(triangles)))
    }

    /// Adds a stage that ran beside the builder's.
    pub fn add_stage(&mut self, name: &'static str, time: Duration) {
        self.stages.stages.push((name, time));
        self.build_time += time;
    }

    /// Leaves all stages out but this one.
    pub fn keep_stage(&mut self, name: &str) {
        self.stages.stages.retain(|(stage, _)| *stage == name);
        self.build_time = self.stages.total();
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
