//! Numbers of single nodes, by which views rank and colour them.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use bvhscope_engine::tree::node_metrics;
use bvhscope_engine::tree::visits::Visits;
use bvhscope_engine::with_tree;

use crate::accel::Accel;

/// Predicted visits below which measured over predicted visits say nothing: chance would decide.
pub const LEAST_PREDICTED_VISITS: f64 = 16.0;

/// A number of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum NodeMetric {
    /// What the node alone adds to the SAH cost of the tree, 0 to 1; see [`node_metrics::sah_share`].
    Cost,
    /// Overlap of the children, of two 0 to 1; see [`node_metrics::overlap`].
    Overlap,
    /// Part that the children leave empty, 0 to 1; see [`node_metrics::empty_space`].
    EmptySpace,
    /// Measured over predicted visits; see [`Visits::predicted`].
    VisitRatio,
    /// Surface area over the root's, 0 to 1; see [`node_metrics::area_share`].
    Area,
    /// Primitives below the node.
    Primitives,
    /// Levels below the root.
    Depth,
}

impl NodeMetric {
    /// All metrics, in the order of menus.
    pub const ALL: [Self; 7] =
        [Self::Cost, Self::Overlap, Self::EmptySpace, Self::VisitRatio, Self::Area, Self::Primitives, Self::Depth];
    /// Those by which a node can be bad.
    pub const RANKED: [Self; 4] = [Self::Cost, Self::Overlap, Self::EmptySpace, Self::VisitRatio];

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Cost => "SAH cost",
            Self::Overlap => "Overlap",
            Self::EmptySpace => "Empty space",
            Self::VisitRatio => "Visits",
            Self::Area => "Area",
            Self::Primitives => "Triangles",
            Self::Depth => "Depth",
        }
    }

    /// What it is, in one sentence with its formula.
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::Cost => {
                "What the node alone adds to the SAH cost of the tree: area / root's area × (1 traversal step, or 1 test for each triangle of a leaf)"
            }
            Self::Overlap => {
                "Surface of what both children have in common, over the node's own: rays there must visit both. Of more than two, the sum over all pairs"
            }
            Self::EmptySpace => {
                "Part of the node that its children leave empty: 1 − (areas of the children) / (their number × own area)"
            }
            Self::VisitRatio => {
                "Visits by the chosen rays, over those that its area predicts (area / root's area × rays that hit the root): what the SAH does not know"
            }
            Self::Area => "Surface area over the root's: how likely a ray that hits the root hits the node",
            Self::Primitives => "Triangles below the node: where the model is dense",
            Self::Depth => "Levels below the root, which has depth 0",
        }
    }

    /// Whether it can only be told once visits are measured.
    pub const fn needs_visits(self) -> bool {
        matches!(self, Self::VisitRatio)
    }

    /// Whether its values span several powers of ten, so that colours follow their logarithm.
    const fn is_logarithmic(self) -> bool {
        matches!(self, Self::Cost | Self::VisitRatio | Self::Area | Self::Primitives)
    }
}

/// The numbers of the nodes of one tree.
#[derive(Debug, Clone, Copy)]
pub struct NodeValues<'a> {
    /// The tree.
    pub accel: &'a Accel,
    /// Its visits, where they are measured.
    pub visits: Option<&'a Visits>,
}

impl NodeValues<'_> {
    /// The value of `node`; `None` where it has none, as a leaf has no overlap of children, or where it is not known.
    pub fn get(&self, metric: NodeMetric, node: u32) -> Option<f32> {
        with_tree!(&self.accel.tree, tree => match metric {
            NodeMetric::Cost => Some(node_metrics::sah_share(tree, node, &self.accel.report.stats)),
            NodeMetric::Overlap => node_metrics::overlap(tree, node),
            NodeMetric::EmptySpace => node_metrics::empty_space(tree, node),
            NodeMetric::Area => Some(node_metrics::area_share(tree, node)),
            NodeMetric::VisitRatio => {
                let (measured, predicted) = self.visits(node)?;
                (predicted >= LEAST_PREDICTED_VISITS).then(|| (f64::from(measured) / predicted) as f32)
            }
            NodeMetric::Primitives => {
                let own = &tree.nodes[node as usize];
                let below = || Some(self.accel.known_ancestry()?.primitive_counts[node as usize]);
                (if own.is_leaf() { Some(own.count) } else { below() }).map(|count| count as f32)
            }
            NodeMetric::Depth => self.accel.known_ancestry().map(|ancestry| ancestry.depth(node) as f32),
        })
    }

    /// Measured and predicted visits of `node`; `None` until they are measured.
    pub fn visits(&self, node: u32) -> Option<(u32, f64)> {
        let visits = self.visits?;
        let measured = *visits.counts.get(node as usize)?;
        Some((measured, with_tree!(&self.accel.tree, tree => visits.predicted(tree, node))))
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
    metric: NodeMetric,
    /// Values at the ends of the scale.
    pub ends: [f32; 2],
}

impl MetricScale {
    /// The scale that fits `values`. Fractions have one from 0 to 1, and measured over predicted visits one around 1.
    pub fn fitting(metric: NodeMetric, values: impl Iterator<Item = f32>) -> Self {
        let ends = match metric {
            // Pairs of more than two children add up beyond 1.
            NodeMetric::Overlap => [0.0, values.fold(1.0, f32::max)],
            NodeMetric::EmptySpace => [0.0, 1.0],
            NodeMetric::VisitRatio => [0.125, 8.0],
            _ => {
                let usable = |value: &f32| value.is_finite() && (*value > 0.0 || !metric.is_logarithmic());
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
        let along = |value: f32| if self.metric.is_logarithmic() { value.max(f32::MIN_POSITIVE).ln() } else { value };
        let [low, high] = self.ends.map(along);
        if high > low { ((along(value) - low) / (high - low)).clamp(0.0, 1.0) } else { 0.5 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_logarithmic_where_values_span_powers_of_ten() {
        let scale = MetricScale::fitting(NodeMetric::Area, [1.0, 0.01, 0.0, 0.1].into_iter());
        assert_eq!(scale.ends, [0.01, 1.0]);
        assert!((scale.position(0.1) - 0.5).abs() < 1e-6);
        assert_eq!([0.0, 0.01, 1.0, 2.0].map(|value| scale.position(value)), [0.0, 0.0, 1.0, 1.0]);
        let visits = MetricScale::fitting(NodeMetric::VisitRatio, [3.0].into_iter());
        assert!((visits.position(1.0) - 0.5).abs() < 1e-6, "as many as predicted lies in the middle");
        assert_eq!(MetricScale::fitting(NodeMetric::Overlap, [0.2].into_iter()).position(0.25), 0.25);
        assert_eq!(
            MetricScale::fitting(NodeMetric::Overlap, [0.2, 3.0].into_iter()).ends,
            [0.0, 3.0],
            "of many children"
        );
        assert_eq!(MetricScale::fitting(NodeMetric::Depth, [].into_iter()).ends, [0.0, 1.0]);
        assert_eq!(MetricScale::fitting(NodeMetric::Depth, [4.0].into_iter()).position(4.0), 0.5);
    }
}
