//! Atomic file output: data goes into a temporary file beside the target, which is flushed and then renamed. Files that were
//! read are not written over, see [`Protected`].
//!
//! Knows no file format; callers encode.

mod error;
mod protected;
mod temporary;

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::text::shown_path;
use temporary::{Temporary, destination, folder_of};

pub use error::ExportError;
pub use protected::{Protected, is_same_file};
pub use temporary::remove_incomplete;

/// Checks that `path` can be written, before work is spent on its contents: its folder exists and is writable, and it is
/// neither a folder, a device nor one of the `protected` files. A symbolic link stands for the place that it leads to.
pub fn check_target(path: &Path, protected: &Protected) -> Result<(), ExportError> {
    checked_place(path, protected).map(drop)
}

/// The place where `path` is written, checked as in [`check_target`].
fn checked_place(path: &Path, protected: &Protected) -> Result<PathBuf, ExportError> {
    if path.file_name().is_none() {
        return Err(ExportError::new(path, "this is not a file name"));
    }
    let place = destination(path).map_err(|error| match error.kind() {
        std::io::ErrorKind::InvalidFilename => ExportError::new(path, "the name is longer than 255 bytes"),
        _ => ExportError::new(path, cannot_be_written(&error)),
    })?;
    if path.is_dir() {
        return Err(ExportError::new(
            path,
            format!("is a folder; name a file in it: {}", shown_path(&path.join("out"))),
        ));
    }
    if path.exists() && !path.is_file() {
        return Err(ExportError::new(path, "is not a regular file; it will not be replaced"));
    }
    let folder = folder_of(&place);
    if !folder.is_dir() {
        return Err(ExportError::new(
            path,
            format!("the folder '{}' does not exist; create it first", shown_path(folder)),
        ));
    }
    protected.check(path)?;
    Temporary::new(folder).map_err(|error| {
        ExportError::new(path, format!("the folder '{}' takes no files: {error}", shown_path(folder)))
    })?;
    Ok(place)
}

/// The message about a file that does not end as it must, which `text` says. A name such as `.png` is an ending with nothing before it.
///
/// ```
/// use bvhscope::export::wrong_ending;
///
/// assert_eq!(wrong_ending("a.txt".as_ref(), "it must end in .png"), "a.txt: it must end in .png");
/// assert_eq!(wrong_ending(".png".as_ref(), "it must end in .png"), ".png: has no name before its ending: it must end in .png");
/// ```
pub fn wrong_ending(path: &Path, text: &str) -> String {
    let name = path.file_name().map(std::ffi::OsStr::as_encoded_bytes).unwrap_or_default();
    let is_ending = path.extension().is_none() && name.starts_with(b".");
    let fault = if is_ending { "has no name before its ending: " } else { "" };
    format!("{}: {fault}{text}", shown_path(path))
}

/// Writes `path`, which is none of the `protected` files, through `fill`. On failure an existing file of that name is left
/// unchanged.
pub fn write_file(
    path: &Path,
    protected: &Protected,
    fill: impl FnOnce(&mut dyn Write) -> Result<(), String>,
) -> Result<(), ExportError> {
    let place = checked_place(path, protected)?;
    let failed = |error: std::io::Error| ExportError::new(path, cannot_be_written(&error));
    let mut file = Temporary::new(folder_of(&place)).map_err(failed)?;
    {
        let mut writer = BufWriter::new(&mut file);
        fill(&mut writer).map_err(|reason| ExportError::new(path, reason))?;
        writer.flush().map_err(failed)?;
    }
    file.sync().map_err(failed)?;
    file.replace(&place).map_err(failed)
}

/// Writes `bytes` to `path`, which is none of the `protected` files, atomically.
pub fn write_bytes(path: &Path, protected: &Protected, bytes: &[u8]) -> Result<(), ExportError> {
    write_file(path, protected, |writer| writer.write_all(bytes).map_err(|error| cannot_be_written(&error)))
}

/// The reason for which something could not be written into a file.
pub fn cannot_be_written(error: &std::io::Error) -> String {
    let advice = if error.kind() == std::io::ErrorKind::FileTooLarge {
        "; raise the limit on the size of files (ulimit -f)"
    } else {
        ""
    };
    format!("cannot be written: {error}{advice}")
}

