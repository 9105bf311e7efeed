//! Options of the command line, applied before the window opens.

use std::path::PathBuf;

use crate::app::shell::settings::SettingsUse;
use crate::app::state::{Preferences, SharedState, Wanted};
use crate::catalog::settings::Given;
use crate::overlay::{ColorBy, ContainerSet};
use crate::render::{ColorMap, Exposure, Light, NormalSource, Shading};
use crate::scene::{LoadOptions, SceneSource};
use crate::view::CameraChoice;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::tree::traverse::Traversal;

/// Options of the window. What is `None` stays as the last run left it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StartOptions {
    /// The model; `None` for the default built-in scene.
    pub source: Option<SceneSource>,
    /// The file that holds the tree; `None` builds it.
    pub tree_file: Option<PathBuf>,
    /// A state to show: its model and settings, in place of those of the last run.
    pub shared: Option<SharedState>,
    /// Settings of tree, picture and containers.
    pub overrides: CliOverrides,
    /// The camera for the first model.
    pub camera: Option<CameraChoice>,
    /// Permissions of the loader.
    pub load: LoadOptions,
    /// The file in which settings are saved; `None` saves none.
    pub settings_file: Option<PathBuf>,
    /// Whether saved settings are read.
    pub settings: SettingsUse,
    /// Open the model of the last run: after the graphics device was lost.
    pub restore: bool,
    /// Lose the graphics device after the first picture: for tests.
    pub lose_device: bool,
    /// Request a buffer that the driver refuses after the first picture: for tests.
    pub refuse_buffer: bool,
    /// Folders of lessons, beside the built-in ones.
    pub lessons: Vec<PathBuf>,
    /// Warnings to show at start.
    pub notices: Vec<String>,
}

/// Settings given on the command line; `None` where a flag was not given.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CliOverrides {
    /// Settings of the tree.
    pub build: Given,
    /// Number of threads for building and tracing; 0 for all.
    pub threads: Option<usize>,
    /// Shading mode.
    pub shading: Option<Shading>,
    /// Light of the lit shading mode.
    pub light: Option<Light>,
    /// Exposure of the lit shading mode.
    pub exposure: Option<Exposure>,
    /// Where normals come from.
    pub normals: Option<NormalSource>,
    /// Crease angle in degrees.
    pub crease_degrees: Option<f32>,
    /// Tree depth of the cluster colours.
    pub cluster_depth: Option<u32>,
    /// Traversal with which tests are counted.
    pub traversal: Option<Traversal>,
    /// Test counts at both ends of the heat map.
    pub heat_range: Option<[f32; 2]>,
    /// Colour map of the depth and heat shading modes.
    pub color_map: Option<ColorMap>,
    /// Catch the model's shadow on a ground.
    pub ground: Option<bool>,
    /// Draw the edges of the triangles.
    pub mesh_edges: Option<bool>,
    /// SIMD level.
    pub simd: Option<SimdLevel>,
    /// Number of antialiasing samples per pixel.
    pub samples: Option<u32>,
    /// The kinds of containers that are drawn over the picture.
    pub containers_shown: Option<ContainerSet>,
    /// First and last tree depth drawn.
    pub depth: Option<[u32; 2]>,
    /// Draw only the leaves within these depths.
    pub leaves_only: Option<bool>,
    /// Draw all depths above as well.
    pub parents: Option<bool>,
    /// Meaning of the containers' colours.
    pub color_by: Option<ColorBy>,
    /// Opacity of lines behind the surface.
    pub hidden_alpha: Option<f32>,
    /// Line width in points.
    pub line_width: Option<f32>,
    /// Maximum number of containers of each kind.
    pub budget: Option<u32>,
}

impl CliOverrides {
    /// Overrides the settings of the last run. Geometry or containers are shown where a setting concerns them.
    pub fn apply(&self, wanted: &mut Wanted, preferences: &mut Preferences) {
        self.build.apply(&mut wanted.build);
        set(self.threads, &mut wanted.threads);
        let render = &mut wanted.render;
        set(self.shading, &mut render.shading);
        set(self.light, &mut render.light);
        set(self.exposure, &mut render.exposure);
        set(self.normals, &mut render.normals);
        set(self.crease_degrees, &mut render.crease_degrees);
        set(self.cluster_depth, &mut render.cluster_depth);
        set(self.traversal, &mut render.traversal);
        set(self.heat_range.map(Some), &mut render.heat_range);
        set(self.color_map, &mut render.color_map);
        set(self.mesh_edges, &mut render.mesh_edges);
        set(self.ground, &mut render.ground);
        set(self.simd, &mut render.simd);
        set(self.samples, &mut render.samples);
        preferences.show_geometry |= self.shading.is_some() || self.mesh_edges.is_some();
        let overlay = &mut wanted.overlay;
        if let Some(kinds) = self.containers_shown {
            *overlay = overlay.with_kinds(kinds);
            preferences.show_containers = true;
        }
        set(self.depth.map(Some), &mut overlay.depth);
        set(self.leaves_only, &mut overlay.leaves_only);
        set(self.parents, &mut overlay.parents);
        set(self.color_by, &mut overlay.color_by);
        set(self.hidden_alpha, &mut overlay.hidden_alpha);
        set(self.line_width, &mut overlay.line_width);
        set(self.budget.map(Some), &mut overlay.budget);
    }
}

/// Replaces `setting` where there is a value.
fn set<T>(value: Option<T>, setting: &mut T) {
    if let Some(value) = value {
        *setting = value;
    }
}
