//! The speed-up on more cores than the machine has, as it is reported.

use serde::{Deserialize, Serialize};

/// Predicted speed-ups of building and of tracing. Field names are the JSON names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScalingPrediction {
    /// Number of runs on one thread and on two.
    pub runs: usize,
    /// Measured time of a fork in microseconds.
    pub fork_us: f64,
    /// Measured times in microseconds until another thread begins a task: one that was idle for a moment, and one that slept. Absent
    /// where the process may use one core alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steal_us: Option<[f64; 2]>,
    /// From the triangles to everything that the fastest rays are traced through: the binary tree and the wide one.
    pub build: PredictedScaling,
    /// Tracing the primary rays through the binary tree.
    pub trace: PredictedScaling,
}

/// Work, span and predicted speed-up of a computation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PredictedScaling {
    /// Number of tasks.
    pub tasks: usize,
    /// Work in milliseconds: the time of all tasks on one thread.
    pub work_ms: f64,
    /// Span in milliseconds: the time of the longest chain of tasks that wait for each other, which no number of cores is faster than.
    pub span_ms: f64,
    /// Time of the sections beside which no task can run, as a fraction of the work.
    pub serial_share: f64,
    /// The stages, in the order in which they run.
    pub stages: Vec<StageWork>,
    /// Predicted speed-up over one core.
    pub curve: Vec<PredictedSpeedup>,
    /// Measured speed-up of two threads over one, of the fastest run of each. Absent where the process may use one core alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured_at_two: Option<f64>,
}

/// Work of a stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StageWork {
    /// Its name.
    pub stage: String,
    /// Work in milliseconds.
    pub work_ms: f64,
    /// Time of its serial sections in milliseconds.
    pub serial_ms: f64,
    /// Time of its parallel tasks with two busy cores over that with one. Absent where it was not measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inflation: Option<f64>,
}

/// Predicted speed-up on a number of cores.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PredictedSpeedup {
    /// Number of cores.
    pub cores: usize,
    /// Speed-up over one core, if each doubling of the cores slows tasks down as much as the first.
    pub speedup: f64,
    /// The worst case: each core slows tasks down as much as the second.
    pub lower: f64,
    /// The best case: more cores than two slow nothing down.
    pub upper: f64,
}

impl PredictedScaling {
    /// The prediction for `cores`, if it is part of the curve.
    pub fn at(&self, cores: usize) -> Option<&PredictedSpeedup> {
        self.curve.iter().find(|point| point.cores == cores)
    }

    /// By what fraction of the measured speed-up of two threads the predicted one differs from it.
    pub fn difference_at_two(&self) -> Option<f64> {
        Some(self.at(2)?.speedup / self.measured_at_two? - 1.0)
    }
}
