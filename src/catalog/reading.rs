//! The source of a tree's numbers: reports of the engine and what was measured with the tree.

use std::collections::BTreeMap;

use crate::text::counted;
use bvhscope_engine::tree::overlap::EndPointOverlap;
use bvhscope_engine::{BuildReport, ContainerKind, WideBvh};

/// Median and quartiles of the repetitions, which a disturbance of one of them does not move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Times {
    /// The median in milliseconds.
    pub ms: f64,
    /// Lower and upper quartile of the repetitions in milliseconds; `None` where there are no repetitions to tell apart.
    pub spread: Option<[f64; 2]>,
    /// Number of repetitions.
    pub count: usize,
    /// Number of those that were [`disturbed`].
    pub disturbed: usize,
}

impl Times {
    /// A time that was measured once, or read from a file.
    pub const fn single(ms: f64) -> Self {
        Self { ms, spread: None, count: 1, disturbed: 0 }
    }

    /// Median and spread of repetitions in milliseconds; a single one has no spread. Zero for none.
    pub fn of(mut repetitions: Vec<f64>) -> Self {
        if repetitions.is_empty() {
            return Self::single(0.0);
        }
        let disturbed = disturbed(&repetitions);
        repetitions.sort_by(f64::total_cmp);
        let [lower, ms, upper] = [0.25, 0.5, 0.75].map(|part| quantile(&repetitions, part));
        let count = repetitions.len();
        Self { ms, spread: (count > 1).then_some([lower, upper]), count, disturbed }
    }

    /// The spread with the number of repetitions: "9 builds, 1 disturbed".
    pub fn count_text(&self, things: &str) -> String {
        let disturbed = if self.disturbed > 0 { format!(", {} disturbed", self.disturbed) } else { String::new() };
        format!("{}{disturbed}", counted(self.count as u64, things))
    }
}

/// The quantile of `sorted` values at `part` from 0 to 1, linear between two of them (Hyndman and Fan 1996, type 7); NaN of none.
pub fn quantile(sorted: &[f64], part: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let at = part * last as f64;
    let below = at.floor() as usize;
    let [low, high] = [sorted[below], sorted[(below + 1).min(last)]];
    // Of two that are infinite the difference is no number.
    if low == high { low } else { low + (high - low) * (at - below as f64) }
}

/// Median absolute deviations from the median, in those of a normal distribution, from which on a repetition is called disturbed. Hampel
/// (1974) and Leys et al. (2013) take 3 of many values; of nine even undisturbed ones often exceed that.
const DISTURBED: f64 = 5.0;
/// Standard deviation of a normal distribution over its median absolute deviation.
const NORMAL: f64 = 1.4826;
/// The least number of repetitions of which one can be called disturbed.
const LEAST: usize = 5;

/// How many of the values of `repetitions` another program has disturbed: they lie further than five scaled median absolute deviations
/// from the median. None of fewer than five.
pub fn disturbed(repetitions: &[f64]) -> usize {
    if repetitions.len() < LEAST {
        return 0;
    }
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        quantile(&values, 0.5)
    };
    let middle = median(repetitions.to_vec());
    let deviations: Vec<f64> = repetitions.iter().map(|value| (value - middle).abs()).collect();
    let most = DISTURBED * NORMAL * median(deviations.clone());
    deviations.into_iter().filter(|deviation| *deviation > most).count()
}

