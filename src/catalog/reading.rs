//! The source of a tree's numbers: reports of the engine and what was measured with the tree.

use std::collections::BTreeMap;

use bvhscope_engine::tree::overlap::EndPointOverlap;
use bvhscope_engine::{BuildReport, ContainerKind, WideBvh};

/// Median, and smallest and largest value of the repetitions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Times {
    /// The median in milliseconds.
    pub ms: f64,
    /// Fastest and slowest repetition in milliseconds; `None` where there are no repetitions to tell apart.
    pub spread: Option<[f64; 2]>,
}

impl Times {
    /// A time that was measured once, or read from a file.
    pub const fn single(ms: f64) -> Self {
        Self { ms, spread: None }
    }

    /// Median and spread of repetitions in milliseconds; a single one has no spread. Zero for none.
    pub fn of(mut repetitions: Vec<f64>) -> Self {
        repetitions.sort_by(f64::total_cmp);
        let (Some(&first), Some(&last)) = (repetitions.first(), repetitions.last()) else { return Self::single(0.0) };
        let middle = repetitions.len() / 2;
        let ms = if repetitions.len() % 2 == 1 {
            repetitions[middle]
        } else {
            (repetitions[middle - 1] + repetitions[middle]) * 0.5
        };
        Self { ms, spread: (repetitions.len() > 1).then_some([first, last]) }
    }
}

/// Everything that the numbers of one tree are read from. What is not known yet, or was not measured, is `None`.
#[derive(Debug, Clone)]
pub struct TreeReading<'a> {
    /// Number of triangles of the model.
    pub triangles: usize,
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
}

/// Averages over the primary rays of a view that enter the scene's box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnteringReading {
    /// Container and triangle tests in the binary tree.
    pub tests: f32,
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
    /// Container and primitive tests per ray, where they were counted.
    pub tests: Option<[f32; 2]>,
    /// Time through the binary tree, one ray after another.
    pub binary: Option<Times>,
    /// Time in packets through the wide tree.
    pub wide: Option<Times>,
    /// Speed of the whole picture in Mray/s, shading included, where rays were not timed alone.
    pub picture_mrays_per_s: Option<f64>,
}
