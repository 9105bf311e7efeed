//! Watches the files of the loaded model and of trees for changes. A thread of its own polls size and modification
//! time, because a file on a network may block; polling by path also works for programs that save by renaming, which
//! system notifications may miss.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use crate::app::state::TreeSide;

/// Interval between two polls.
const POLL_INTERVAL: Duration = Duration::from_millis(250);
/// Time for which a file must stay the same before its change is reported: a program may still be writing it.
const SETTLE_TIME: Duration = Duration::from_millis(200);

/// Size and modification time of a file, which together identify its content.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct FileStamp {
    length: u64,
    modified: Option<SystemTime>,
}

impl FileStamp {
    /// The stamp of the file at `path`; `None` where there is no such file.
    fn of(path: &Path) -> Option<Self> {
        let metadata = std::fs::metadata(path).ok().filter(std::fs::Metadata::is_file)?;
        Some(Self { length: metadata.len(), modified: metadata.modified().ok() })
    }
}

/// A file and its content at some time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct WatchedFile {
    pub path: PathBuf,
    stamp: FileStamp,
}

impl WatchedFile {
    /// The file at `path` as it is now; `None` where there is no such file.
    pub(crate) fn of(path: &Path) -> Option<Self> {
        Some(Self { path: path.to_owned(), stamp: FileStamp::of(path)? })
    }
}

/// A change of a watched file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FileChange {
    /// It has other content, and is no longer being written.
    Modified,
    /// It no longer exists.
    Removed,
    /// It exists again, with the same content as before.
    Restored,
}

/// Turns the stamps of successive polls into changes.
struct ChangeDetector {
    /// The content last reported.
    known: FileStamp,
    /// The stamp of the last poll, and since when it has been the same.
    last: Option<(Option<FileStamp>, Instant)>,
    removed: bool,
}

impl ChangeDetector {
    const fn new(known: FileStamp) -> Self {
        Self { known, last: None, removed: false }
    }

    fn observe(&mut self, stamp: Option<FileStamp>, now: Instant) -> Option<FileChange> {
        match self.last {
            Some((last, since)) if last == stamp => {
                if now.duration_since(since) < SETTLE_TIME {
                    return None;
                }
            }
            _ => {
                self.last = Some((stamp, now));
                return None;
            }
        }
        let was_removed = std::mem::replace(&mut self.removed, stamp.is_none());
        match stamp {
            None => (!was_removed).then_some(FileChange::Removed),
            Some(stamp) if stamp != self.known => {
                self.known = stamp;
                Some(FileChange::Modified)
            }
            Some(_) => was_removed.then_some(FileChange::Restored),
        }
    }
}

/// The file to watch, passed to the thread.
#[derive(Default)]
struct Slot {
    file: Option<WatchedFile>,
    changed: bool,
    closed: bool,
}

#[derive(Default)]
struct Shared {
    slot: Mutex<Slot>,
    changed: Condvar,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Slot> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Watches one file at a time.
pub(crate) struct FileWatch {
    shared: Arc<Shared>,
    changes: Receiver<(PathBuf, FileChange)>,
    file: Option<WatchedFile>,
}

impl FileWatch {
    /// Starts the thread; `wake` is called from it after each change.
    pub(crate) fn new(wake: impl Fn() + Send + 'static) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let (sender, changes) = channel();
        let thread_shared = Arc::clone(&shared);
        std::thread::Builder::new().name("file watch".to_owned()).spawn(move || run(&thread_shared, &sender, &wake))?;
        Ok(Self { shared, changes, file: None })
    }

    /// Watches `file`, compared with its content at the time it was read. Returns whether that differs from the last call.
    pub(crate) fn watch(&mut self, file: Option<&WatchedFile>) -> bool {
        if self.file.as_ref() == file {
            return false;
        }
        self.file = file.cloned();
        let mut slot = self.shared.lock();
        slot.file.clone_from(&self.file);
        slot.changed = true;
        drop(slot);
        self.shared.changed.notify_one();
        true
    }

