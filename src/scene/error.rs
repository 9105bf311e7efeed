//! What can be wrong with a file, and what was merely skipped.

use std::path::PathBuf;

use serde::Serialize;

/// Where in a file something is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line, counted from 1.
    Line(u64),
    /// A line and a byte in it, both counted from 1.
    Column(u64, u64),
    /// A byte offset.
    Byte(u64),
    /// A path into a JSON document, as in `accessors[3].count`.
    Json(String),
}

/// Why a file cannot be used: which file, where in it, what was found and expected, what to do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LoadError {
    /// Nobody wanted it any more.
    #[error(transparent)]
    Cancelled(#[from] crate::cancel::Cancelled),
    /// The file is unusable.
    #[error("{}: {message}", locate(path, place))]
    Unusable {
        /// The file.
        path: PathBuf,
        /// Where in it.
        place: Place,
        /// What was found, what was expected and what to do, in one sentence.
        message: String,
    },
}

/// `file:line`, `file:line:column`, `file at byte N`, `file: json.path`, as terminals and editors understand it.
fn locate(path: &std::path::Path, place: &Place) -> String {
    let file = path.display();
    match place {
        Place::File => format!("{file}"),
        Place::Line(line) => format!("{file}:{line}"),
        Place::Column(line, column) => format!("{file}:{line}:{column}"),
        Place::Byte(byte) => format!("{file}: at byte {byte}"),
        Place::Json(json) => format!("{file}: {json}"),
    }
}

/// One kind of thing that was skipped or repaired.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Warning {
    /// What, in words, without the count: "triangles with NaN coordinates skipped".
    pub what: String,
    /// How often.
    pub count: u64,
    /// Where first.
    pub first: Place,
}

/// Everything that was skipped or repaired while loading one file.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Warnings {
    /// One entry a kind, in order of first occurrence.
    pub entries: Vec<Warning>,
}

impl Warnings {
    /// Counts one more of `what`; keeps the first place.
    pub fn add(&mut self, what: &str, place: impl FnOnce() -> Place) {
        if let Some(entry) = self.entries.iter_mut().find(|entry| entry.what == what) {
            entry.count += 1;
        } else {
            self.entries.push(Warning { what: what.to_owned(), count: 1, first: place() });
        }
    }

    /// Whether nothing was skipped.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.count, self.what)?;
        match &self.first {
            Place::File => Ok(()),
            Place::Line(line) => write!(f, " (first at line {line})"),
            Place::Column(line, column) => write!(f, " (first at line {line}, column {column})"),
            Place::Byte(byte) => write!(f, " (first at byte {byte})"),
            Place::Json(json) => write!(f, " (first at {json})"),
        }
    }
}
