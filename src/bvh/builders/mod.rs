//! Every way to build a tree, behind one function.

use std::time::Duration;

use super::{AnyTree, BuildSettings};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;

/// How long each stage of a build took, in the order of work.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StageTimes {
    /// Name and duration: "codes", "sort", "tree", "flatten" for AAC.
    pub stages: Vec<(&'static str, Duration)>,
}

impl StageTimes {
    /// Sum of all stages.
    pub fn total(&self) -> Duration {
        self.stages.iter().map(|(_, duration)| *duration).sum()
    }
}

/// Why there is no tree.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BuildError {
    /// Nobody wanted it any more.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// These settings cannot build these primitives; the text says why and what to do.
    #[error("{0}")]
    Refused(String),
}

/// Builds a tree over `triangles` (all coordinates finite) in the calling thread's rayon pool. Reports progress through
/// `token`. No triangles give a tree without nodes.
pub fn build(
    _triangles: &[Triangle],
    _settings: &BuildSettings,
    _token: &CancelToken,
) -> Result<(AnyTree, StageTimes), BuildError> {
    todo!("bvh")
}
