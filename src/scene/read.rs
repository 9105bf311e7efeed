//! Reads files: regular ones only, in chunks, with progress and cancellation.

use std::fs::{File, OpenOptions};
use std::io::Read;
use std::path::Path;

use super::error::{FileLocation, LoadError};
use super::format::FileFormat;
use super::options::LoadOptions;
use crate::budget::Budget;
use bvhscope_engine::cancel::CancelToken;

/// A model that a loader reads.
#[derive(Clone, Copy)]
pub(super) struct ModelFile<'a> {
    /// Path, whose folder has the files that the model names.
    pub(super) path: &'a Path,
    /// Contents, unpacked.
    pub(super) bytes: &'a [u8],
    pub(super) options: &'a LoadOptions,
    /// Cancels loading and receives its progress.
    pub(super) token: &'a CancelToken,
}

/// Fraction of the loading progress that reading the file accounts for.
pub(super) const READ_PROGRESS: f32 = 0.2;

/// The mark of UTF-8 at the beginning of a text, and within one that was put together from several.
pub(super) const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// Bytes between two cancellation checks.
const CHUNK_SIZE: usize = 1 << 22;

/// Maximum length of a line in bytes; no model has longer ones.
pub(super) const MAX_LINE: usize = 1 << 20;

/// Maximum number of bytes of leading white space that are skipped.
const MAX_PREFIX: usize = 1 << 16;

/// Bytes of the beginning that decide between text and binary data.
pub(super) const TEXT_SAMPLE: usize = 512;

/// The beginning of a text without byte order mark and leading white space.
pub(super) fn beginning(bytes: &[u8]) -> &[u8] {
    let bytes = bytes.get(..MAX_PREFIX).unwrap_or(bytes);
    bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes).trim_ascii_start()
}

/// Whether the beginning has no control characters but white space: text of one byte a character, or UTF-8.
pub(super) fn is_plain_text(bytes: &[u8]) -> bool {
    let start = bytes.get(..TEXT_SAMPLE).unwrap_or(bytes);
    !start.iter().any(|&byte| is_control(byte))
}

/// Whether a byte does not occur in text.
pub(super) fn is_control(byte: u8) -> bool {
    byte.is_ascii_control() && !byte.is_ascii_whitespace() && byte != 0x0B
}

/// The lines of a text without their line endings. A line longer than [`MAX_LINE`] is split, so that a reader can check for
/// cancellation within gigabytes without a line ending.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = Some(bytes);
    std::iter::from_fn(move || {
        let all = rest.take()?;
        let start = all.get(..=MAX_LINE).unwrap_or(all);
        match start.iter().position(|&byte| byte == b'\n' || byte == b'\r') {
            Some(end) => {
                let (line, after) = all.split_at(end);
                rest = Some(after.strip_prefix(b"\r\n").or_else(|| after.get(1..)).unwrap_or_default());
                Some(line)
            }
            None if start.len() < all.len() => {
                rest = all.get(start.len()..);
                Some(start)
            }
            None => Some(all).filter(|last| !last.is_empty()),
        }
    })
}

/// Reads a whole model file; an empty one is an error.
pub(super) fn read_model(path: &Path, token: &CancelToken) -> Result<Vec<u8>, LoadError> {
    let bytes = read_file(path, Some(READ_PROGRESS), token)?;
    if bytes.is_empty() {
        return Err(LoadError::of_file(path, "the file is empty", "save the model again"));
    }
    Ok(bytes)
}

/// Reads a whole file. Its length is taken when it is opened, so that a growing file ends there.
pub(crate) fn read_file(path: &Path, progress: Option<f32>, token: &CancelToken) -> Result<Vec<u8>, LoadError> {
    let mut file = open_regular(path)?;
    let length = file.metadata().map_err(|error| explain(path, &error))?.len();
    let size = usize::try_from(length).map_err(|_| out_of_memory(path, length))?;
    Budget::of_process().check("the file", length).map_err(|error| LoadError::over_budget(path, &error))?;
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(size).map_err(|_| out_of_memory(path, length))?;
    fill(&mut bytes, size, &mut file, path, progress, token)?;
    Ok(bytes)
}

/// Reads `size` bytes from `source`.
fn fill(
    bytes: &mut Vec<u8>,
    size: usize,
    source: &mut impl Read,
    path: &Path,
    progress: Option<f32>,
    token: &CancelToken,
) -> Result<(), LoadError> {
    while bytes.len() < size {
        token.check()?;
        let start = bytes.len();
        let portion = CHUNK_SIZE.min(size.saturating_sub(start));
        let got = source.by_ref().take(portion as u64).read_to_end(bytes);
        let got = got.map_err(|error| {
            let location = FileLocation::Byte(bytes.len() as u64);
            LoadError::at(path, location, format!("reading failed: {error}"), "check the disk or the network it is on")
        })?;
        if got == 0 {
            let problem = format!("changed while being read: {start} bytes instead of {size}");
            return Err(LoadError::of_file(path, problem, "open it again"));
        }
        if let Some(fraction) = progress {
            token.set_progress(fraction * bytes.len() as f32 / size as f32);
        }
    }
    Ok(())
}

