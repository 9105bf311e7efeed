//! The interface between an engine and the benchmark.

use std::time::{Duration, Instant};

use bvhscope_engine::geometry::{Aabb, Triangle};
use bvhscope_engine::tree::Tree;

use crate::rays::{Tally, Workload};

/// The two clocks of one build.
#[derive(Debug, Clone, Copy)]
pub struct BuildTimes {
    /// Until the binary tree is there; `None` where the engine hands out none.
    pub binary: Option<Duration>,
    /// Until everything is there that the engine's fastest rays need: wide tree, and triangles in the order of its leaves.
    pub ready: Duration,
}

/// Builds once and returns the time that it took.
pub type Build<'a> = Box<dyn Fn() -> BuildTimes + 'a>;
/// Traces all rays of a workload once.
pub type Run<'a> = Box<dyn FnMut() -> Tally + Send + 'a>;
/// A workload in the engine's own form; `None` where the interface has no such query.
pub type Prepare<'a> = Box<dyn Fn(&'a Workload) -> Option<Run<'a>> + 'a>;

/// A way to build, by name and number of threads.
pub struct Builder<'a> {
    /// The engine's name.
    pub engine: &'static str,
    /// Its setting.
    pub name: String,
    /// Threads that it uses.
    pub threads: usize,
    /// Builds the acceleration structure from the triangles.
    pub build: Build<'a>,
}

/// A way to bring a tree to triangles that have moved, by name and number of threads.
pub struct Updater<'a> {
    /// The engine's name.
    pub engine: &'static str,
    /// Its setting, with what becomes of the tree.
    pub name: String,
    /// Threads that it uses.
    pub threads: usize,
    /// Updates the acceleration structure to a moment, and returns the time that it took.
    pub update: Box<dyn FnMut(usize) -> BuildTimes + 'a>,
    /// Traces primary rays through it.
    pub trace: Box<dyn Fn(&Workload) -> Tally + 'a>,
}

/// A way to trace.
pub struct Interface<'a> {
    /// The engine's name.
    pub engine: &'static str,
    /// The setting that its tree was built with, by the name of the [`Builder`].
    pub setting: String,
    /// Name of the interface: "single", "packet 8", ….
    pub name: &'static str,
    /// Makes a run of a workload.
    pub prepare: Prepare<'a>,
}

/// A tree that can be judged.
pub struct Judged {
    /// The engine's name.
    pub engine: &'static str,
    /// Its setting.
    pub name: String,
    /// The binary tree in this crate's form, where the engine shows it.
    pub tree: Option<Tree<Aabb>>,
    /// The triangles in the order of the tree's leaves; empty where there is no tree.
    pub leaf_triangles: Vec<Triangle>,
    /// Bytes of tree and triangles, ready to be traced; `None` where they are not known.
    pub bytes: Option<usize>,
}

/// The name of this engine.
pub const OWN: &str = "bvhscope";

/// How long `run` takes; its result is dropped afterwards.
pub fn timed<T>(run: impl FnOnce() -> T) -> Duration {
    let start = Instant::now();
    let result = run();
    let elapsed = start.elapsed();
    drop(std::hint::black_box(result));
    elapsed
}
