//! Lists folders for the path field, on threads of their own because a folder may be on a slow network.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

use crate::app::state::{AppState, FolderEntry, Listing};
use crate::scene::FileFormat;

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
        let is_model = || FileFormat::from_extension(&path).is_some();
        let name = entry.file_name().into_string().ok()?;
        (is_folder || is_model()).then_some(FolderEntry { name, is_folder })
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
