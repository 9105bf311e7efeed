//! Atomic file output: data goes into a temporary file beside the target, which is flushed and then renamed.
//!
//! Knows no file format; callers encode.

use std::io::ErrorKind::{PermissionDenied, QuotaExceeded, ReadOnlyFilesystem, StorageFull};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// A file that cannot be written, and why.
#[derive(Debug, thiserror::Error)]
#[error("{}: {reason}", path.display())]
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

/// Checks that `path` can be written, before work is spent on its contents: its folder exists and is writable, and it is
/// neither a folder nor a device.
pub fn check_target(path: &Path) -> Result<(), ExportError> {
    let Some(name) = path.file_name() else {
        return Err(ExportError::new(path, "this is not a file name"));
    };
    if path.is_dir() {
        return Err(ExportError::new(path, format!("is a folder; name a file in it: {}", path.join("out").display())));
    }
    if path.exists() && !path.is_file() {
        return Err(ExportError::new(path, "is not a regular file; it will not be replaced"));
    }
    let folder = folder_of(path);
    if !folder.is_dir() {
        return Err(ExportError::new(
            path,
            format!("the folder '{}' does not exist; create it first", folder.display()),
        ));
    }
    temporary(folder, name)
        .map(drop)
        .map_err(|error| ExportError::new(path, format!("the folder '{}' takes no files: {error}", folder.display())))
}

/// Writes `path` through `fill`. On failure an existing file of that name is left unchanged.
pub fn write_file(path: &Path, fill: impl FnOnce(&mut dyn Write) -> Result<(), String>) -> Result<(), ExportError> {
    check_target(path)?;
    let failed = |error: std::io::Error| ExportError::new(path, format!("cannot be written: {error}"));
    let name = path.file_name().unwrap_or_default();
    let file = temporary(folder_of(path), name).map_err(failed)?;
    {
        let mut writer = BufWriter::new(file.as_file());
        fill(&mut writer).map_err(|reason| ExportError::new(path, reason))?;
        writer.flush().map_err(failed)?;
    }
    file.as_file().sync_all().map_err(failed)?;
    file.persist(path).map_err(|error| failed(error.error))?;
    Ok(())
}

/// Writes `bytes` to `path`, atomically.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), ExportError> {
    write_file(path, |writer| writer.write_all(bytes).map_err(|error| format!("cannot be written: {error}")))
}

/// Writes `bytes` to a new file in `folder`, named `STEM-NNN.EXTENSION` with the first free number from 001, and returns its path.
/// Characters of `stem` that are not portable in file names become hyphens.
pub fn write_new(folder: &Path, stem: &str, extension: &str, bytes: &[u8]) -> Result<PathBuf, ExportError> {
    let stem: String = stem.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' }).collect();
    let failed = |error: std::io::Error| {
        ExportError::new(folder, format!("takes no files: {error}. Start the program in another folder"))
    };
    let mut file = temporary(folder, std::ffi::OsStr::new(&stem)).map_err(failed)?;
    file.write_all(bytes).map_err(failed)?;
    for number in 1..10_000_u32 {
        let path = folder.join(format!("{stem}-{number:03}.{extension}"));
        match file.persist_noclobber(&path) {
            Ok(_) => return Ok(path),
            Err(error) if error.error.kind() == std::io::ErrorKind::AlreadyExists => file = error.file,
            Err(error) => return Err(failed(error.error)),
        }
    }
    Err(ExportError::new(folder, format!("all 9,999 names {stem}-NNN.{extension} are taken")))
}

/// The parent folder of `path`.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// A temporary file that is deleted on drop unless persisted, with the permissions of an ordinary new file.
fn temporary(folder: &Path, name: &std::ffi::OsStr) -> std::io::Result<tempfile::NamedTempFile> {
    let mut prefix = std::ffi::OsString::from(".");
    prefix.push(name);
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        // Reduced by the process's umask, as for any file.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder).map_err(|error| match error.kind() {
        // Drops the name of the temporary file from the message.
        kind @ (PermissionDenied | ReadOnlyFilesystem | StorageFull | QuotaExceeded) => kind.into(),
        _ => error,
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failure here is a failed test")]

    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_bytes(&path, b"old").unwrap();
        let error = write_file(&path, |writer| {
            writer.write_all(b"new").unwrap();
            Err("disk on fire".to_owned())
        })
        .unwrap_err();
        assert!(error.to_string().contains("disk on fire"), "{error}");
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn unusable_targets_are_refused_early() {
        let folder = tempfile::tempdir().unwrap();
        assert!(check_target(folder.path()).unwrap_err().reason.contains("is a folder"));
        assert!(check_target(&folder.path().join("no/file")).unwrap_err().reason.contains("does not exist"));
        assert!(check_target(&folder.path().join("file")).is_ok());
    }
}
