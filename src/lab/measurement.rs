//! The measurement of one tree: a table row, a plot point, a JSON line.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use serde::{Deserialize, Deserializer, Serialize};

use super::population::MeasuredRays;
use super::speedup::prediction::ScalingPrediction;
use crate::text::file_name;
use bvhscope_engine::settings::{Curve, Passes};
use bvhscope_engine::tree::ContainerKind;

pub use crate::threads::{available_threads, pool};

/// The measurement of one tree. Field names are the JSON names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// The job that made it: "bench", "sweep", "scaling", "compare" or "diff".
    pub command: String,
    /// The model as the user named it.
    pub model: String,
    /// Number of triangles of the model.
    pub triangles: usize,
    /// Name of the builder.
    pub builder: String,
    /// The file that holds the tree, where it was read: threshold, ε, curve and passes then mean nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tree: Option<String>,
    /// Name of the preset that the settings come from, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preset: Option<String>,
    /// Boxes or spheres.
    pub container: ContainerKind,
    /// The threshold δ.
    pub threshold: u32,
    /// The reduction exponent ε.
    pub epsilon: f32,
    /// Space-filling curve along which the primitives were sorted.
    #[serde(default)]
    pub curve: Curve,
    /// Optimisation passes.
    #[serde(default)]
    pub optimize: Passes,
    /// Rounds of annealing, where that is one of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rounds: Option<u32>,
    /// Traversal order, "ordered" or "paper".
    pub traversal: String,
    /// Number of threads for building and tracing.
    pub threads: usize,
    /// Width of the traced picture in pixels.
    pub width_px: u32,
    /// Height of the traced picture in pixels.
    pub height_px: u32,
    /// Number of repetitions behind each median.
    pub repeat: usize,
    /// Median wall-clock time of building the binary tree, in milliseconds: the paper's. NaN, in JSON null, where the file of the
    /// tree does not say.
    #[serde(deserialize_with = "nan_where_null")]
    pub build_ms: f64,
    /// Fastest and slowest build in milliseconds.
    #[serde(deserialize_with = "nans_where_null")]
    pub build_ms_spread: [f64; 2],
    /// Median wall-clock time from the triangles to everything that the fastest rays are traced through, in milliseconds: the
    /// binary tree and the wide one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ready_ms: Option<f64>,
    /// Median time of each build stage in milliseconds.
    pub build_stages_ms: BTreeMap<String, f64>,
    /// Millions of triangles built per second, from `build_ms`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mtriangles_per_s: Option<f64>,
    /// Median wall-clock time of tracing the primary rays in milliseconds, without shading.
    pub trace_ms: f64,
    /// Fastest and slowest trace in milliseconds.
    pub trace_ms_spread: [f64; 2],
    /// Number of primary rays, one through the centre of each pixel.
    pub rays: u64,
    /// Number of rays that hit something.
    pub hits: u64,
    /// Millions of primary rays per second, from `trace_ms`.
    pub mrays_per_s: f64,
    /// Container and primitive tests per ray.
    pub tests_per_ray: f64,
    /// Container tests per ray.
    pub container_tests_per_ray: f64,
    /// Primitive tests per ray.
    pub primitive_tests_per_ray: f64,
    /// SAH cost, normalised by the surface area of the root.
    pub sah_cost: f64,
    /// Cost of a container test in the SAH cost.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traversal_cost: Option<f64>,
    /// Cost of a primitive test in the SAH cost.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub intersection_cost: Option<f64>,
    /// End-point overlap (Aila et al. 2013).
    pub epo: f64,
    /// Number of triangles that `epo` was computed from; fewer than those of the model where it is an estimate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub epo_triangles: Option<usize>,
    /// Number of nodes, leaves included.
    pub nodes: usize,
    /// Number of leaves.
    pub leaves: usize,
    /// Depth of the deepest node, root 0.
    pub max_depth: u32,
    /// Mean depth of the leaves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_leaf_depth: Option<f64>,
    /// Smallest, mean and largest number of primitives in a leaf.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub leaf_size: Option<[f64; 3]>,
    /// Hash of the binary tree, 16 hexadecimal digits: the same on every machine.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tree_hash: Option<String>,
    /// Hash of the wide tree.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wide_tree_hash: Option<String>,
    /// Bytes of nodes and primitive indices.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tree_bytes: Option<usize>,
    /// Bytes of the triangles in leaf order.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub triangle_bytes: Option<usize>,
    /// Bytes of tree and leaf-ordered triangles, per triangle of the model.
    pub bytes_per_triangle: f64,
    /// Time to collapse the binary tree into the wide tree, in milliseconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub collapse_ms: Option<f64>,
    /// Median time of tracing the same primary rays in packets through the wide tree, in milliseconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wide_trace_ms: Option<f64>,
    /// Millions of rays per second in packets through the wide tree.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wide_mrays_per_s: Option<f64>,
    /// Bytes of the wide tree's nodes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wide_node_bytes: Option<usize>,
    /// Bytes of the wide tree's triangles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wide_triangle_bytes: Option<usize>,
    /// Bytes of the wide tree and its triangles, per triangle of the model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wide_bytes_per_triangle: Option<f64>,
    /// Bytes of the node table of the overlay.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub overlay_bytes: Option<usize>,
    /// Scaling: build time with one thread divided by this one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speedup: Option<f64>,
    /// Scaling: trace time with one thread divided by this one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trace_speedup: Option<f64>,
    /// Scaling: the speed-up predicted for more cores, in the row of one thread, where that was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub predicted_scaling: Option<ScalingPrediction>,
    /// What rays of each population cost, where that was measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub populations: Vec<MeasuredRays>,
    /// Warnings of loading the model.
    #[serde(default)]
    pub warnings: Vec<String>,
}

fn nan_where_null<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Option::<f64>::deserialize(deserializer).map(|number| number.unwrap_or(f64::NAN))
}

fn nans_where_null<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f64; 2], D::Error> {
    <[Option<f64>; 2]>::deserialize(deserializer).map(|numbers| numbers.map(|number| number.unwrap_or(f64::NAN)))
}

impl Measurement {
    /// Whether the tree was built by AAC with the row's settings.
    pub fn is_aac(&self) -> bool {
        self.builder == "aac" && self.tree.is_none()
    }

    /// Name of the file that holds the tree, with the builder: "mine.bvh (embree)"; `None` for a tree that was built.
    pub fn file_name(&self) -> Option<String> {
        Some(file_and_builder(self.tree.as_ref()?.as_ref(), &self.builder))
    }

    /// The preset, or else builder, curve and passes, as a short name.
    pub fn builder_name(&self) -> String {
        if let Some(preset) = &self.preset {
            return preset.clone();
        }
        let mut parts = vec![self.builder.clone()];
        if self.tree.is_some() {
            return parts.concat();
        }
        if self.curve != Curve::Morton {
            parts.push(self.curve.name().to_owned());
        }
        if self.optimize != Passes::NONE {
            parts.push(self.optimize.to_string());
        }
        parts.join(" + ")
    }
}

/// Name of a tree from a file: "mine.bvh (embree)".
pub fn file_and_builder(path: &Path, builder: &str) -> String {
    format!("{} ({builder})", file_name(path))
}

/// A duration in milliseconds.
pub fn millis(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

/// `count` in millions per second where it took `ms` milliseconds; 0 where no time was measured.
pub(super) fn millions_per_second(count: u64, ms: f64) -> f64 {
    if ms > 0.0 { count as f64 / ms / 1e3 } else { 0.0 }
}
