//! Options of loading.

use serde::{Deserialize, Serialize};

/// Permissions of a loader, and the part of a file that it reads.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LoadOptions {
    /// Allows files outside the model's folder to be read.
    pub allow_outside: bool,
    /// The scene of a glTF file, counted from 0; `None` for the file's default. Other files have one scene.
    pub scene: Option<usize>,
    /// Frames a second of a row of files, above 0; `None` for [`FRAMES_PER_SECOND`](super::FRAMES_PER_SECOND).
    pub fps: Option<f32>,
    /// Form of a scene that is made of copies of meshes.
    pub instances: Instancing,
}

/// Form of a scene that is made of copies of meshes: flat, with triangles for each copy, or in two levels, with each mesh once and a tree over
/// the copies.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Instancing {
    /// Flat where that fits into the memory budget.
    #[default]
    Auto,
    /// Flat.
    Flat,
    /// Two levels.
    TwoLevel,
}

impl Instancing {
    /// Every one.
    pub const ALL: [Self; 3] = [Self::Auto, Self::Flat, Self::TwoLevel];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Flat => "flat",
            Self::TwoLevel => "two-level",
        }
    }
}

impl LoadOptions {
    /// Keys of the flags by which a command line loads the same, each with its value if it takes one. Defaults are left out.
    pub fn written(&self) -> impl Iterator<Item = (&'static str, Option<String>)> + use<> {
        let scene = self.scene.map(|scene| ("scene", Some(scene.to_string())));
        let fps = self.fps.map(|fps| ("fps", Some(fps.to_string())));
        let is_stated = self.instances != Instancing::default();
        let instances = is_stated.then(|| ("instances", Some(self.instances.name().to_owned())));
        let outside = self.allow_outside.then_some(("allow-outside", None));
        [scene, fps, instances, outside].into_iter().flatten()
    }
}