/// Opens a regular file; never blocks on pipes or devices.
fn open_regular(path: &Path) -> Result<File, LoadError> {
    let metadata = std::fs::metadata(path).map_err(|error| explain(path, &error))?;
    if metadata.is_dir() {
        return Err(LoadError::of_file(path, "is a folder", loadable_files(path)));
    }
    if !metadata.is_file() {
        return Err(LoadError::of_file(path, "is not a regular file but a pipe, socket or device", COPY_FIRST));
    }
    let mut open = OpenOptions::new();
    open.read(true);
    // If the file has become a pipe in the meantime, opening must not wait for a writer.
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut open, libc::O_NONBLOCK);
    let file = open.open(path).map_err(|error| explain(path, &error))?;
    match file.metadata() {
        Ok(metadata) if metadata.is_file() => Ok(file),
        _ => Err(LoadError::of_file(path, "is not a regular file", COPY_FIRST)),
    }
}

/// Advice about something that is no regular file.
const COPY_FIRST: &str = "copy what it holds into a file and open that";

fn out_of_memory(path: &Path, length: u64) -> LoadError {
    let problem = format!("needs {length} bytes of memory, more than there is");
    LoadError::of_file(path, problem, "close other programs or take a smaller model")
}

fn explain(path: &Path, error: &std::io::Error) -> LoadError {
    match error.kind() {
        std::io::ErrorKind::NotFound if path.as_os_str() == "-" => {
            LoadError::of_file(path, "standard input cannot be read", "write the model to a file and name that")
        }
        std::io::ErrorKind::NotFound => LoadError::of_file(path, "no such file", similar_files(path)),
        std::io::ErrorKind::PermissionDenied => {
            LoadError::of_file(path, "may not be read by this user", "change its permissions")
        }
        _ => LoadError::of_file(path, format!("cannot be opened: {error}"), "check its name and the disk it is on"),
    }
}

/// File names in a folder, sorted; at most 10,000.
fn names_in(folder: &Path) -> Vec<String> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().take(10_000);
    let mut names: Vec<_> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

fn is_model(name: &str) -> bool {
    FileFormat::from_extension(Path::new(name)).is_some()
}

fn loadable_files(folder: &Path) -> String {
    let usable = |name: &String| is_model(name) && folder.join(name).is_file();
    let names: Vec<_> = names_in(folder).into_iter().filter(usable).take(5).collect();
    if names.is_empty() {
        "it holds no model; name a file".to_owned()
    } else {
        format!("name a model in it: {}", names.join(", "))
    }
}

/// A hint at similarly named files in the same folder.
fn similar_files(path: &Path) -> String {
    let Some(wanted) = path.file_name().map(|name| name.to_string_lossy().to_lowercase()) else {
        return "name a file".to_owned();
    };
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut scored: Vec<_> = names_in(folder)
        .into_iter()
        .map(|name| (strsim::levenshtein(&wanted, &name.to_lowercase()), name))
        .filter(|(distance, name)| {
            let shorter = wanted.chars().count().min(name.chars().count());
            // Names that share no letter are not similar, however short.
            *distance <= (shorter / 3).max(1) && *distance < shorter
        })
        .collect();
    scored.sort();
    let names: Vec<_> = scored.into_iter().take(3).map(|(_, name)| format!("'{name}'")).collect();
    if names.is_empty() {
        "check the spelling and the folder".to_owned()
    } else {
        format!("did you mean {}?", names.join(" or "))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use std::io::Write as _;

    use super::*;

    /// A reader that yields this many bytes, one at a time, and then fails.
    struct Failing(usize);

    impl Read for Failing {
        fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
            self.0 = self.0.checked_sub(1).ok_or_else(|| std::io::Error::other("the disk is gone"))?;
            buffer[0] = 7;
            Ok(1)
        }
    }

    #[test]
    fn a_read_error_reports_its_offset() {
        let mut bytes = Vec::new();
        let path = Path::new("a.stl");
        fill(&mut bytes, 100, &mut Failing(200), path, Some(1.0), &CancelToken::new()).unwrap();
        assert_eq!(bytes, [7; 100]);
        let error = fill(&mut Vec::new(), 100, &mut Failing(40), path, None, &CancelToken::new()).unwrap_err();
        assert_eq!(
            error.to_string(),
            "a.stl: at byte 40: reading failed: the disk is gone; check the disk or the network it is on"
        );
    }

    #[test]
    fn a_growing_file_is_read_up_to_its_initial_length() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.stl");
        std::fs::write(&path, vec![1; CHUNK_SIZE + 10]).unwrap();
        let written_path = path.clone();
        let token = CancelToken::watched(move |_| {
            OpenOptions::new().append(true).open(&written_path).unwrap().write_all(&[2; 1000]).unwrap();
            false
        });
        let bytes = read_file(&path, None, &token).unwrap();
        assert_eq!((bytes.len(), bytes.last()), (CHUNK_SIZE + 10, Some(&1)));
    }

    #[test]
    fn a_file_that_shrinks_while_being_read_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.stl");
        std::fs::write(&path, vec![1; CHUNK_SIZE + 10]).unwrap();
        let written_path = path.clone();
        let token = CancelToken::watched(move |poll| {
            if poll == 2 {
                std::fs::write(&written_path, b"short").unwrap();
            }
            false
        });
        let message = read_file(&path, None, &token).unwrap_err().to_string();
        assert!(message.contains("changed while being read"), "{message}");
    }
}
