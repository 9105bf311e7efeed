//! The files that the program reads by itself: small ones, in the folder of its settings, in whose place anything may
//! be; lessons of a teacher, the text files of a folder; and what folders offer to the path field, listed on threads of
//! their own because a folder may be on a slow network.

use std::fs::{File, OpenOptions};
use std::io::{self, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

use crate::app::state::lesson::Lesson;
use crate::app::state::{AppState, FolderEntry, Listing};
use crate::ray_file::is_ray_file;
use crate::scene::FileFormat;
use crate::text::shown_path;

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

/// Whether `path` exists and is no regular file.
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

/// Largest lesson that is read, in bytes.
const MAX_BYTES: u64 = 1 << 20;
/// Largest number of lessons of a folder.
const MAX_FILES: usize = 200;

/// The lessons in the files `*.txt` of `folder`, by name, and a warning for each that cannot be read.
pub(crate) fn read_lessons(folder: &Path) -> (Vec<Arc<Lesson>>, Vec<String>) {
    let mut files: Vec<PathBuf> = match std::fs::read_dir(folder) {
        Ok(entries) => entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| is_lesson(path)).collect(),
        Err(error) => {
            return (Vec::new(), vec![format!("the lessons in {} cannot be read: {error}", shown_path(folder))]);
        }
    };
    files.sort();
    let mut warnings = Vec::new();
    if files.is_empty() {
        warnings.push(format!("there is no lesson in {}: lessons are files *.txt", shown_path(folder)));
    }
    if files.len() > MAX_FILES {
        warnings.push(format!("only the first {MAX_FILES} lessons of {} are read", shown_path(folder)));
    }
    let mut lessons = Vec::new();
    for file in files.iter().take(MAX_FILES) {
        match read_lesson(file).and_then(|text| Lesson::parse(&text)) {
            Ok(lesson) => lessons.push(Arc::new(lesson)),
            Err(reason) => warnings.push(format!("the lesson {} cannot be used: {reason}", shown_path(file))),
        }
    }
    (lessons, warnings)
}

fn is_lesson(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "txt") && path.is_file()
}

fn read_lesson(file: &Path) -> Result<String, String> {
    let mut text = String::new();
    let opened = std::fs::File::open(file).map_err(|error| error.to_string())?;
    let length = opened.take(MAX_BYTES + 1).read_to_string(&mut text).map_err(|error| error.to_string())?;
    if length as u64 > MAX_BYTES {
        return Err(format!("it is longer than {MAX_BYTES} bytes"));
    }
    Ok(text)
}

/// Maximum number of entries of a folder that are read.
const MAX_ENTRIES: usize = 20_000;

/// Folders being listed.
pub(super) struct FolderListing {
    listed: (Sender<Listing>, Receiver<Listing>),
}

impl FolderListing {
    pub(super) fn new() -> Self {
        Self { listed: channel() }
    }

    /// Lists `folder` in the background, then calls `wake`.
    pub(super) fn request(&self, folder: PathBuf, wake: Arc<dyn Fn() + Send + Sync>) {
        let listed = self.listed.0.clone();
        let thread = std::thread::Builder::new().name("list folder".to_owned()).spawn(move || {
            let entries = entries(&folder);
            // Sending fails where the window was closed meanwhile, which is fine.
            let _ = listed.send(Listing { folder, entries });
            wake();
        });
        if let Err(error) = thread {
            log::warn!("the folder is not listed: {error}");
        }
    }

    /// Takes what was listed, if it is still wanted.
    pub(super) fn poll(&self, state: &mut AppState) {
        for listing in self.listed.1.try_iter() {
            if state.layout.path_field.requested.as_ref() == Some(&listing.folder) {
                state.layout.path_field.listing = Some(listing);
            }
        }
    }
}

/// Folders, then models; none where the folder cannot be read.
fn entries(folder: &Path) -> Vec<FolderEntry> {
    let Ok(read) = std::fs::read_dir(folder) else { return Vec::new() };
    let entry = |entry: std::fs::DirEntry| {
        let path = entry.path();
        let is_folder = path.is_dir();
        let is_known = || FileFormat::from_extension(&path).is_some() || is_ray_file(&path);
        let name = entry.file_name().into_string().ok()?;
        (is_folder || is_known()).then_some(FolderEntry { name, is_folder })
    };
    let mut entries: Vec<FolderEntry> = read.take(MAX_ENTRIES).filter_map(|it| entry(it.ok()?)).collect();
    entries
        .sort_by(|a, b| b.is_folder.cmp(&a.is_folder).then_with(|| a.name.to_lowercase().cmp(&b.name.to_lowercase())));
    entries
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

    #[test]
    fn one_bad_lesson_leaves_the_others() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &[u8]| std::fs::write(folder.path().join(name), text).unwrap();
        assert!(read_lessons(folder.path()).1[0].contains("there is no lesson"));
        write("a.txt", b"title: Mine\nstate: 1 {}\ncaption: Look.");
        write("b.txt", b"title: Broken\nstate: 1 {");
        write("c.txt", &[0xff, 0xfe]);
        write("notes.md", b"nothing");
        let (lessons, warnings) = read_lessons(folder.path());
        assert_eq!(lessons.iter().map(|lesson| &lesson.title[..]).collect::<Vec<_>>(), ["Mine"]);
        assert_eq!(warnings.len(), 2, "{warnings:?}");
        assert!(warnings[0].contains("b.txt") && warnings[0].contains("line 2"), "{warnings:?}");
        assert!(read_lessons(&folder.path().join("none")).1[0].contains("cannot be read"));
    }

    #[test]
    fn folders_come_first_and_only_models_follow() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["b.obj", "A.glb", "notes.txt"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        std::fs::create_dir(folder.path().join("z")).unwrap();
        let shown: Vec<String> = entries(folder.path()).iter().map(FolderEntry::shown).collect();
        assert_eq!(shown, ["z/", "A.glb", "b.obj"]);
        assert!(entries(Path::new("/nowhere/at/all")).is_empty());
    }
}
