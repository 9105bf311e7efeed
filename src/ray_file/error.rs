//! Why a file holds no rays that can be read.

use bvhscope_engine::cancel::Cancelled;

use crate::budget::OverBudget;

/// A ray file that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RayFileError {
    /// Reading was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The file is wrong.
    #[error("{problem}; {advice}")]
    Unusable {
        /// Place and fault.
        problem: String,
        /// Remedy.
        advice: &'static str,
    },
    /// The rays are too many to be held.
    #[error(transparent)]
    Memory(#[from] OverBudget),
}

impl RayFileError {
    pub(super) fn new(problem: impl Into<String>, advice: &'static str) -> Self {
        Self::Unusable { problem: problem.into(), advice }
    }

    /// A failed read.
    pub(super) fn of_read(error: &std::io::Error) -> Self {
        Self::new(format!("cannot be read: {error}"), "check the path, its permissions and the disk")
    }
}
