//! The files that the program reads by itself: small ones, in the folder of its settings, in whose place anything may be.

use std::fs::{File, OpenOptions};
use std::io::{self, Read as _, Write as _};
use std::path::{Path, PathBuf};

/// Bytes of a file that are read at most; settings have some thousand.
const MAX_LENGTH: u64 = 16 << 20;

/// The text of a regular file. Never waits for a pipe or a device.
pub(super) fn read_text(path: &Path) -> io::Result<String> {
    let irregular = || io::Error::other("this is not a regular file");
    if !std::fs::metadata(path)?.is_file() {
        return Err(irregular());
    }
    let mut open = OpenOptions::new();
    open.read(true);
    // It may have become a pipe in the meantime.
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut open, libc::O_NONBLOCK);
    let file: File = open.open(path)?;
    if !file.metadata()?.is_file() {
        return Err(irregular());
    }
    let mut text = String::new();
    file.take(MAX_LENGTH).read_to_string(&mut text)?;
    Ok(text)
}

/// Whether there is something that is no regular file.
pub(super) fn is_irregular(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|metadata| !metadata.is_file())
}

/// Writes a new file in the place of whatever is there, which is not written through.
pub(super) fn write_text(path: &Path, text: &str) -> io::Result<()> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    OpenOptions::new().write(true).create_new(true).open(path)?.write_all(text.as_bytes())
}

/// Renames a file, folder or pipe to `NAME.bad` and returns that name.
pub(super) fn set_aside(path: &Path) -> io::Result<PathBuf> {
    let mut outcome = Err(io::ErrorKind::AlreadyExists.into());
    // An earlier file of that name is replaced, which a folder is not.
    for suffix in ["bad", "bad-2", "bad-3"] {
        let mut name = path.as_os_str().to_owned();
        name.push(".");
        name.push(suffix);
        outcome = std::fs::rename(path, &name).map(|()| name.into());
        match &outcome {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {}
            _ => break,
        }
    }
    outcome
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_read_from_or_written_through_what_is_no_file() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("folder")).unwrap();
        std::fs::write(at("model"), "kept").unwrap();
        for name in ["folder", "missing"] {
            assert!(read_text(&at(name)).is_err(), "{name}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("/dev/zero", at("endless")).unwrap();
            assert!(read_text(&at("endless")).is_err() && is_irregular(&at("endless")));
            std::os::unix::fs::symlink(at("model"), at("link")).unwrap();
            write_text(&at("link"), "new").unwrap();
            assert_eq!(read_text(&at("link")).unwrap(), "new");
        }
        assert_eq!(read_text(&at("model")).unwrap(), "kept");
        assert!(is_irregular(&at("folder")) && !is_irregular(&at("model")) && !is_irregular(&at("missing")));
    }

    #[test]
    fn what_is_set_aside_replaces_no_folder() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.json");
        for name in ["a.json.bad", "a.json.bad-2", "a.json.bad-3"] {
            std::fs::create_dir_all(&file).unwrap();
            std::fs::write(file.join("inside"), name).unwrap();
            assert_eq!(set_aside(&file).unwrap(), folder.path().join(name));
            assert_eq!(std::fs::read_to_string(folder.path().join(name).join("inside")).unwrap(), name);
        }
        assert!(!file.exists());
    }
}
