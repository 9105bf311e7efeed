//! Loading errors with their location in the file, and warnings about what was skipped or repaired.

use std::borrow::Cow;
use std::fmt::Display;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::budget::{Budget, OverBudget};
use crate::text::{counted, printable, quoted, shown_path, without_middle};
use bvhscope_engine::BuildError;
use bvhscope_engine::tree_file::TreeFileError;

/// A location in a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub enum FileLocation {
    /// The file as a whole.
    File,
    /// A line, counted from 1.
    Line(u64),
    /// A line and a byte in it, both counted from 1.
    Column(u64, u64),
    /// A line, counted from 1, of another file that the model names.
    LineIn(String, u64),
    /// A byte offset.
    Byte(u64),
    /// A path into a JSON document, as in `accessors[3].count`.
    Json(String),
}

impl FileLocation {
    /// A place in a JSON document, with the fault there if it is not empty.
    pub(super) fn in_json(path: impl Into<String>, detail: impl Display) -> Self {
        let (path, detail) = (path.into(), detail.to_string());
        Self::Json(if detail.is_empty() { path } else { format!("{path}: {detail}") })
    }
}

/// The reason why loading ended without a scene.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LoadError {
    /// Loading was cancelled.
    #[error(transparent)]
    Cancelled(#[from] bvhscope_engine::cancel::Cancelled),
    /// The file cannot be used.
    #[error("{}: {}; {}", locate(path, location), printable(&shortened(problem)), printable(&shortened(advice)))]
    Unusable {
        /// The file.
        path: PathBuf,
        /// The location in the file.
        location: FileLocation,
        /// The text found there and the expected form.
        problem: String,
        /// Remedy for the user.
        advice: String,
    },
}

/// Why there is no tree where there is no scene, or no file.
impl From<LoadError> for BuildError {
    fn from(error: LoadError) -> Self {
        match error {
            LoadError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            LoadError::Unusable { .. } => Self::Refused(error.to_string()),
        }
    }
}

impl LoadError {
    /// An error about a place in a file. Messages read `place: problem; advice`.
    pub(super) fn at(
        path: &Path,
        location: FileLocation,
        problem: impl Into<String>,
        advice: impl Into<String>,
    ) -> Self {
        Self::Unusable { path: path.to_path_buf(), location, problem: problem.into(), advice: advice.into() }
    }

    /// An error about a file as a whole.
    pub(crate) fn of_file(path: &Path, problem: impl Into<String>, advice: impl Into<String>) -> Self {
        Self::at(path, FileLocation::File, problem, advice)
    }

    /// An error about a tree file.
    pub(crate) fn of_tree_file(path: &Path, error: &TreeFileError) -> Self {
        match *error {
            TreeFileError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            TreeFileError::Memory { needed, allowed } => {
                Self::over_budget(path, &Budget::of_process().exceeded("the tree", needed, allowed))
            }
            ref error => Self::of_file(path, error.to_string(), error.advice()),
        }
    }

    /// An error about a file that needs more memory than is left.
    pub(crate) fn over_budget(path: &Path, error: &OverBudget) -> Self {
        Self::of_file(path, error.shortage(), OverBudget::ADVICE)
    }
}

/// `file:line`, `file:line:column`, `file at byte N`, `file: json.path`, as terminals and editors understand it.
fn locate(path: &Path, location: &FileLocation) -> String {
    let file = shown_path(path);
    match location {
        FileLocation::File => file,
        FileLocation::Line(line) => format!("{file}:{line}"),
        FileLocation::Column(line, column) => format!("{file}:{line}:{column}"),
        FileLocation::LineIn(name, line) => format!("{file}: {}:{line}", shown_path(Path::new(name))),
        FileLocation::Byte(byte) => format!("{file}: at byte {byte}"),
        FileLocation::Json(json) => format!("{file}: {json}"),
    }
}

/// Bytes that [`shortened`] keeps of the beginning and of the end of a text.
const KEPT_BYTES: [usize; 2] = [400, 200];

/// `text` without its middle part if it is long: messages may quote megabytes of a file.
fn shortened(text: &str) -> Cow<'_, str> {
    without_middle(text, KEPT_BYTES)
}

/// One kind of problem, which was skipped or repaired.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Warning {
    /// Description without the count: "triangles with NaN coordinates skipped". Begins with a noun in its plural, of which
    /// messages make the singular where the count is 1, see [`counted`].
    pub what: String,
    /// Number of occurrences.
    pub count: u64,
    /// Location of the first occurrence.
    pub first: FileLocation,
}

/// Maximum number of kinds of warnings; keeps the list readable and the linear search for a kind short.
const MAX_KINDS: usize = 200;

/// All warnings of loading one file.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Warnings {
    /// One entry per kind, in order of first occurrence.
    pub entries: Vec<Warning>,
}

impl Warnings {
    /// Counts an occurrence of `what`; `location` is recorded if it is the first.
    pub fn add(&mut self, what: &str, location: impl FnOnce() -> FileLocation) {
        self.add_many(1, what, location);
    }

