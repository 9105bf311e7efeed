//! The tree statistics that `info` and `render` print with `--json`; the same numbers as in the window.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::accel::{Accel, FileTree};
use crate::lab::millis;
use bvhscope_engine::settings::{Curve, Passes};
use bvhscope_engine::tree::levels::Levels;
use bvhscope_engine::tree::overlap::EndPointOverlap;
use bvhscope_engine::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST};
use bvhscope_engine::tree_file::Fault;

/// Statistics of a tree. Field names are the JSON names.
#[derive(Debug, Serialize)]
pub struct TreeNumbers {
    pub builder: String,
    pub container: &'static str,
    /// The settings of the build; absent for a tree that was read.
    #[serde(flatten)]
    pub settings: Option<SettingNumbers>,
    /// The file that holds the tree, what it says of its settings, and what is wrong with it; absent for a tree that was built.
    #[serde(flatten)]
    pub file: Option<FileNumbers>,
    pub threads: usize,
    /// Milliseconds of the binary tree; null where the file does not say.
    pub build_ms: Option<f64>,
    /// Milliseconds until rays can be traced at full speed: binary and wide tree.
    pub ready_ms: Option<f64>,
    pub build_stages_ms: BTreeMap<&'static str, f64>,
    pub mtriangles_per_s: Option<f64>,
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
    /// Smallest, mean and largest number of children of an interior node; left out for a binary tree.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arity: Option<[f32; 3]>,
    /// Number of interior nodes by number of children; left out for a binary tree.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nodes_per_arity: Option<Vec<u32>>,
    /// Smallest, mean and largest number of primitives in a leaf.
    pub leaf_size: [f32; 3],
    pub tree_bytes: usize,
    pub triangle_bytes: usize,
    pub wide_node_bytes: usize,
    pub wide_triangle_bytes: usize,
    /// Bytes of the node table of the overlay.
    pub overlay_bytes: usize,
    /// Bytes of the tree and its triangles, per triangle.
    pub bytes_per_triangle: f64,
    /// Bytes of the wide tree and its triangles, per triangle.
    pub wide_bytes_per_triangle: f64,
}

/// The settings of a build.
#[derive(Debug, Serialize)]
pub struct SettingNumbers {
    pub threshold: u32,
    pub epsilon: f32,
    pub curve: Curve,
    pub optimize: Passes,
    /// Rounds of annealing, where that is one of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rounds: Option<u32>,
}

/// What a tree file says of its tree, and what is wrong with that.
#[derive(Debug, Serialize)]
pub struct FileNumbers {
    pub tree: String,
    /// Most children of a node, as the file states it.
    pub max_arity: u32,
    pub builder_settings: Option<String>,
    pub empty_nodes: u32,
    pub faults: Vec<FaultNumbers>,
}

/// All faults of one kind, numbered as in the file.
#[derive(Debug, Serialize)]
pub struct FaultNumbers {
    pub kind: &'static str,
    pub count: u64,
    pub first: u32,
    pub excess: f32,
    /// The fault as a sentence.
    #[serde(skip)]
    pub text: String,
}

impl From<&Fault> for FaultNumbers {
    fn from(fault: &Fault) -> Self {
        let &Fault { kind, count, first, excess, .. } = fault;
        Self { kind: kind.name(), count, first, excess, text: fault.to_string() }
    }
}

impl From<&FileTree> for FileNumbers {
    fn from(file: &FileTree) -> Self {
        Self {
            tree: file.path.display().to_string(),
            max_arity: file.header.arity,
            builder_settings: file.header.settings_text(),
            empty_nodes: file.empty_nodes,
            faults: file.faults.iter().map(FaultNumbers::from).collect(),
        }
    }
}

impl TreeNumbers {
    /// The statistics of `accel`, whose end-point overlap is `epo`.
    pub fn new(accel: &Accel, epo: EndPointOverlap) -> Self {
        let (settings, report) = (&accel.settings, &accel.report);
        let (stats, wide) = (&report.stats, accel.wide());
        let is_wide = !stats.is_binary();
        Self {
            builder: accel.builder_name().into_owned(),
            container: settings.container.name(),
            settings: accel.file.is_none().then(|| SettingNumbers {
                threshold: settings.threshold,
                epsilon: settings.epsilon,
                curve: settings.curve,
                optimize: settings.passes(),
                rounds: settings.annealing_rounds(),
            }),
            file: accel.file.as_ref().map(FileNumbers::from),
            threads: report.threads,
            build_ms: accel.build_ms(),
            ready_ms: accel.build_ms().map(|ms| ms + millis(wide.collapse_time)),
            build_stages_ms: report.stages.stages.iter().map(|&(name, time)| (name, millis(time))).collect(),
            mtriangles_per_s: accel.build_ms().map(|_| report.mtriangles_per_s()),
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
            arity: is_wide.then(|| [stats.min_arity() as f32, stats.mean_arity, stats.max_arity as f32]),
            nodes_per_arity: is_wide.then(|| stats.arity_histogram.clone()),
            leaf_size: [stats.min_leaf_size as f32, stats.mean_leaf_size, stats.max_leaf_size as f32],
            tree_bytes: report.tree_bytes,
            triangle_bytes: report.triangle_bytes,
            wide_node_bytes: wide.tree.node_bytes(),
            wide_triangle_bytes: wide.tree.leaf_bytes(),
            overlay_bytes: Levels::bytes(stats.nodes),
            bytes_per_triangle: report.bytes_per_triangle(),
            wide_bytes_per_triangle: wide.bytes_per_triangle(),
        }
    }
}
