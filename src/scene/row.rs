//! Rows of numbered files: `walk_####.obj` or `walk_*.obj` stands for `walk_0001.obj`, `walk_0002.obj` and so on.

use std::path::{Path, PathBuf};

use super::error::LoadError;
use bvhscope_engine::cancel::CancelToken;

/// Files in a folder between two polls for cancellation.
const FILES_PER_POLL: usize = 256;

/// The files of a folder whose names differ by a number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileRow {
    /// The path with the pattern.
    path: PathBuf,
    /// The names before and after the number.
    around: [String; 2],
    /// Least number of digits.
    digits: usize,
}

/// A file of a row.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct NumberedFile {
    /// Its number.
    pub number: u64,
    /// Its path.
    pub path: PathBuf,
}

impl FileRow {
    /// The row that `path` stands for: its file name has `*` or a run of `#` in the place of the number, and there is no file of this very
    /// name.
    ///
    /// ```
    /// use bvhscope::scene::FileRow;
    ///
    /// assert!(FileRow::of("models/walk_####.obj".as_ref()).is_some());
    /// assert!(FileRow::of("models/walk_0001.obj".as_ref()).is_none());
    /// ```
    pub fn of(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?;
        let start = name.find(['#', '*'])?;
        let (before, rest) = name.split_at(start);
        let digits = rest.bytes().take_while(|&byte| byte == b'#').count();
        let after = rest.get(digits.max(1)..)?;
        let is_single = !after.contains(['#', '*']);
        (is_single && !path.is_file()).then(|| Self {
            path: path.to_owned(),
            around: [before.to_owned(), after.to_owned()],
            digits: digits.max(1),
        })
    }

    /// The path with `#` in the place of each digit of the last number in its name: that of the row that the file belongs to. `None` where
    /// its name has no number.
    ///
    /// ```
    /// use bvhscope::scene::FileRow;
    ///
    /// let row = |file: &str| FileRow::pattern_of(file.as_ref());
    /// assert_eq!(row("v2/walk_0001.obj"), Some("v2/walk_####.obj".into()));
    /// assert_eq!(row("v2/walk.obj"), None);
    /// ```
    pub fn pattern_of(file: &Path) -> Option<PathBuf> {
        let name = file.file_name()?.to_str()?;
        // The number of a name such as a.mp4 or a.obj.gz is before its extensions.
        let stem = name.find('.').filter(|&dot| dot > 0).map_or(name, |dot| &name[..dot]);
        let end = stem.rfind(|c: char| c.is_ascii_digit())?.saturating_add(1);
        let start = stem[..end]
            .rfind(|c: char| !c.is_ascii_digit())
            .map_or(0, |last| last.saturating_add(stem[last..].chars().next().map_or(1, char::len_utf8)));
        let marks = "#".repeat(end.saturating_sub(start));
        Some(file.with_file_name(format!("{}{marks}{}", &name[..start], &name[end..])))
    }

    /// The files of the row, by their numbers. A number that two files have, as 7 and 07, counts once.
    ///
    /// # Errors
    ///
    /// Where the folder cannot be read or has no such file.
    pub fn files(&self, token: &CancelToken) -> Result<Vec<NumberedFile>, LoadError> {
        let folder = self.path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let read = std::fs::read_dir(folder).map_err(|error| {
            LoadError::of_file(&self.path, format!("the folder cannot be read: {error}"), "check its name")
        })?;
        let mut files = Vec::new();
        for (index, entry) in read.flatten().enumerate() {
            token.check_every(FILES_PER_POLL, index)?;
            if let Some(number) = entry.file_name().to_str().and_then(|name| self.number(name)) {
                files.push(NumberedFile { number, path: self.path.with_file_name(entry.file_name()) });
            }
        }
        files.sort_unstable();
        files.dedup_by_key(|file| file.number);
        if files.is_empty() {
            let problem = "no file has such a name with a number in the place of the marks";
            return Err(LoadError::of_file(&self.path, problem, "name a row as in walk_####.obj for walk_0001.obj"));
        }
        Ok(files)
    }

    /// True if no file has such a name.
    pub(super) fn is_missing(&self) -> bool {
        self.files(&CancelToken::new()).is_err()
    }

    /// The number in a file name of the row. With leading zeros, it has just as many digits as the pattern.
    fn number(&self, name: &str) -> Option<u64> {
        let [before, after] = &self.around;
        let digits = name.strip_prefix(before.as_str())?.strip_suffix(after.as_str())?;
        let is_number = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
        let is_of_row = digits.len() == self.digits
            || (digits.len() > self.digits && (self.digits == 1 || !digits.starts_with('0')));
        digits.parse().ok().filter(|_| is_number && is_of_row)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    fn numbers(pattern: &str, names: &[&str]) -> Vec<u64> {
        let folder = tempfile::tempdir().unwrap();
        for name in names {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let row = FileRow::of(&folder.path().join(pattern)).unwrap();
        let files = row.files(&CancelToken::new()).unwrap();
        assert!(files.iter().all(|file| file.path.is_file()));
        files.iter().map(|file| file.number).collect()
    }

    #[test]
    fn marks_stand_for_as_many_digits_and_more_once_these_are_used_up() {
        let names = ["w_0010.obj", "w_0002.obj", "w_10000.obj", "w_00003.obj", "w_4.obj", "w_.obj", "w_0005.ply"];
        assert_eq!(numbers("w_####.obj", &names), [2, 10, 10_000]);
        assert_eq!(numbers("w_*.obj", &names), [2, 3, 4, 10, 10_000]);
        assert_eq!(numbers("w_#.obj", &names), [2, 3, 4, 10, 10_000]);
        // No sign, and no number beyond the largest.
        assert_eq!(numbers("*.ply", &["1.ply", "-2.ply", "+3.ply", "99999999999999999999.ply", "01.ply"]), [1]);
    }

    #[test]
    fn a_file_of_this_very_name_is_no_row() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a#.obj");
        assert!(FileRow::of(&path).is_some());
        std::fs::write(&path, "").unwrap();
        assert!(FileRow::of(&path).is_none());
        assert!(FileRow::of(Path::new("a_##_*.obj")).is_none(), "which of both is the number");
        assert!(FileRow::of(Path::new("a#/b.obj")).is_none(), "folders have no frames");
    }

    #[test]
    fn a_row_without_files_names_the_form() {
        let folder = tempfile::tempdir().unwrap();
        for path in ["w_##.obj", "missing/w_##.obj"] {
            let row = FileRow::of(&folder.path().join(path)).unwrap();
            let text = row.files(&CancelToken::new()).unwrap_err().to_string();
            assert!(text.contains(path), "{text}");
        }
    }

    #[test]
    fn the_last_number_before_the_extensions_is_that_of_the_row() {
        let row = |file: &str| FileRow::pattern_of(Path::new(file)).map(|path| path.display().to_string());
        assert_eq!(row("run2_007.ply.gz"), Some("run2_###.ply.gz".to_owned()));
        assert_eq!(row("12.obj"), Some("##.obj".to_owned()));
        assert_eq!(row("é5é.obj"), Some("é#é.obj".to_owned()));
        assert_eq!(row("a.3ds"), None);
    }
}
