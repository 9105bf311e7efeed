//! Options of the command line, applied before the window opens.

use std::path::PathBuf;

use crate::app::shell::settings::SettingsUse;
use crate::app::state::{Preferences, SharedState, Wanted};
use crate::catalog::settings::Given;
use crate::overlay::OverlaySettings;
use crate::overlay::rows::CONTAINERS;
use crate::render::RenderSettings;
use crate::render::rows::{MESH_EDGES, SHADING};
use crate::scene::{LoadOptions, SceneSource};
use crate::view::CameraChoice;

/// Options of the window. What is `None` stays as the last run left it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StartOptions {
    /// The model; `None` for the default built-in scene.
    pub source: Option<SceneSource>,
    /// The file that holds the tree; `None` builds it.
    pub tree_file: Option<PathBuf>,
    /// The file of rays by which trees can be measured.
    pub ray_file: Option<PathBuf>,
    /// A state to show: its model and settings, in place of those of the last run.
    pub shared: Option<SharedState>,
    /// Settings of tree, picture and containers.
    pub overrides: Overrides,
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

/// Settings given on the command line.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Overrides {
    /// Settings of the tree.
    pub build: Given,
    /// Number of threads for building and tracing; 0 for all, `None` where it was not given.
    pub threads: Option<usize>,
    /// Settings of the picture.
    pub render: Given<RenderSettings>,
    /// Settings of the containers over it.
    pub overlay: Given<OverlaySettings>,
}

impl Overrides {
    /// Overrides the settings of the last run. Geometry or containers are shown where a setting concerns them.
    pub fn apply(&self, wanted: &mut Wanted, preferences: &mut Preferences) {
        self.build.apply(&mut wanted.build);
        self.render.apply(&mut wanted.render);
        self.overlay.apply(&mut wanted.overlay);
        wanted.threads = self.threads.unwrap_or(wanted.threads);
        preferences.show_geometry |= [&SHADING, &MESH_EDGES].into_iter().any(|row| self.render.get(row).is_some());
        preferences.show_containers |= self.overlay.get(&CONTAINERS).is_some();
    }
}
