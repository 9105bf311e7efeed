//! Why no tree was built.

use crate::cancel::Cancelled;

/// Reason for which no tree was built.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BuildError {
    /// The build was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The settings do not allow these triangles; the text states why, and what to do.
    #[error("{0}")]
    Refused(String),
}
