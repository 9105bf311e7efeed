//! Why a file cannot be written.

use std::path::{Path, PathBuf};

use crate::text::shown_path;

/// A file that cannot be written, and why.
#[derive(Debug, thiserror::Error)]
#[error("{}: {reason}", shown_path(path))]
pub struct ExportError {
    /// The file.
    pub path: PathBuf,
    /// The reason, for the user.
    pub reason: String,
}

impl ExportError {
    /// An error about `path`.
    pub fn new(path: &Path, reason: impl Into<String>) -> Self {
        Self { path: path.to_owned(), reason: reason.into() }
    }
}
