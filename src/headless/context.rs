//! The context of a command (cancellation, output) and its outcome.

use std::io::Write;
use std::sync::Arc;

use super::progress::Progress;
use crate::camera::Camera;
use crate::console::note;
use crate::export::ExportError;
use crate::lab::LabError;
use crate::scene::{LoadError, LoadOptions, Scene, SceneSource, load};
use crate::text::{counted, printable};
use crate::view::CameraChoice;
use bvhscope_engine::builders::BuildError;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// The failure of a command.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// Something cannot be used or done; the text states what and why. Exit code 1.
    #[error("{0}")]
    Failed(String),
    /// Invalid combination of settings. Exit code 2.
    #[error("{0}")]
    Usage(String),
    /// Stopped by the user. Exit code 130.
    #[error("interrupted")]
    Interrupted,
}

/// Refuses a scene of copies in two levels to what needs the triangles of all of them.
pub(super) fn needs_triangles(scene: &Scene, what: &str) -> Result<(), Failure> {
    if scene.copies.is_none() {
        return Ok(());
    }
    Err(Failure::Failed(format!(
        "{}: '{what}' needs the triangles of every copy, which a scene in two levels does not have; load it with --instances flat",
        scene.source
    )))
}

impl From<Cancelled> for Failure {
    fn from(_: Cancelled) -> Self {
        Self::Interrupted
    }
}

impl Failure {
    /// A failed build of the tree of `source`.
    pub(super) fn of_build(error: BuildError, source: &SceneSource) -> Self {
        match error {
            BuildError::Cancelled(_) => Self::Interrupted,
            BuildError::Refused(text) => Self::Failed(format!("{}: {text}", printable(&source.to_string()))),
        }
    }
}

impl From<LabError> for Failure {
    fn from(error: LabError) -> Self {
        match error {
            LabError::Cancelled(_) => Self::Interrupted,
            LabError::Refused(text) => Self::Failed(text),
        }
    }
}

impl From<LoadError> for Failure {
    fn from(error: LoadError) -> Self {
        match error {
            LoadError::Cancelled(_) => Self::Interrupted,
            error @ LoadError::Unusable { .. } => Self::Failed(error.to_string()),
        }
    }
}

impl From<ExportError> for Failure {
    fn from(error: ExportError) -> Self {
        Self::Failed(error.to_string())
    }
}

impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Self {
        Self::Failed(format!("the results cannot be printed: {error}"))
    }
}

/// The camera of a choice for `scene`; refuses a camera of the file that does not exist.
pub(super) fn camera_of(choice: &CameraChoice, scene: &Scene) -> Result<Camera, Failure> {
    match choice.of_file {
        Some(index) if index >= scene.cameras.len() => {
            let there_are = counted(scene.cameras.len() as u64, "cameras");
            Err(Failure::Failed(format!(
                "--camera {index}: the file has {there_are}, counted from 0; choose another view"
            )))
        }
        _ => Ok(choice.camera(scene)),
    }
}

/// Takes it for success that whoever reads the results has closed them: as `head` does, which has all that it wants.
pub fn ignore_missing_reader(printed: std::io::Result<()>) -> std::io::Result<()> {
    printed.or_else(|error| if error.kind() == std::io::ErrorKind::BrokenPipe { Ok(()) } else { Err(error) })
}

/// The success of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Finished {
    /// Whether a file was loaded with warnings: exit code 3 under `--strict`.
    pub warned: bool,
}

/// The context of a command.
pub struct Context<'a> {
    /// Cancelled by Ctrl-C.
    pub token: CancelToken,
    /// Output for results.
    pub out: &'a mut (dyn Write + Send),
    /// Permissions for loading.
    pub load: LoadOptions,
}

impl Context<'_> {
    /// Loads `source` with a progress bar, and prints its warnings to stderr.
    pub fn load(&self, source: &SceneSource) -> Result<Arc<Scene>, Failure> {
        let progress = Progress::new(&format!("Loading {}", source.label()), &self.token);
        let (options, token) = (&self.load, &self.token);
        let scene = in_pool(|| load(source, options, token))?;
        drop(progress);
        for warning in &scene.warnings.entries {
            note(format_args!("bvhscope: {}: {warning}", printable(&source.to_string())));
        }
        Ok(Arc::new(scene))
    }
}

/// Runs `work` on a thread of rayon's global pool, so that what it forks stays there.
pub(super) fn in_pool<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    rayon::scope(|_| work())
}
