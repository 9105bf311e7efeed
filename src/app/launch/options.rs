//! What the window starts with when the command line asks for something.

use std::path::PathBuf;

use crate::app::launch::settings::SettingsUse;
use crate::app::state::{Preferences, Wanted};
use crate::overlay::ColorBy;
use crate::render::{ColorMap, Light, Shading};
use crate::scene::{LoadOptions, SceneSource};
use crate::view::CameraChoice;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve, Passes, Preset};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::traverse::Traversal;

/// What was asked for; what was not is `None` and stays as the last run left it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StartOptions {
    /// The model; `None` for the built-in teapot.
    pub source: Option<SceneSource>,
    /// Settings of tree, picture and containers.
    pub asked: CliOverrides,
    /// From where the model is seen once it is loaded: `choice.camera(&scene.bounds, scene.up)`.
    pub camera: Option<CameraChoice>,
    /// What loading may do.
    pub load: LoadOptions,
    /// The file of the settings; without it none are kept.
    pub settings_file: Option<PathBuf>,
    /// Which settings are read and written.
    pub settings: SettingsUse,
    /// Go on with the model of the last run: after the graphics driver was lost.
    pub restore: bool,
    /// Lose the graphics driver after the first picture: for tests.
    pub lose_device: bool,
    /// For tests: the driver refuses a buffer once something is shown.
    pub refuse_buffer: bool,
    /// What the user is told at once.
    pub notices: Vec<String>,
}

/// The settings that were asked for one by one.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CliOverrides {
    /// Builder, threshold, ε and passes by one name; those that are named themselves win.
    pub preset: Option<Preset>,
    /// The algorithm.
    pub builder: Option<BuilderKind>,
    /// Boxes or spheres.
    pub container: Option<ContainerKind>,
    /// AAC's threshold.
    pub threshold: Option<u32>,
    /// AAC's ε.
    pub epsilon: Option<f32>,
    /// Along which line triangles are sorted.
    pub curve: Option<Curve>,
    /// Passes over the finished tree.
    pub optimize: Option<Passes>,
    /// Threads for building and tracing.
    pub threads: Option<usize>,
    /// What a pixel's colour means.
    pub shading: Option<Shading>,
    /// Light of the lit mode.
    pub light: Option<Light>,
    /// Tree level of the cluster colours.
    pub cluster_depth: Option<u32>,
    /// How rays visit nodes where tests are counted.
    pub traversal: Option<Traversal>,
    /// Counts at both ends of the heat map.
    pub heat_range: Option<[f32; 2]>,
    /// Colours of depth and heat maps.
    pub color_map: Option<ColorMap>,
    /// Edges of the triangles.
    pub mesh_edges: Option<bool>,
    /// Vector instructions.
    pub simd: Option<SimdLevel>,
    /// Antialiasing samples a pixel.
    pub samples: Option<u32>,
    /// Whether boxes and whether spheres lie over the picture.
    pub containers_shown: Option<[bool; 2]>,
    /// First and last tree level that is drawn.
    pub depth: Option<[u32; 2]>,
    /// Of these only leaves.
    pub leaves_only: Option<bool>,
    /// All levels above as well.
    pub parents: Option<bool>,
    /// What the colour of a container means.
    pub color_by: Option<ColorBy>,
    /// Opacity of lines behind the surface.
    pub hidden_alpha: Option<f32>,
    /// Width of lines in points.
    pub line_width: Option<f32>,
    /// At most this many containers of each kind.
    pub budget: Option<u32>,
}

impl CliOverrides {
    /// Lays what was asked for over the settings of the last run. What it needs to be seen is switched on.
    pub fn apply(&self, wanted: &mut Wanted, preferences: &mut Preferences) {
        self.lay_over_build(&mut wanted.build);
        lay(self.threads, &mut wanted.threads);
        let render = &mut wanted.render;
        lay(self.shading, &mut render.shading);
        lay(self.light, &mut render.light);
        lay(self.cluster_depth, &mut render.cluster_depth);
        lay(self.traversal, &mut render.traversal);
        lay(self.heat_range.map(Some), &mut render.heat_range);
        lay(self.color_map, &mut render.color_map);
        lay(self.mesh_edges, &mut render.mesh_edges);
        lay(self.simd, &mut render.simd);
        lay(self.samples, &mut render.samples);
        preferences.show_geometry |= self.shading.is_some() || self.mesh_edges.is_some();
        let overlay = &mut wanted.overlay;
        if let Some([boxes, spheres]) = self.containers_shown {
            (overlay.show_boxes, overlay.show_spheres) = (boxes, spheres);
            preferences.show_containers = true;
        }
        lay(self.depth, &mut overlay.depth);
        lay(self.leaves_only, &mut overlay.leaves_only);
        lay(self.parents, &mut overlay.parents);
        lay(self.color_by, &mut overlay.color_by);
        lay(self.hidden_alpha, &mut overlay.hidden_alpha);
        lay(self.line_width, &mut overlay.line_width);
        lay(self.budget, &mut overlay.budget);
    }

    fn lay_over_build(&self, build: &mut BuildSettings) {
        lay(self.container, &mut build.container);
        if let Some(preset) = self.preset {
            *build = BuildSettings::preset(preset, build.container);
        } else if self.threshold.is_some() || self.epsilon.is_some() {
            // They are AAC's.
            build.builder = BuilderKind::Aac;
        }
        lay(self.builder, &mut build.builder);
        lay(self.threshold, &mut build.threshold);
        lay(self.epsilon, &mut build.epsilon);
        lay(self.curve, &mut build.curve);
        lay(self.optimize, &mut build.optimize);
        // What was left by the last run gives way to what was asked for now.
        if build.refusal(0).is_some() {
            match (self.builder, self.container) {
                (Some(_), None) => build.container = ContainerKind::Aabb,
                (None, Some(_)) => build.builder = BuilderKind::Aac,
                _ => {}
            }
        }
    }
}

fn lay<T>(asked: Option<T>, over: &mut T) {
    if let Some(value) = asked {
        *over = value;
    }
}
