//! Watches the files that trees were read from.

use crate::app::shell::file_watch::{FileChange, FileWatch, WatchedFile};
use crate::app::state::TreeSide;

/// Watches the file of each tree, on threads that exist only where there is one.
pub(crate) struct TreeWatch {
    wake: Box<dyn Fn() -> Box<dyn Fn() + Send>>,
    watches: [Option<FileWatch>; 2],
}

impl TreeWatch {
    /// Watches nothing yet; `wake` is called from other threads after each change.
    pub(crate) fn new(wake: impl Fn() + Send + Clone + 'static) -> Self {
        Self { wake: Box::new(move || Box::new(wake.clone())), watches: [None, None] }
    }

    /// Watches `files`, in the order of [`TreeSide::ALL`]; their changes since the last call, oldest first.
    pub(crate) fn changes(&mut self, files: &[Option<WatchedFile>; 2]) -> Vec<(TreeSide, FileChange)> {
        let mut changes = Vec::new();
        for ((side, file), watch) in TreeSide::ALL.into_iter().zip(files).zip(&mut self.watches) {
            if file.is_none() {
                *watch = None;
                continue;
            }
            if watch.is_none() {
                // Where no thread can be started, the tree is not followed.
                *watch = FileWatch::new((self.wake)()).ok();
            }
            if let Some(watch) = watch {
                watch.watch(file.as_ref());
                changes.extend(watch.changes().into_iter().map(|change| (side, change)));
            }
        }
        changes
    }
}