    /// Counts `count` occurrences of `what`, the first of them at `location`. Kinds beyond the maximum share one entry.
    pub fn add_many(&mut self, count: u64, what: &str, location: impl FnOnce() -> FileLocation) {
        if count == 0 {
            return;
        }
        let what = &*shortened(what);
        let is_full = self.entries.len() >= MAX_KINDS;
        let found = self.entries.iter().position(|entry| entry.what == what).or(is_full.then_some(MAX_KINDS));
        if let Some(entry) = found.and_then(|at| self.entries.get_mut(at)) {
            entry.count = entry.count.saturating_add(count);
        } else {
            let what = if is_full { "warnings of other kinds" } else { what };
            self.entries.push(Warning { what: what.to_owned(), count, first: location() });
        }
    }

    /// Counts an occurrence of a kind that names one of its objects: `[before, after]` stand before and after the name in quotes.
    /// Occurrences with other names share the entry of the first.
    pub(super) fn add_named(
        &mut self,
        [before, after]: [&str; 2],
        name: impl AsRef<[u8]>,
        location: impl FnOnce() -> FileLocation,
    ) {
        let what = format!("{before}{}{after}", quoted(name));
        let first = self.entries.iter_mut().find_map(|entry| {
            let name = entry.what.strip_prefix(before)?.strip_suffix(after)?.trim_end_matches(" …").to_owned();
            Some((entry, name))
        });
        let Some((entry, name)) = first else { return self.add(&what, location) };
        entry.count = entry.count.saturating_add(1);
        if entry.what != what {
            entry.what = format!("{before}{name} …{after}");
        }
    }

    /// Adds the counts of another list.
    pub fn append(&mut self, other: Self) {
        for Warning { what, count, first } in other.entries {
            self.add_many(count, &what, || first);
        }
    }

    /// Whether there are no warnings.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }
}

impl Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&printable(&counted(self.count, &self.what)))?;
        match &self.first {
            FileLocation::File => Ok(()),
            FileLocation::Line(line) => write!(f, " (first at line {line})"),
            FileLocation::Column(line, column) => write!(f, " (first at line {line}, column {column})"),
            FileLocation::LineIn(name, line) => write!(f, " (first at {}:{line})", shown_path(Path::new(name))),
            FileLocation::Byte(byte) => write!(f, " (first at byte {byte})"),
            FileLocation::Json(json) => write!(f, " (first at {json})"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_warning_kinds_is_bounded() {
        let mut warnings = Warnings::default();
        for k in 0..10 * MAX_KINDS as u64 {
            warnings.add_many(2, &format!("kind {k}"), || FileLocation::Line(k));
        }
        warnings.add_many(0, "nothing", || FileLocation::File);
        warnings.add("kind 3", || FileLocation::File);
        let mut others = Warnings::default();
        others.add("kind 5", || FileLocation::File);
        others.add("something new", || FileLocation::File);
        warnings.append(others);
        assert_eq!(warnings.entries.len(), MAX_KINDS + 1);
        assert_eq!(warnings.entries[3], Warning { what: "kind 3".to_owned(), count: 3, first: FileLocation::Line(3) });
        assert_eq!(warnings.entries[5].count, 3);
        let last = warnings.entries[MAX_KINDS].clone();
        assert_eq!(last.first, FileLocation::Line(MAX_KINDS as u64));
        assert_eq!(last.to_string(), "3601 warnings of other kinds (first at line 200)");
        let one = Warning { what: "vertices without a normal".to_owned(), count: 1, first: FileLocation::Byte(7) };
        assert_eq!(one.to_string(), "1 vertex without a normal (first at byte 7)");
    }

    #[test]
    fn names_share_an_entry_that_has_the_first() {
        let mut warnings = Warnings::default();
        let kinds =
            [["images left out: ", ": gone"], ["images left out: ", ": broken"], ["libraries ", " left out: gone"]];
        for (kind, name) in [(0, "a"), (1, "a"), (2, "a"), (0, "a"), (1, "b"), (1, "a"), (1, "c")] {
            warnings.add_named(kinds[kind], name, || FileLocation::File);
        }
        let found: Vec<String> = warnings.entries.iter().map(ToString::to_string).collect();
        let expected =
            ["2 images left out: 'a': gone", "4 images left out: 'a' …: broken", "1 library 'a' left out: gone"];
        assert_eq!(found, expected);
    }

    #[test]
    fn long_messages_are_shortened_in_the_middle() {
        let message = format!("found '{}', expected less", "é".repeat(1 << 20));
        let mut warnings = Warnings::default();
        warnings.add(&message, || FileLocation::File);
        warnings.add(&message, || FileLocation::File);
        assert_eq!(warnings.entries.len(), 1);
        let error = LoadError::at(Path::new("a.obj"), FileLocation::Line(7), message, "shorten it");
        for (text, end) in
            [(error.to_string(), "expected less; shorten it"), (warnings.entries[0].to_string(), "expected less")]
        {
            assert!(text.len() < 700 && text.contains("found 'é") && text.ends_with(end), "{text}");
        }
        let short = "as long as it may be ".repeat(20);
        assert_eq!(shortened(&short), short);
    }
}
