//! Options of loading.

/// Permissions of a loader, and the part of a file that it reads.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Allows files outside the model's folder to be read.
    pub allow_outside: bool,
    /// The scene of a glTF file, counted from 0; `None` for the file's default. Other files have one scene.
    pub scene: Option<usize>,
}
