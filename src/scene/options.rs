//! Options of loading.

/// Permissions of a loader, and the part of a file that it reads.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LoadOptions {
    /// Allows files outside the model's folder to be read.
    pub allow_outside: bool,
    /// The scene of a glTF file, counted from 0; `None` for the file's default. Other files have one scene.
    pub scene: Option<usize>,
    /// Frames a second of a row of files, above 0; `None` for [`FRAMES_PER_SECOND`](super::FRAMES_PER_SECOND).
    pub fps: Option<f32>,
}

impl LoadOptions {
    /// Keys of the flags by which a command line loads the same, each with its value if it takes one. Defaults are left out.
    pub fn written(&self) -> impl Iterator<Item = (&'static str, Option<String>)> + use<> {
        let scene = self.scene.map(|scene| ("scene", Some(scene.to_string())));
        let fps = self.fps.map(|fps| ("fps", Some(fps.to_string())));
        let outside = self.allow_outside.then_some(("allow-outside", None));
        [scene, fps, outside].into_iter().flatten()
    }
}