    /// Changes of the file since the last call, oldest first.
    pub(crate) fn changes(&self) -> Vec<FileChange> {
        let is_watched = |path: &PathBuf| self.file.as_ref().is_some_and(|file| file.path == *path);
        self.changes.try_iter().filter(|(path, _)| is_watched(path)).map(|(_, change)| change).collect()
    }
}

impl Drop for FileWatch {
    fn drop(&mut self) {
        // The thread is not joined: it may be waiting for a network that does not answer.
        self.shared.lock().closed = true;
        self.shared.changed.notify_one();
    }
}

fn run(shared: &Shared, sender: &Sender<(PathBuf, FileChange)>, wake: &dyn Fn()) {
    let mut watched: Option<(PathBuf, ChangeDetector)> = None;
    loop {
        let mut slot = shared.lock();
        if !slot.changed && !slot.closed {
            slot = if watched.is_some() {
                shared.changed.wait_timeout(slot, POLL_INTERVAL).unwrap_or_else(PoisonError::into_inner).0
            } else {
                shared.changed.wait(slot).unwrap_or_else(PoisonError::into_inner)
            };
        }
        if slot.closed {
            return;
        }
        if std::mem::take(&mut slot.changed) {
            watched = slot.file.clone().map(|file| (file.path, ChangeDetector::new(file.stamp)));
        }
        drop(slot);
        let Some((path, detector)) = &mut watched else { continue };
        if let Some(change) = detector.observe(FileStamp::of(path), Instant::now()) {
            if sender.send((path.clone(), change)).is_err() {
                return;
            }
            wake();
        }
    }
}

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

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn a_change_is_reported_once_the_file_has_settled() {
        let stamp = |length| Some(FileStamp { length, modified: None });
        let start = Instant::now();
        let mut detector = ChangeDetector::new(stamp(10).unwrap());
        let mut at = 0;
        let mut observe = |stamp| {
            at += 250;
            detector.observe(stamp, start + Duration::from_millis(at))
        };
        assert_eq!([observe(stamp(10)), observe(stamp(10))], [None, None], "unchanged");
        // Written in several steps.
        assert_eq!([observe(stamp(3)), observe(stamp(7)), observe(stamp(12))], [None, None, None]);
        assert_eq!([observe(stamp(12)), observe(stamp(12))], [Some(FileChange::Modified), None], "reported once");
        // Deleted and written again, as some editors save: not a removal.
        assert_eq!([observe(None), observe(stamp(13)), observe(stamp(13))], [None, None, Some(FileChange::Modified)]);
        assert_eq!([observe(None), observe(None), observe(None)], [None, Some(FileChange::Removed), None]);
        assert_eq!(
            [observe(stamp(13)), observe(stamp(13)), observe(stamp(13))],
            [None, Some(FileChange::Restored), None]
        );
        assert_eq!([observe(None), observe(None)], [None, Some(FileChange::Removed)]);
        assert_eq!([observe(stamp(14)), observe(stamp(14))], [None, Some(FileChange::Modified)]);
    }

    #[test]
    fn the_thread_reports_a_file_renamed_into_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        std::fs::write(&path, "old").unwrap();
        let (woken, wakes) = channel();
        let mut watch = FileWatch::new(move || woken.send(()).unwrap()).unwrap();
        let file = WatchedFile::of(&path).unwrap();
        assert!(watch.watch(Some(&file)) && !watch.watch(Some(&file)));
        std::fs::write(folder.path().join("a.tmp"), "newer").unwrap();
        std::fs::rename(folder.path().join("a.tmp"), &path).unwrap();
        wakes.recv_timeout(Duration::from_mins(1)).unwrap();
        assert_eq!(watch.changes(), [FileChange::Modified]);
        std::fs::remove_file(&path).unwrap();
        wakes.recv_timeout(Duration::from_mins(1)).unwrap();
        assert_eq!(watch.changes(), [FileChange::Removed]);
        assert!(watch.watch(None));
    }
}