/// Everything that the numbers of one tree are read from. What is not known yet, or was not measured, is `None`.
#[derive(Debug, Clone)]
pub struct TreeReading<'a> {
    /// Number of triangles of the model.
    pub triangles: usize,
    /// The name of what the tree is built of, of one and of several.
    pub primitives: [&'static str; 2],
    /// Kind of the containers.
    pub container: ContainerKind,
    /// Times, statistics and sizes of the binary tree.
    pub report: &'a BuildReport,
    /// Time of building the binary tree; `None` where the file of the tree does not state it.
    pub build: Option<Times>,
    /// The tree follows a model that moves: `build` is the time of changing the tree of the moment before.
    pub is_update: bool,
    /// Time of each build stage in milliseconds.
    pub stages_ms: BTreeMap<String, f64>,
    /// Time until rays can be traced at full speed, in milliseconds.
    pub ready_ms: Option<f64>,
    /// The end-point overlap.
    pub epo: Option<EndPointOverlap>,
    /// Hashes of the binary tree and of the wide one.
    pub hashes: Option<[u64; 2]>,
    /// The wide tree.
    pub wide: Option<WideReading>,
    /// The traced rays.
    pub trace: Option<TraceReading>,
    /// Counts of a primary ray that enters the scene's box.
    pub entering: Option<EnteringReading>,
    /// Number of primary rays of the measuring view, and times of tracing them through the wide tree without shading, where these were
    /// taken at rest.
    pub at_rest: Option<(u64, Times)>,
}

/// Averages over the primary rays of a view that enter the scene's box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnteringReading {
    /// Container and triangle tests in the binary tree.
    pub tests: f32,
    /// The container tests among them.
    pub container_tests: f32,
    /// Cache lines that are read of the wide tree: of nodes and of triangles.
    pub lines: [f32; 2],
}

/// Time and sizes of a wide tree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WideReading {
    /// Time of making it from the binary tree, in milliseconds.
    pub collapse_ms: f64,
    /// Bytes of its nodes.
    pub node_bytes: usize,
    /// Bytes of its triangles.
    pub triangle_bytes: usize,
    /// Bytes of both for each triangle of the model.
    pub bytes_per_triangle: f64,
}

impl WideReading {
    /// Time and sizes of `wide`.
    pub fn of(wide: &WideBvh) -> Self {
        Self {
            collapse_ms: wide.collapse_time.as_secs_f64() * 1e3,
            node_bytes: wide.tree.node_bytes(),
            triangle_bytes: wide.tree.leaf_bytes(),
            bytes_per_triangle: wide.bytes_per_triangle(),
        }
    }
}

/// Rays that were traced through a tree.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TraceReading {
    /// Number of primary rays.
    pub rays: u64,
    /// Number of rays that hit something.
    pub hits: u64,
    /// Number of rays that enter the scene's box, where it was counted.
    pub entering: Option<u64>,
    /// Container and primitive tests per ray, where they were counted.
    pub tests: Option<[f32; 2]>,
    /// Time through the binary tree, one ray after another.
    pub binary: Option<Times>,
    /// Time in packets through the wide tree.
    pub wide: Option<Times>,
    /// Speed of the whole picture in Mray/s, shading included, where rays were not timed alone.
    pub picture_mrays_per_s: Option<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disturbed_repetition_is_counted_and_moves_no_quartile_far() {
        let steady = [3.1, 3.12, 3.08, 3.11, 3.15, 3.09, 3.13, 3.12];
        let times = Times::of(steady.into_iter().chain([24.4]).collect());
        assert_eq!((times.ms, times.count, times.disturbed), (3.12, 9, 1));
        assert_eq!(times.spread, Some([3.1, 3.13]));
        assert_eq!(times.count_text("builds"), "9 builds, 1 disturbed");
        assert_eq!((disturbed(&steady), disturbed(&[1.0, 1.0, 9.0])), (0, 0), "three do not tell which is usual");
    }

    #[test]
    fn quantiles_lie_between_sorted_values() {
        assert_eq!([0.0, 0.25, 0.5, 1.0].map(|part| quantile(&[1.0, 2.0, 4.0], part)), [1.0, 1.5, 2.0, 4.0]);
        assert_eq!(quantile(&[1.0, 2.0, 3.0, f64::INFINITY], 0.5), 2.5);
        assert_eq!(quantile(&[f64::INFINITY; 2], 0.5), f64::INFINITY);
        assert!(quantile(&[], 0.5).is_nan());
    }
}
