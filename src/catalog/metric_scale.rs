//! The colour scale of a metric over some nodes.

use bvhscope_engine::tree::statistics::TreeStats;

use super::metrics::{Ends, Metric, Scale};

/// Ratio of the ends of a logarithmic scale at least, so that rounding has no colours.
const LEAST_RATIO: f32 = std::f32::consts::SQRT_2;

/// The colour scale of a metric over some nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MetricScale {
    /// The metric.
    pub metric: &'static Metric,
    /// Values at the ends of the scale.
    pub ends: [f32; 2],
}

impl MetricScale {
    /// The scale that fits `values` of nodes of a tree with `stats`, where the metric's own does not.
    pub fn fitting(metric: &'static Metric, stats: &TreeStats, values: impl Iterator<Item = f32>) -> Self {
        let ends = match metric.ends {
            Ends::Fixed(low, high) => [low, high],
            Ends::OfTree(high) => [0.0, high(stats)],
            Ends::UpToLargest => [0.0, values.fold(1.0, f32::max)],
            Ends::Fitting(least) => {
                let is_logarithmic = metric.scale == Scale::Logarithmic;
                let usable = |value: &f32| value.is_finite() && (*value > 0.0 || !is_logarithmic);
                let [low, high] = values
                    .map(|value| value.max(least))
                    .filter(usable)
                    .fold([f32::INFINITY, 0.0_f32], |[low, high], value| [low.min(value), high.max(value)]);
                if low > high {
                    [0.0, 1.0]
                } else if is_logarithmic {
                    [low.min(high / LEAST_RATIO).max(least), high.max(least * LEAST_RATIO)]
                } else {
                    [low, high]
                }
            }
        };
        Self { metric, ends }
    }

    /// The place of a value on the scale, 0 to 1.
    pub fn position(&self, value: f32) -> f32 {
        let along = |value: f32| match self.metric.scale {
            Scale::Linear => value,
            Scale::SquareRoot => value.max(0.0).sqrt(),
            Scale::Logarithmic => value.max(f32::MIN_POSITIVE).log2(),
        };
        let [low, high] = self.ends.map(along);
        // As where the ends are fitted; also of what is no number.
        let value = if let Ends::Fitting(least) = self.metric.ends { value.max(least) } else { value };
        if high > low { ((along(value) - low) / (high - low)).clamp(0.0, 1.0) } else { 0.5 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::metrics::{AREA, DEPTH, OVERLAP, REGRET, VISIT_RATIO};

    #[test]
    fn scales_are_logarithmic_where_values_span_powers_of_ten() {
        let stats = TreeStats { max_depth: 16, ..TreeStats::default() };
        let fitting = |metric, values: &[f32]| MetricScale::fitting(metric, &stats, values.iter().copied());
        let scale = fitting(AREA, &[1.0, 0.01, 0.0, 0.1]);
        assert_eq!(scale.ends, [0.01, 1.0]);
        assert!((scale.position(0.1) - 0.5).abs() < 1e-6);
        assert_eq!([0.0, 0.01, 1.0, 2.0].map(|value| scale.position(value)), [0.0, 0.0, 1.0, 1.0]);
        assert!((fitting(VISIT_RATIO, &[3.0]).position(1.0) - 0.5).abs() < 1e-6, "as predicted lies in the middle");
        assert_eq!(fitting(OVERLAP, &[0.2]).position(0.25), 0.25);
        assert_eq!(fitting(OVERLAP, &[0.2, 3.0]).ends, [0.0, 3.0], "of many children");
        assert_eq!(fitting(AREA, &[]).ends, [0.0, 1.0]);
        assert_eq!(fitting(AREA, &[0.3, 0.3]).position(0.3), 1.0, "nearly equal values are no range of their own");
        assert_eq!(fitting(REGRET, &[1e-9, 0.1]).ends, [1e-5, 0.1], "the least savings look alike");
        assert_eq!(fitting(REGRET, &[1e-9]).ends, [1e-5, 1e-5 * LEAST_RATIO], "where there are no others, too");
        assert_eq!(fitting(REGRET, &[1e-9, 0.1]).position(f32::NAN), 0.0, "and nodes without any");
        let depths = fitting(DEPTH, &[4.0]);
        assert_eq!(
            [0.0, 1.0, 4.0, 16.0].map(|depth| depths.position(depth)),
            [0.0, 0.25, 0.5, 1.0],
            "of the whole tree"
        );
    }
}
