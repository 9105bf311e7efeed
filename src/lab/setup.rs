//! What to measure: a scene, the settings of a tree, and the rays.

use std::sync::Arc;

use crate::camera::Camera;
use crate::scene::Scene;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::{BuildSettings, Preset};
use bvhscope_engine::tree::traverse::Traversal;

/// A scene to measure, with the model name for its rows.
#[derive(Debug, Clone)]
pub struct Subject {
    /// The model as the user named it.
    pub model: String,
    /// The scene.
    pub scene: Arc<Scene>,
}

/// A tree to measure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setup {
    /// Build settings.
    pub build: BuildSettings,
    /// The preset that the settings come from, if any.
    pub preset: Option<Preset>,
    /// Threads for building and tracing; 0 for all.
    pub threads: usize,
}

/// The rays to trace and the number of repetitions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TraceView {
    /// The camera.
    pub camera: Camera,
    /// Width and height in pixels; one ray goes through the centre of each pixel.
    pub size: [u32; 2],
    /// Traversal order, both for timing and for counting.
    pub traversal: Traversal,
    /// SIMD level for tracing.
    pub simd: SimdLevel,
    /// Repetitions of each measurement, at least 1.
    pub repeat: usize,
}
