//! The settings that decide what is shown.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::camera::Camera;
use crate::overlay::OverlaySettings;
use crate::render::RenderSettings;
use crate::scene::SceneSource;
use bvhscope_engine::geometry::Aabb;
use bvhscope_engine::settings::BuildSettings;

/// What the user wants to see. Panels edit it; the workers follow.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Wanted {
    /// The model.
    pub source: SceneSource,
    /// How its tree is built.
    pub build: BuildSettings,
    /// Number of threads for building and tracing; 0 for all.
    pub threads: usize,
    /// The camera.
    pub camera: Camera,
    /// How the picture is shaded and sampled.
    pub render: RenderSettings,
    /// Which bounding volumes are drawn over the picture, and how.
    pub overlay: OverlaySettings,
}

impl Wanted {
    /// Default settings for `source`. The camera frames the cube from −1 to 1 until the model is loaded.
    pub fn new(source: SceneSource) -> Self {
        Self {
            source,
            build: BuildSettings::default(),
            threads: 0,
            camera: Camera::framing(&Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE }, Vec3::Y),
            render: RenderSettings::default(),
            overlay: OverlaySettings::default(),
        }
    }
}
