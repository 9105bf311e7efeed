//! Metrics of the nodes of a tree, and the colour scales that fit them.

use std::sync::Arc;

use bvhscope_engine::tree::visits::Visits;

use crate::accel::Accel;
use crate::catalog::metrics::{Ends, Metric, NodeReading};

/// The numbers of the nodes of one tree.
#[derive(Debug, Clone, Copy)]
pub struct NodeValues<'a> {
    /// The tree.
    pub accel: &'a Accel,
    /// Its visits, where they are measured.
    pub visits: Option<&'a Visits>,
}

impl NodeValues<'_> {
    fn reading(&self) -> NodeReading<'_> {
        NodeReading {
            tree: &self.accel.tree,
            stats: &self.accel.report.stats,
            ancestry: self.accel.known_ancestry(),
            visits: self.visits,
            regrets: self.accel.known_regrets(),
            built_areas: self.accel.built_areas(),
        }
    }

    /// The value of `node`; `None` where it has none, as a leaf has no overlap of children, or where it is not known.
    pub fn get(&self, metric: &Metric, node: u32) -> Option<f32> {
        (metric.get)(&self.reading(), node)
    }

    /// Measured and predicted visits of `node`; `None` until they are measured.
    pub fn visits(&self, node: u32) -> Option<(u32, f64)> {
        self.reading().visits(node)
    }
}

/// Measured visits as an input of what is derived from them: equal where they are of the same measurement.
#[derive(Debug, Clone)]
pub struct KnownVisits(pub Arc<Visits>);

impl PartialEq for KnownVisits {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// The colour scale of a metric over some nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MetricScale {
    metric: &'static Metric,
    /// Values at the ends of the scale.
    pub ends: [f32; 2],
}

impl MetricScale {
    /// The scale that fits `values`, where the metric's own does not.
    pub fn fitting(metric: &'static Metric, values: impl Iterator<Item = f32>) -> Self {
        let ends = match metric.ends {
            Ends::Fixed(low, high) => [low, high],
            Ends::UpToLargest => [0.0, values.fold(1.0, f32::max)],
            Ends::Fitting => {
                let usable = |value: &f32| value.is_finite() && (*value > 0.0 || !metric.is_logarithmic);
                let ends = values
                    .filter(usable)
                    .fold([f32::INFINITY, 0.0_f32], |[low, high], value| [low.min(value), high.max(value)]);
                if ends[0] <= ends[1] { ends } else { [0.0, 1.0] }
            }
        };
        Self { metric, ends }
    }

    /// The place of a value on the scale, 0 to 1.
    pub fn position(&self, value: f32) -> f32 {
        let along = |value: f32| if self.metric.is_logarithmic { value.max(f32::MIN_POSITIVE).ln() } else { value };
        let [low, high] = self.ends.map(along);
        if high > low { ((along(value) - low) / (high - low)).clamp(0.0, 1.0) } else { 0.5 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::metrics;

    #[test]
    fn scales_are_logarithmic_where_values_span_powers_of_ten() {
        let scale = MetricScale::fitting(metrics::AREA, [1.0, 0.01, 0.0, 0.1].into_iter());
        assert_eq!(scale.ends, [0.01, 1.0]);
        assert!((scale.position(0.1) - 0.5).abs() < 1e-6);
        assert_eq!([0.0, 0.01, 1.0, 2.0].map(|value| scale.position(value)), [0.0, 0.0, 1.0, 1.0]);
        let visits = MetricScale::fitting(metrics::VISIT_RATIO, [3.0].into_iter());
        assert!((visits.position(1.0) - 0.5).abs() < 1e-6, "as many as predicted lies in the middle");
        assert_eq!(MetricScale::fitting(metrics::OVERLAP, [0.2].into_iter()).position(0.25), 0.25);
        assert_eq!(MetricScale::fitting(metrics::OVERLAP, [0.2, 3.0].into_iter()).ends, [0.0, 3.0], "of many children");
        assert_eq!(MetricScale::fitting(metrics::DEPTH, [].into_iter()).ends, [0.0, 1.0]);
        assert_eq!(MetricScale::fitting(metrics::DEPTH, [4.0].into_iter()).position(4.0), 0.5);
    }
}
