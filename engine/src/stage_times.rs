//! Time of each stage of a build.

use std::time::{Duration, Instant};

use crate::cancel::CancelToken;

/// Wall-clock time of each stage of a build, in the order in which they ran.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StageTimes {
    /// Name and duration: "bounds", "codes", "sort", "tree", "flatten" for AAC; then each pass over the finished tree by its name.
    pub stages: Vec<(&'static str, Duration)>,
    /// Names of the stages that did not run, because the result of an earlier build of the same triangles was reused. They come
    /// before all others, have no entry in [`Self::stages`] and add nothing to [`Self::total`].
    pub reused: Vec<&'static str>,
    /// SAH cost of the tree before and after each pass over it, as in [`crate::tree::statistics::TreeStats::sah_cost`]: under "tree"
    /// as it was built, then under the name of each pass. Empty where no pass ran.
    pub costs: Vec<(&'static str, f64)>,
    /// SAH cost before the first and after each round of annealing, with the time since its beginning. Empty where it did not run.
    pub annealing: Vec<(Duration, f64)>,
}

impl StageTimes {
    /// Time of the build: the sum of the stages that ran.
    pub fn total(&self) -> Duration {
        self.stages.iter().map(|(_, duration)| *duration).sum()
    }

    /// SAH cost before and after the pass `name`; `None` where no such pass ran.
    pub fn cost_change(&self, name: &str) -> Option<[f64; 2]> {
        let after = self.costs.iter().skip(1).position(|&(pass, _)| pass == name)? + 1;
        Some([self.costs[after - 1].1, self.costs[after].1])
    }
}

/// A stage of a build under way.
pub(crate) struct Stage {
    name: &'static str,
    start: Instant,
}

impl Stage {
    /// Begins the stage `name`, also in the log of tasks.
    pub(crate) fn begin(name: &'static str, token: &CancelToken) -> Self {
        token.begin_stage(name);
        Self { name, start: Instant::now() }
    }

    /// Ends it and notes its time.
    pub(crate) fn end(self, times: &mut StageTimes) {
        times.stages.push((self.name, self.start.elapsed()));
    }
}
