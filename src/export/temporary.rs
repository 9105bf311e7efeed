//! Incomplete files: beside their targets, under names of their own, and gone whenever the process ends.

use std::io::ErrorKind::{NotFound, PermissionDenied, QuotaExceeded, ReadOnlyFilesystem, StorageFull};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::Duration;

use tempfile::NamedTempFile;

/// The parent folder of `path`.
pub(super) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Longest chain of links that is followed, as on Linux.
const MAX_LINKS: usize = 40;

/// The place where `path` is written: where its symbolic links lead, whether there is a file or not.
pub(super) fn destination(path: &Path) -> io::Result<PathBuf> {
    let mut place = path.to_owned();
    for _ in 0..MAX_LINKS {
        match std::fs::symlink_metadata(&place) {
            Ok(found) if found.is_symlink() => {
                let target = std::fs::read_link(&place)?;
                place = folder_of(&place).join(target);
            }
            Ok(_) => return Ok(place),
            Err(error) if error.kind() == NotFound => return Ok(place),
            Err(error) => return Err(error),
        }
    }
    Err(io::Error::other("its symbolic links lead round in a circle"))
}

/// The incomplete files of this process.
static INCOMPLETE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn incomplete() -> MutexGuard<'static, Vec<PathBuf>> {
    INCOMPLETE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Deletes the incomplete files of this process and makes no more. Called before the process ends without running destructors.
pub fn remove_incomplete() {
    // The lock is held while a file is made, which may take long on a disk that does not answer.
    for _ in 0..10 {
        match INCOMPLETE.try_lock() {
            Ok(paths) => {
                remove(paths.iter());
                std::mem::forget(paths);
                return;
            }
            Err(TryLockError::Poisoned(_)) => return,
            Err(TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(10)),
        }
    }
}

fn remove<'a>(paths: impl Iterator<Item = &'a PathBuf>) {
    for path in paths {
        // One that became complete is gone from this name.
        let _ = std::fs::remove_file(path);
    }
}

/// A file that is deleted when dropped, unless it was completed.
pub(super) struct Temporary {
    file: Option<NamedTempFile>,
    path: PathBuf,
}

impl Temporary {
    /// A file in `folder`, with the permissions of an ordinary new file. Its name is short, so that any name that the folder
    /// takes can be that of the complete file.
    pub(super) fn new(folder: &Path) -> io::Result<Self> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(".").suffix(".part");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            // Reduced by the process's umask, as for any file.
            builder.permissions(std::fs::Permissions::from_mode(0o666));
        }
        let mut paths = incomplete();
        let file = builder.tempfile_in(folder).map_err(|error| match error.kind() {
            // Drops the name of the temporary file from the message.
            kind @ (PermissionDenied | ReadOnlyFilesystem | StorageFull | QuotaExceeded) => kind.into(),
            _ => error,
        })?;
        let path = file.path().to_owned();
        paths.push(path.clone());
        Ok(Self { file: Some(file), path })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes everything to the disk.
    pub(super) fn sync(&self) -> io::Result<()> {
        self.file.as_ref().map_or(Ok(()), |file| file.as_file().sync_all())
    }

    /// Makes it the file at `target`, in place of the one there.
    pub(super) fn replace(mut self, target: &Path) -> io::Result<()> {
        self.file.take().map_or(Ok(()), |file| file.persist(target).map(drop).map_err(|error| error.error))
    }

    /// Makes it the file at `target`, where there is none; otherwise gives it back.
    pub(super) fn become_new(mut self, target: &Path) -> Result<(), (io::Error, Self)> {
        let Some(file) = self.file.take() else { return Ok(()) };
        file.persist_noclobber(target).map(drop).map_err(|failed| {
            self.file = Some(failed.file);
            (failed.error, self)
        })
    }
}

impl Write for Temporary {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.as_mut().map_or(Ok(bytes.len()), |file| file.as_file_mut().write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // Deleted before it is forgotten.
        drop(self.file.take());
        incomplete().retain(|path| *path != self.path);
    }
}

/// Upper and lower case make no difference in `folder`. `false` where no file can be made there.
pub(super) fn is_case_insensitive(folder: &Path) -> bool {
    let Ok(probe) = Temporary::new(folder) else { return false };
    // Files appear as long as the probe exists; its random part is no other file's.
    let name = probe.path().file_name().unwrap_or_default().to_string_lossy().into_owned();
    probe.path().with_file_name(name.replace(".part", ".PART")).exists()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failure here is a failed test")]

    use super::*;

    #[test]
    fn incomplete_files_are_known_until_they_are_complete() {
        let folder = tempfile::tempdir().unwrap();
        let files = || std::fs::read_dir(folder.path()).unwrap().count();
        let known = || incomplete().iter().filter(|path| path.starts_with(folder.path())).count();
        let [complete, new, dropped, removed] = [(); 4].map(|()| Temporary::new(folder.path()).unwrap());
        assert_eq!((known(), files()), (4, 4));
        complete.replace(&folder.path().join("complete")).unwrap();
        assert!(new.become_new(&folder.path().join("new")).is_ok());
        drop(dropped);
        assert_eq!((known(), files()), (1, 3));
        remove([removed.path().to_owned()].iter());
        assert_eq!(files(), 2, "complete files stay");
    }
}
