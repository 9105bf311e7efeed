//! Setup of a measurement: a scene, the settings of a tree, and the rays.

use std::sync::Arc;

use super::population::{Population, Populations, ViewRays};
use crate::accel::Accel;
use crate::camera::Camera;
use crate::ray_file::RaySet;
use crate::render::RenderSettings;
use crate::scene::{LoadOptions, Scene};
use crate::view::Place;
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
    /// Trees of the scene that files hold, measured beside those that are built. They cannot be built with other numbers of
    /// threads, so scaling leaves them out.
    pub trees: Vec<Arc<Accel>>,
    /// The population of rays of a file.
    pub rays: Option<Arc<RaySet>>,
    /// How the scene was loaded.
    pub load: LoadOptions,
}

impl Subject {
    /// The rays of a population through this scene.
    pub fn rays_of(&self, population: Population, view: &TraceView, settings: &RenderSettings) -> ViewRays {
        ViewRays::new(population, view.camera, view.size, settings).with_file(self.rays.clone())
    }

    /// Those of `setups` of which the scene can have trees; all of them where it can have none, which then says why.
    pub fn possible(&self, setups: &[Setup]) -> Vec<Setup> {
        let is_possible = |setup: &&Setup| Accel::refusal(&self.scene, &setup.build).is_none();
        let possible: Vec<Setup> = setups.iter().filter(is_possible).copied().collect();
        if possible.is_empty() { setups.to_vec() } else { possible }
    }

    /// `setups`, and after them the trees from files, traced by `threads` threads, 0 for all.
    pub fn contenders(&self, setups: &[Setup], threads: usize) -> Vec<Contender> {
        let read = self.trees.iter().map(|accel| Contender::of_file(accel, threads));
        setups.iter().map(|&setup| setup.into()).chain(read).collect()
    }
}

/// A tree to measure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setup {
    /// Build settings.
    pub build: BuildSettings,
    /// The preset that was given or that stands for the settings, if any: command lines of rows name it.
    pub preset: Option<Preset>,
    /// Threads for building and tracing; 0 for all.
    pub threads: usize,
}

/// A tree to measure: rebuilt for each repetition, or one that a file holds.
#[derive(Debug, Clone)]
pub struct Contender {
    /// How it is built; of a tree from a file only the threads count, which trace it.
    pub setup: Setup,
    /// The tree from a file.
    pub read: Option<Arc<Accel>>,
    /// Name of the tree in tables and plots in place of its file or settings.
    pub label: Option<String>,
}

impl From<Setup> for Contender {
    fn from(setup: Setup) -> Self {
        Self { setup, read: None, label: None }
    }
}

impl Contender {
    /// The tree of a file, traced by `threads` threads, 0 for all.
    pub fn of_file(accel: &Arc<Accel>, threads: usize) -> Self {
        let setup = Setup { build: accel.settings, preset: None, threads };
        let label = accel.file.as_ref().and_then(|file| file.label.clone());
        Self { setup, read: Some(Arc::clone(accel)), label }
    }
}

/// The rays to trace and the number of repetitions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TraceView {
    /// The camera.
    pub camera: Camera,
    /// Where it stands.
    pub place: Place,
    /// Width and height in pixels; one ray goes through the centre of each pixel.
    pub size: [u32; 2],
    /// Traversal order, both for timing and for counting.
    pub traversal: Traversal,
    /// SIMD level for tracing.
    pub simd: SimdLevel,
    /// Repetitions of each measurement, at least 1.
    pub repeat: usize,
    /// Rays whose cost is measured too, once for each tree; see [`ViewRays`](super::population::ViewRays).
    pub populations: Populations,
    /// Number of samples of which the end-point overlap is estimated; exact without.
    pub epo_samples: Option<usize>,
}
