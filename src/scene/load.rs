//! From a source to a scene.

use super::{LoadError, Scene, SceneSource};
use crate::cancel::CancelToken;

/// What the user allows a load to do.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Files outside the model's folder may be read as well.
    pub allow_outside: bool,
}

/// Loads a scene. Progress by bytes through `token`, which also cancels it.
pub fn load(_source: &SceneSource, _options: &LoadOptions, _token: &CancelToken) -> Result<Scene, LoadError> {
    todo!("scene")
}
