//! What the window starts with when the command line asks for something.

use std::path::PathBuf;

use super::start::SettingsUse;
use crate::bvh::BuildSettings;
use crate::overlay::OverlaySettings;
use crate::render::RenderSettings;
use crate::scene::{LoadOptions, SceneSource};
use crate::view::CameraChoice;

/// What was asked for; what was not is `None` and stays as the last run left it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StartOptions {
    /// The model; `None` for the built-in teapot.
    pub source: Option<SceneSource>,
    /// How its tree is built.
    pub build: Option<BuildSettings>,
    /// Threads for building and tracing; `None` for all.
    pub threads: Option<usize>,
    /// From where the model is seen once it is loaded: `choice.camera(&scene.bounds, scene.up)`.
    pub camera: Option<CameraChoice>,
    /// What the picture shows.
    pub render: Option<RenderSettings>,
    /// The containers over it.
    pub overlay: Option<OverlaySettings>,
    /// What loading may do.
    pub load: LoadOptions,
    /// The file of the settings, for what is said about it.
    pub settings_file: Option<PathBuf>,
    /// Which settings are read and written.
    pub settings: SettingsUse,
    /// Go on with the model of the last run: after the graphics driver was lost.
    pub restore: bool,
    /// Lose the graphics driver after the first picture: for tests.
    pub lose_device: bool,
    /// What the user is told at once.
    pub notices: Vec<String>,
}
