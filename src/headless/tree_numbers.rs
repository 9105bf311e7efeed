//! The tree statistics that `info` and `render` print with `--json`; the same numbers as in the window.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::accel::Accel;
use crate::lab::millis;
use bvhscope_engine::settings::{Curve, Passes};
use bvhscope_engine::tree::levels::Levels;
use bvhscope_engine::tree::overlap::EndPointOverlap;
use bvhscope_engine::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST};

/// Statistics of a tree. Field names are the JSON names.
#[derive(Debug, Serialize)]
pub struct TreeNumbers {
    pub builder: &'static str,
    pub container: &'static str,
    pub threshold: u32,
    pub epsilon: f32,
    pub curve: Curve,
    pub optimize: Passes,
    pub threads: usize,
    pub build_ms: f64,
    pub build_stages_ms: BTreeMap<&'static str, f64>,
    pub mtriangles_per_s: f64,
    pub collapse_ms: f64,
    pub sah_cost: f32,
    /// SAH cost before the optimisation passes, under "tree", and after each pass.
    pub optimize_sah_costs: BTreeMap<&'static str, f64>,
    pub traversal_cost: f32,
    pub intersection_cost: f32,
    pub epo: f32,
    /// Number of triangles that `epo` was computed from; fewer than those of the model where it is an estimate.
    pub epo_triangles: usize,
    pub nodes: usize,
    pub leaves: usize,
    pub max_depth: u32,
    pub mean_leaf_depth: f32,
    /// Smallest, mean and largest number of primitives in a leaf.
    pub leaf_size: [f32; 3],
    pub tree_bytes: usize,
    pub triangle_bytes: usize,
    pub wide_node_bytes: usize,
    pub wide_triangle_bytes: usize,
    /// Bytes of the node table of the overlay.
    pub overlay_bytes: usize,
    /// Bytes of the binary tree and its triangles, per triangle.
    pub bytes_per_triangle: f64,
    /// Bytes of the wide tree and its triangles, per triangle.
    pub wide_bytes_per_triangle: f64,
}

impl TreeNumbers {
    /// The statistics of `accel`, whose end-point overlap is `epo`.
    pub fn new(accel: &Accel, epo: EndPointOverlap) -> Self {
        let (settings, report) = (&accel.settings, &accel.report);
        let (stats, wide) = (&report.stats, accel.wide());
        Self {
            builder: settings.builder.name(),
            container: settings.container.name(),
            threshold: settings.threshold,
            epsilon: settings.epsilon,
            curve: settings.curve,
            optimize: settings.passes(),
            threads: report.threads,
            build_ms: millis(report.build_time),
            build_stages_ms: report.stages.stages.iter().map(|&(name, time)| (name, millis(time))).collect(),
            mtriangles_per_s: report.mtriangles_per_s(),
            collapse_ms: millis(wide.collapse_time),
            sah_cost: stats.sah_cost,
            optimize_sah_costs: report.stages.costs.iter().copied().collect(),
            traversal_cost: TRAVERSAL_COST,
            intersection_cost: INTERSECTION_COST,
            epo: epo.value,
            epo_triangles: epo.sampled,
            nodes: stats.nodes,
            leaves: stats.leaves,
            max_depth: stats.max_depth,
            mean_leaf_depth: stats.mean_leaf_depth,
            leaf_size: [stats.min_leaf_size as f32, stats.mean_leaf_size, stats.max_leaf_size as f32],
            tree_bytes: report.tree_bytes,
            triangle_bytes: report.triangle_bytes,
            wide_node_bytes: wide.tree.node_bytes(),
            wide_triangle_bytes: wide.tree.triangle_bytes(),
            overlay_bytes: Levels::bytes(stats.nodes),
            bytes_per_triangle: report.bytes_per_triangle(),
            wide_bytes_per_triangle: wide.bytes_per_triangle(),
        }
    }
}
