//! Files that must not be written over: those that were or will be read, and those that are written already.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use super::error::ExportError;
use super::temporary::{destination, folder_of, is_case_insensitive};
use crate::text::shown_path;

/// A set of files that no output may replace, however it names them: through links, another spelling of the path, or in other
/// case where the folder makes no difference.
#[derive(Debug, Clone, Default)]
pub struct Protected {
    files: Vec<File>,
}

#[derive(Debug, Clone)]
struct File {
    path: PathBuf,
    /// The file, where it exists.
    identity: Option<Identity>,
    /// Where a file yet to be written will be.
    place: Option<Place>,
}

/// Identity of an existing file, the same for all paths to it.
#[cfg(unix)]
type Identity = (u64, u64);
#[cfg(not(unix))]
type Identity = PathBuf;

/// A folder, and the name in it, in lower case where case makes no difference.
type Place = (Identity, OsString);

#[cfg(unix)]
fn identity(path: &Path) -> Option<Identity> {
    use std::os::unix::fs::MetadataExt as _;
    std::fs::metadata(path).ok().map(|metadata| (metadata.dev(), metadata.ino()))
}

#[cfg(not(unix))]
fn identity(path: &Path) -> Option<Identity> {
    path.canonicalize().ok()
}

fn place(path: &Path) -> Option<Place> {
    let path = destination(path).ok()?;
    let folder = folder_of(&path);
    let name = path.file_name()?;
    let name = if is_case_insensitive(folder) { name.to_string_lossy().to_lowercase().into() } else { name.to_owned() };
    Some((identity(folder)?, name))
}

/// Both paths lead to the same existing file.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    identity(a).is_some_and(|found| identity(b) == Some(found))
}

impl Protected {
    /// Protects files that are read.
    pub fn add_read<P: AsRef<Path>>(&mut self, paths: impl IntoIterator<Item = P>) {
        for path in paths {
            let path = path.as_ref();
            // A file that does not exist is not read either.
            if let Some(identity) = identity(path) {
                self.files.push(File { path: path.to_owned(), identity: Some(identity), place: None });
            }
        }
    }

    /// Protects the file that standard input is read from, and those that the other standard streams are written into.
    pub fn add_standard_streams(&mut self) {
        #[cfg(unix)]
        for (name, stream) in [
            ("standard input", rustix::stdio::stdin()),
            ("standard output", rustix::stdio::stdout()),
            ("standard error", rustix::stdio::stderr()),
        ] {
            if let Ok(file) = rustix::fs::fstat(stream)
                && rustix::fs::FileType::from_raw_mode(file.st_mode).is_file()
            {
                // The types of the fields differ between systems.
                #[allow(clippy::unnecessary_cast, clippy::useless_conversion, reason = "not on every system")]
                let identity = (file.st_dev as u64, file.st_ino as u64);
                self.files.push(File { path: name.into(), identity: Some(identity), place: None });
            }
        }
    }

    /// Protects a file that will be written.
    pub fn add_output(&mut self, path: &Path) {
        self.files.push(File { path: path.to_owned(), identity: None, place: place(path) });
    }

    /// Fails if `target` is one of the files.
    pub fn check(&self, target: &Path) -> Result<(), ExportError> {
        let (identity, place) = (identity(target), place(target));
        let found = self.files.iter().find(|file| {
            file.identity.is_some() && file.identity == identity || file.place.is_some() && file.place == place
        });
        let Some(file) = found else { return Ok(()) };
        let what = match (file.place.is_some(), file.path == target) {
            (true, _) => format!("is the same file as {}, which is written too", shown_path(&file.path)),
            (false, true) => "is read for this, and will not be written over".to_owned(),
            (false, false) => {
                format!(
                    "is the same file as {}, which is used for this, and will not be written over",
                    shown_path(&file.path)
                )
            }
        };
        Err(ExportError::new(target, format!("{what}; name another file to write")))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failure here is a failed test")]

    use super::*;

    #[test]
    fn a_file_is_recognised_by_any_of_its_names() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("sub")).unwrap();
        std::fs::write(at("a.png"), "read").unwrap();
        std::fs::write(at("b.png"), "other").unwrap();
        std::fs::hard_link(at("a.png"), at("hard.png")).unwrap();
        let mut names = vec![at("a.png"), at("sub/../a.png"), at("./a.png"), at("hard.png")];
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(at("a.png"), at("soft.png")).unwrap();
            std::os::unix::fs::symlink(folder.path(), at("loop")).unwrap();
            names.extend([at("soft.png"), at("loop/loop/hard.png")]);
        }
        let mut protected = Protected::default();
        protected.add_read([at("a.png"), at("missing.png")]);
        for name in names {
            let error = protected.check(&name).unwrap_err();
            assert!(error.reason.contains("will not be written over"), "{error}");
        }
        for name in ["b.png", "missing.png", "sub/a.png", "A.PNG"] {
            assert!(protected.check(&at(name)).is_ok() || is_case_insensitive(folder.path()), "{name}");
        }
        assert!(is_same_file(&at("a.png"), &at("hard.png")) && !is_same_file(&at("a.png"), &at("b.png")));
        assert!(!is_same_file(&at("missing.png"), &at("missing.png")));
    }

    #[test]
    fn two_outputs_are_one_file_by_their_place() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("sub")).unwrap();
        let mut protected = Protected::default();
        protected.add_output(&at("a.svg"));
        for name in ["a.svg", "sub/../a.svg"] {
            let error = protected.check(&at(name)).unwrap_err();
            assert!(error.reason.contains("which is written too"), "{error}");
        }
        assert!(protected.check(&at("b.svg")).is_ok() && protected.check(&at("sub/a.svg")).is_ok());
        assert_eq!(protected.check(&at("A.svg")).is_err(), is_case_insensitive(folder.path()));
    }
}
