//! Numbers of the nodes of a tree, by the rows of [`metrics`](crate::catalog::metrics).

use std::sync::Arc;

use bvhscope_engine::tree::visits::Visits;

use super::Accel;
use crate::catalog::metrics::{Metric, NodeReading, Source};

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
            depth: None,
        }
    }

    /// The data of a metric are known.
    pub fn has(&self, source: Source) -> bool {
        self.reading().has(source)
    }

    /// The value of `node`; `None` where it has none, as a leaf has no overlap of children, or where it is not known.
    pub fn get(&self, metric: &Metric, node: u32) -> Option<f32> {
        (metric.get)(&self.reading(), node)
    }

    /// The value of `node`, which is at this depth.
    pub fn at_depth(&self, metric: &Metric, node: u32, depth: u32) -> Option<f32> {
        (metric.get)(&NodeReading { depth: Some(depth), ..self.reading() }, node)
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