/// The first of `folders` in which files can be written; the current one where there is none.
pub fn first_writable(folders: &[PathBuf]) -> PathBuf {
    let is_writable = |folder: &&PathBuf| Temporary::new(folder).is_ok();
    folders.iter().find(is_writable).cloned().unwrap_or_else(|| PathBuf::from("."))
}

/// Writes `bytes` to a new file in `folder`, named `STEM-NNN.EXTENSION` with the first free number from 001, and returns its path.
/// Characters of `stem` that are not portable in file names become hyphens.
pub fn write_new(folder: &Path, stem: &str, extension: &str, bytes: &[u8]) -> Result<PathBuf, ExportError> {
    write_new_with(folder, stem, extension, |writer| writer.write_all(bytes).map_err(|error| cannot_be_written(&error)))
}

/// [`write_new`] with the bytes that `fill` writes.
pub fn write_new_with(
    folder: &Path,
    stem: &str,
    extension: &str,
    fill: impl FnOnce(&mut dyn Write) -> Result<(), String>,
) -> Result<PathBuf, ExportError> {
    let stem: String = stem.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' }).collect();
    let failed = |error: std::io::Error| {
        ExportError::new(folder, format!("takes no files: {error}. Start the program in another folder"))
    };
    let mut file = Temporary::new(folder).map_err(failed)?;
    {
        let mut writer = BufWriter::new(&mut file);
        fill(&mut writer).map_err(|text| ExportError::new(folder, text))?;
        writer.flush().map_err(failed)?;
    }
    for number in 1..10_000_u32 {
        let path = folder.join(format!("{stem}-{number:03}.{extension}"));
        match file.become_new(&path) {
            Ok(()) => return Ok(path),
            Err((error, same)) if error.kind() == std::io::ErrorKind::AlreadyExists => file = same,
            Err((error, _)) => return Err(failed(error)),
        }
    }
    Err(ExportError::new(folder, format!("all 9,999 names {stem}-NNN.{extension} are taken")))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failure here is a failed test")]

    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_bytes(&path, &Protected::default(), b"old").unwrap();
        let error = write_file(&path, &Protected::default(), |writer| {
            writer.write_all(b"new").unwrap();
            Err("disk on fire".to_owned())
        })
        .unwrap_err();
        assert!(error.to_string().contains("disk on fire"), "{error}");
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_written_through() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("sub")).unwrap();
        std::fs::write(at("sub/real"), "old").unwrap();
        for (link, target) in
            [("link", "sub/real"), ("sub/dangling", "new"), ("twice", "link"), ("round", "trip"), ("trip", "round")]
        {
            std::os::unix::fs::symlink(target, at(link)).unwrap();
        }
        let none = Protected::default();
        for (name, place) in [("twice", "sub/real"), ("sub/dangling", "sub/new")] {
            write_bytes(&at(name), &none, name.as_bytes()).unwrap();
            assert_eq!(std::fs::read_to_string(at(place)).unwrap(), name);
            assert!(at(name).is_symlink() && !at(place).is_symlink(), "{name}");
        }
        let error = write_bytes(&at("round"), &none, b"").unwrap_err();
        assert!(error.reason.contains("in a circle"), "{error}");
        // Two names of one place are one output, also where there is no file yet.
        std::os::unix::fs::symlink("later", at("a")).unwrap();
        let mut written = Protected::default();
        written.add_output(&at("a"));
        assert!(written.check(&at("later")).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn names_are_as_long_as_the_folder_takes() {
        let folder = tempfile::tempdir().unwrap();
        let none = Protected::default();
        write_bytes(&folder.path().join("o".repeat(255)), &none, b"").unwrap();
        let error = write_bytes(&folder.path().join("o".repeat(256)), &none, b"").unwrap_err();
        assert!(error.reason.contains("longer than 255 bytes"), "{error}");
    }

    #[test]
    fn unusable_targets_are_refused_early() {
        let none = Protected::default();
        let folder = tempfile::tempdir().unwrap();
        assert!(check_target(folder.path(), &none).unwrap_err().reason.contains("is a folder"));
        assert!(check_target(&folder.path().join("no/file"), &none).unwrap_err().reason.contains("does not exist"));
        assert!(check_target(&folder.path().join("file"), &none).is_ok());
    }
}
