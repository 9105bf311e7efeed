//! Where the tree of a command comes from: built, or held by a file.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::context::Failure;
use crate::accel::followed::FollowSession;
use crate::accel::{Accel, Follow};
use crate::console::note;
use crate::scene::{Scene, SceneSource};
use crate::text::shown_path;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::BuildSettings;

/// Where the tree of a command comes from.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum TreeOrigin {
    /// Built with the settings of the command.
    Built,
    /// Held by the file of the model, if that is a tree file; built otherwise.
    #[default]
    OfModel,
    /// Held by this file.
    File(PathBuf),
}

impl TreeOrigin {
    /// The file that is read beside the model.
    pub fn path(&self) -> Option<&Path> {
        if let Self::File(path) = self { Some(path) } else { None }
    }

    /// The tree of `scene`, which `source` named: built with `settings`, as it follows the model in the `session`, or read. Its wide tree
    /// is made on request.
    pub(super) fn accel(
        &self,
        scene: &Arc<Scene>,
        source: &SceneSource,
        settings: &BuildSettings,
        (follow, session): (Follow, &mut FollowSession),
        token: &CancelToken,
    ) -> Result<Accel, Failure> {
        let path = match self {
            _ if follow != Follow::default() => None,
            Self::File(path) => Some(path.as_path()),
            Self::OfModel if scene.has_tree => source.path(),
            _ => None,
        };
        match path {
            Some(path) => Ok(Accel::read(scene, path, settings.optimize, token)?),
            None => {
                Accel::follow(scene, settings, follow, session, token).map_err(|error| Failure::of_build(error, source))
            }
        }
    }
}

/// Prints the faults of a tree that was read to stderr, as the warnings of a model; whether there are any.
pub(super) fn note_faults(accel: &Accel) -> bool {
    if let Some(file) = &accel.file {
        for fault in &file.faults {
            note(format_args!("bvhscope: {}: {fault}", shown_path(&file.path)));
        }
    }
    !accel.faults().is_empty()
}
