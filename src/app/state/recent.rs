//! Recently opened files.

use std::path::PathBuf;

use crate::scene::SceneSource;

/// Maximum length of the list.
const MAX_RECENT: usize = 10;

/// Moves a file to the head of the list. Built-in scenes are not listed.
pub fn remember(recent: &mut Vec<PathBuf>, source: &SceneSource) {
    // The next run may have another current folder.
    if let SceneSource::File(path) = source.absolute() {
        remember_file(recent, path);
    }
}

/// Moves a file, whose path is absolute, to the head of the list.
pub fn remember_file(recent: &mut Vec<PathBuf>, path: PathBuf) {
    recent.retain(|known| *known != path);
    recent.insert(0, path);
    recent.truncate(MAX_RECENT);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn newest_file_comes_first_and_only_once() {
        let mut recent = Vec::new();
        for name in ["/a.obj", "/b.obj", "/a.obj"] {
            remember(&mut recent, &SceneSource::File(name.into()));
        }
        remember(&mut recent, &SceneSource::default_builtin());
        assert_eq!(recent, [PathBuf::from("/a.obj"), PathBuf::from("/b.obj")]);
    }

    #[test]
    fn list_is_bounded() {
        let mut recent = Vec::new();
        for i in 0..30 {
            remember(&mut recent, &SceneSource::File(format!("/{i}.obj").into()));
        }
        assert_eq!(recent.len(), MAX_RECENT);
    }
}
