//! Setup of a measurement: a scene, the settings of a tree, and the rays.

use std::sync::Arc;

use super::population::{Population, Populations, ViewRays};
use crate::accel::Accel;
use crate::camera::Camera;
use crate::ray_file::RaySet;
use crate::render::RenderSettings;
use crate::scene::{Instancing, LoadOptions, Scene};
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
    /// Other forms of a scene of copies, which `compare` measures beside its own.
    pub forms: Vec<SceneForm>,
}

/// A scene of copies in one of its forms.
#[derive(Debug, Clone)]
pub struct SceneForm {
    /// The scene, flat or in two levels.
    pub scene: Arc<Scene>,
    /// Most parts for each copy in the tree above, 1 for whole copies; `None` of the flat scene.
    pub open: Option<f32>,
}

impl SceneForm {
    /// The form of a scene as it is.
    pub fn of(scene: &Arc<Scene>) -> Self {
        Self { scene: Arc::clone(scene), open: scene.copies.is_some().then_some(1.0) }
    }

    /// How the model is loaded in this form.
    pub fn instances(&self) -> Instancing {
        if self.open.is_some() { Instancing::TwoLevel } else { Instancing::Flat }
    }

    /// How far the tree over the copies is opened, where it is.
    pub fn opened(&self) -> Option<f32> {
        self.open.filter(|open| *open > 1.0)
    }
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

    /// The form in which a tree is measured; `None` where the scene has no others.
    pub fn form_of(&self, contender: &Contender) -> Option<SceneForm> {
        let own = || (!self.forms.is_empty()).then(|| SceneForm::of(&self.scene));
        contender.form.clone().or_else(own)
    }

    /// The scene that a tree is built of.
    pub fn scene_of<'a>(&'a self, contender: &'a Contender) -> &'a Arc<Scene> {
        contender.form.as_ref().map_or(&self.scene, |form| &form.scene)
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
    /// The form of the scene, where it is not that of the subject.
    pub form: Option<SceneForm>,
}

impl From<Setup> for Contender {
    fn from(setup: Setup) -> Self {
        Self { setup, read: None, label: None, form: None }
    }
}

impl Contender {
    /// The tree of a file, traced by `threads` threads, 0 for all.
    pub fn of_file(accel: &Arc<Accel>, threads: usize) -> Self {
        let setup = Setup { build: accel.settings, preset: None, threads };
        let label = accel.file.as_ref().and_then(|file| file.label.clone());
        Self { setup, read: Some(Arc::clone(accel)), label, form: None }
    }

    /// How far the tree over the copies is opened, where it is.
    pub fn opened(&self) -> Option<f32> {
        self.form.as_ref()?.opened()
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
