//! From a source to a scene.

use std::path::Path;

use super::{LoadError, Scene, SceneSource, builtin};
use crate::cancel::CancelToken;

/// What the user allows a load to do.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Files outside the model's folder may be read as well.
    pub allow_outside: bool,
}

/// Loads a scene. Progress by bytes through `token`, which also cancels it.
pub fn load(source: &SceneSource, options: &LoadOptions, token: &CancelToken) -> Result<Scene, LoadError> {
    token.check()?;
    token.set_progress(0.0);
    match source {
        SceneSource::Builtin { name, size } => builtin::build(name, *size, source, token),
        SceneSource::File(path) => load_file(path, source, options, token),
    }
}

fn load_file(
    path: &Path,
    source: &SceneSource,
    _options: &LoadOptions,
    token: &CancelToken,
) -> Result<Scene, LoadError> {
    let _bytes = super::read::read_model(path, token)?;
    let _ = source;
    Err(LoadError::Unusable { path: path.to_path_buf(), place: super::Place::File, message: "not yet".to_owned() })
}
