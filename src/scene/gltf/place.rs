//! Places in the JSON of a file.

use crate::scene::error::FileLocation;

/// A place in the JSON, with what is wrong there.
pub(super) fn place(path: impl Into<String>, detail: &str) -> FileLocation {
    let path = path.into();
    FileLocation::Json(if detail.is_empty() { path } else { format!("{path}: {detail}") })
}
