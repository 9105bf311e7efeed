//! One measured tree: the row of every table, the point of every plot, the object of every JSON line.

use std::collections::BTreeMap;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use bvhscope_engine::settings::{Curve, Passes};
use bvhscope_engine::tree::ContainerKind;

/// One measured tree. The field names are the JSON names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// The job that it belongs to: "bench", "sweep", "scaling" or "compare".
    pub command: String,
    /// The model as it was given.
    pub model: String,
    /// Triangles of the model.
    pub triangles: usize,
    /// Name of the builder.
    pub builder: String,
    /// Name of the preset, where the settings came from one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preset: Option<String>,
    /// Boxes or spheres.
    pub container: ContainerKind,
    /// δ.
    pub threshold: u32,
    /// ε.
    pub epsilon: f32,
    /// Along which line the triangles were sorted.
    #[serde(default)]
    pub curve: Curve,
    /// Passes over the finished tree.
    #[serde(default)]
    pub optimize: Passes,
    /// "ordered" or "paper".
    pub traversal: String,
    /// Threads of building and tracing.
    pub threads: usize,
    /// Width of the traced picture in pixels.
    pub width_px: u32,
    /// Height of the traced picture in pixels.
    pub height_px: u32,
    /// Repetitions behind each median.
    pub repeat: usize,
    /// Median wall-clock time of a build.
    pub build_ms: f64,
    /// Fastest and slowest build.
    pub build_ms_spread: [f64; 2],
    /// Median time of each stage.
    pub build_stages_ms: BTreeMap<String, f64>,
    /// Millions of triangles built a second, from `build_ms`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mtriangles_per_s: Option<f64>,
    /// Median wall-clock time of tracing the primary rays, without shading.
    pub trace_ms: f64,
    /// Fastest and slowest trace.
    pub trace_ms_spread: [f64; 2],
    /// Primary rays: one through the centre of each pixel.
    pub rays: u64,
    /// Rays that hit something.
    pub hits: u64,
    /// Millions of primary rays a second, from `trace_ms`.
    pub mrays_per_s: f64,
    /// Container and primitive tests a ray together.
    pub tests_per_ray: f64,
    /// Container tests a ray.
    pub container_tests_per_ray: f64,
    /// Primitive tests a ray.
    pub primitive_tests_per_ray: f64,
    /// SAH cost.
    pub sah_cost: f64,
    /// What the SAH cost takes for a container test.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traversal_cost: Option<f64>,
    /// What the SAH cost takes for a primitive test.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub intersection_cost: Option<f64>,
    /// End-point overlap.
    pub epo: f64,
    /// Nodes, leaves included.
    pub nodes: usize,
    /// Nodes that hold primitives.
    pub leaves: usize,
    /// Depth of the deepest node, root 0.
    pub max_depth: u32,
    /// Depth of a leaf on average.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_leaf_depth: Option<f64>,
    /// Primitives in a leaf: smallest, mean, largest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub leaf_size: Option<[f64; 3]>,
    /// Bytes of nodes and primitive indices.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tree_bytes: Option<usize>,
    /// Bytes of the triangles in leaf order.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub triangle_bytes: Option<usize>,
    /// Bytes of tree and leaf-ordered triangles, for each triangle.
    pub bytes_per_triangle: f64,
    /// Making the wide tree out of the binary one, in milliseconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub collapse_ms: Option<f64>,
    /// The same primary rays in packets through the wide tree, in milliseconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wide_trace_ms: Option<f64>,
    /// Millions of rays a second in packets through the wide tree.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wide_mrays_per_s: Option<f64>,
    /// Bytes of the wide tree's nodes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wide_node_bytes: Option<usize>,
    /// Bytes of the wide tree's triangles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wide_triangle_bytes: Option<usize>,
    /// Bytes of the wide tree and its triangles, for each triangle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wide_bytes_per_triangle: Option<f64>,
    /// Bytes of the list that the window's overlay keeps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub overlay_bytes: Option<usize>,
    /// Scaling: build time with one thread over this one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speedup: Option<f64>,
    /// Scaling: trace time with one thread over this one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trace_speedup: Option<f64>,
    /// What was skipped or repaired while the model was loaded, in words.
    #[serde(default)]
    pub warnings: Vec<String>,
}

impl Measurement {
    /// What the tree was built with, in short: the preset, or builder, curve and passes.
    pub fn builder_name(&self) -> String {
        if let Some(preset) = &self.preset {
            return preset.clone();
        }
        let mut parts = vec![self.builder.clone()];
        if self.curve != Curve::Morton {
            parts.push(self.curve.name().to_owned());
        }
        if self.optimize != Passes::NONE {
            parts.push(self.optimize.to_string());
        }
        parts.join(" + ")
    }
}

/// Milliseconds of a duration.
pub fn millis(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

/// A rayon pool of `threads` threads, 0 for all; the text of the error is for users.
pub fn pool(threads: usize) -> Result<rayon::ThreadPool, String> {
    let wanted = || if threads == 0 { available_threads() } else { threads };
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|index| format!("bvhscope-{index}"))
        .build()
        .map_err(|error| format!("{} threads cannot be started ({error}): ask for fewer with --threads", wanted()))
}

/// Threads that the machine can run at once.
pub fn available_threads() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}
