//! Looks after the file of the shown model: tells when it was saved anew and when it is gone. Asks for its size and time from a
//! thread of its own, because a file on a network may keep it waiting; asking by name needs no special care for programs
//! that save by renaming, which notices from the system do.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime};

/// How often the file is looked at.
const EVERY: Duration = Duration::from_millis(250);
/// A file that looks the same for so long is finished.
const STEADY: Duration = Duration::from_millis(200);

/// What tells one content of a file from another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stamp {
    length: u64,
    modified: Option<SystemTime>,
}

impl Stamp {
    /// That of the file at `path`; `None` where there is none.
    pub fn of(path: &Path) -> Option<Self> {
        let metadata = std::fs::metadata(path).ok().filter(std::fs::Metadata::is_file)?;
        Some(Self { length: metadata.len(), modified: metadata.modified().ok() })
    }
}

/// What happened to the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum News {
    /// Its content is another one, and finished.
    Saved,
    /// There is no such file any more.
    Gone,
    /// It is there again as it was.
    Back,
}

/// Makes news of looks.
struct Follower {
    known: Stamp,
    /// What was seen last, and since when.
    seen: Option<(Option<Stamp>, Instant)>,
    gone: bool,
}

impl Follower {
    fn look(&mut self, stamp: Option<Stamp>, now: Instant) -> Option<News> {
        match self.seen {
            Some((seen, since)) if seen == stamp => {
                if now.duration_since(since) < STEADY {
                    return None;
                }
            }
            _ => {
                self.seen = Some((stamp, now));
                return None;
            }
        }
        let was_gone = std::mem::replace(&mut self.gone, stamp.is_none());
        match stamp {
            None => (!was_gone).then_some(News::Gone),
            Some(stamp) if stamp != self.known => {
                self.known = stamp;
                Some(News::Saved)
            }
            Some(_) => was_gone.then_some(News::Back),
        }
    }
}

/// Whom to follow.
#[derive(Default)]
struct Slot {
    file: Option<(PathBuf, Stamp)>,
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

/// Follows one file at a time.
pub struct FileWatch {
    shared: Arc<Shared>,
    news: Receiver<(PathBuf, News)>,
    file: Option<(PathBuf, Stamp)>,
}

impl FileWatch {
    /// Starts the thread; `wake` is called from it when there is news.
    pub fn new(wake: impl Fn() + Send + 'static) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let (sender, news) = channel();
        let theirs = Arc::clone(&shared);
        std::thread::Builder::new().name("file watch".to_owned()).spawn(move || run(&theirs, &sender, &wake))?;
        Ok(Self { shared, news, file: None })
    }

    /// Follows this file, which had this stamp before it was read. Says whether that is another one than before.
    pub fn follow(&mut self, file: Option<&(PathBuf, Stamp)>) -> bool {
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

    /// What happened to the file since the last question.
    pub fn news(&self) -> Vec<News> {
        let is_ours = |path: &PathBuf| self.file.as_ref().is_some_and(|(ours, _)| ours == path);
        self.news.try_iter().filter(|(path, _)| is_ours(path)).map(|(_, news)| news).collect()
    }
}

impl Drop for FileWatch {
    fn drop(&mut self) {
        // Nobody waits for the thread: its file may be on a network that does not answer.
        self.shared.lock().closed = true;
        self.shared.changed.notify_one();
    }
}

fn run(shared: &Shared, sender: &Sender<(PathBuf, News)>, wake: &dyn Fn()) {
    let mut following: Option<(PathBuf, Follower)> = None;
    loop {
        let mut slot = shared.lock();
        if !slot.changed && !slot.closed {
            slot = if following.is_some() {
                shared.changed.wait_timeout(slot, EVERY).unwrap_or_else(PoisonError::into_inner).0
            } else {
                shared.changed.wait(slot).unwrap_or_else(PoisonError::into_inner)
            };
        }
        if slot.closed {
            return;
        }
        if std::mem::take(&mut slot.changed) {
            following = slot.file.clone().map(|(path, known)| (path, Follower { known, seen: None, gone: false }));
        }
        drop(slot);
        let Some((path, follower)) = &mut following else { continue };
        if let Some(news) = follower.look(Stamp::of(path), Instant::now()) {
            if sender.send((path.clone(), news)).is_err() {
                return;
            }
            wake();
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_news_once_it_stays_as_it_is() {
        let stamp = |length| Some(Stamp { length, modified: None });
        let start = Instant::now();
        let mut follower = Follower { known: stamp(10).unwrap(), seen: None, gone: false };
        let mut at = 0;
        let mut look = |stamp| {
            at += 250;
            follower.look(stamp, start + Duration::from_millis(at))
        };
        assert_eq!([look(stamp(10)), look(stamp(10))], [None, None], "nothing happened");
        // Written bit by bit, then done.
        assert_eq!([look(stamp(3)), look(stamp(7)), look(stamp(12))], [None, None, None]);
        assert_eq!([look(stamp(12)), look(stamp(12))], [Some(News::Saved), None], "told once");
        // Deleted and written anew, as some editors save: not gone.
        assert_eq!([look(None), look(stamp(13)), look(stamp(13))], [None, None, Some(News::Saved)]);
        assert_eq!([look(None), look(None), look(None)], [None, Some(News::Gone), None]);
        assert_eq!([look(stamp(13)), look(stamp(13)), look(stamp(13))], [None, Some(News::Back), None]);
        assert_eq!([look(None), look(None)], [None, Some(News::Gone)]);
        assert_eq!([look(stamp(14)), look(stamp(14))], [None, Some(News::Saved)]);
    }

    #[test]
    fn the_thread_tells_of_a_file_that_was_renamed_into_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        std::fs::write(&path, "old").unwrap();
        let (woken, wakes) = channel();
        let mut watch = FileWatch::new(move || woken.send(()).unwrap()).unwrap();
        let file = (path.clone(), Stamp::of(&path).unwrap());
        assert!(watch.follow(Some(&file)) && !watch.follow(Some(&file)));
        std::fs::write(folder.path().join("a.tmp"), "newer").unwrap();
        std::fs::rename(folder.path().join("a.tmp"), &path).unwrap();
        wakes.recv_timeout(Duration::from_mins(1)).unwrap();
        assert_eq!(watch.news(), [News::Saved]);
        std::fs::remove_file(&path).unwrap();
        wakes.recv_timeout(Duration::from_mins(1)).unwrap();
        assert_eq!(watch.news(), [News::Gone]);
        assert!(watch.follow(None));
    }
}
