//! Lessons of a teacher: the text files of a folder, beside the built-in ones.

use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::app::state::lesson::Lesson;
use crate::text::shown_path;

/// Largest lesson that is read, in bytes.
const MAX_BYTES: u64 = 1 << 20;
/// Largest number of lessons of a folder.
const MAX_FILES: usize = 200;

/// The lessons in the files `*.txt` of `folder`, by name, and a warning for each that cannot be read.
pub(crate) fn read_folder(folder: &Path) -> (Vec<Arc<Lesson>>, Vec<String>) {
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
        match read(file).and_then(|text| Lesson::parse(&text)) {
            Ok(lesson) => lessons.push(Arc::new(lesson)),
            Err(reason) => warnings.push(format!("the lesson {} cannot be used: {reason}", shown_path(file))),
        }
    }
    (lessons, warnings)
}

fn is_lesson(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "txt") && path.is_file()
}

fn read(file: &Path) -> Result<String, String> {
    let mut text = String::new();
    let opened = std::fs::File::open(file).map_err(|error| error.to_string())?;
    let length = opened.take(MAX_BYTES + 1).read_to_string(&mut text).map_err(|error| error.to_string())?;
    if length as u64 > MAX_BYTES {
        return Err(format!("it is longer than {MAX_BYTES} bytes"));
    }
    Ok(text)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn one_bad_lesson_leaves_the_others() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &[u8]| std::fs::write(folder.path().join(name), text).unwrap();
        assert!(read_folder(folder.path()).1[0].contains("there is no lesson"));
        write("a.txt", b"title: Mine\nstate: 1 {}\ncaption: Look.");
        write("b.txt", b"title: Broken\nstate: 1 {");
        write("c.txt", &[0xff, 0xfe]);
        write("notes.md", b"nothing");
        let (lessons, warnings) = read_folder(folder.path());
        assert_eq!(lessons.iter().map(|lesson| &lesson.title[..]).collect::<Vec<_>>(), ["Mine"]);
        assert_eq!(warnings.len(), 2, "{warnings:?}");
        assert!(warnings[0].contains("b.txt") && warnings[0].contains("line 2"), "{warnings:?}");
        assert!(read_folder(&folder.path().join("none")).1[0].contains("cannot be read"));
    }
}
