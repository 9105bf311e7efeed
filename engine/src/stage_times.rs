//! Where the time of a build went.

use std::time::Duration;

/// How long each stage of a build took, in the order of work.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StageTimes {
    /// Name and duration: "codes", "sort", "tree", "flatten" for AAC; then each pass over the finished tree by its name.
    pub stages: Vec<(&'static str, Duration)>,
    /// Where passes ran over the finished tree: its SAH cost as it was, under "tree", and after each pass, as in
    /// [`crate::tree::statistics::TreeStats::sah_cost`].
    pub costs: Vec<(&'static str, f64)>,
}

impl StageTimes {
    /// Sum of all stages.
    pub fn total(&self) -> Duration {
        self.stages.iter().map(|(_, duration)| *duration).sum()
    }

    /// SAH cost before and after the pass that the stage `name` is; `None` where it is none.
    pub fn cost_change(&self, name: &str) -> Option<[f64; 2]> {
        let after = self.costs.iter().skip(1).position(|&(pass, _)| pass == name)? + 1;
        Some([self.costs[after - 1].1, self.costs[after].1])
    }
}
