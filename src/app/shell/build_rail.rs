//! Building trees: requests the wanted tree and holds a built one until it has a picture.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::accel::{Accel, Follow};
use crate::app::shell::build_job::{BuildJob, BuildKey, Built, BuiltTree, start_worker};
use crate::app::shell::file_watch::WatchedFile;
use crate::app::shell::present::drop_in_background;
use crate::app::state::{JobStatus, Presented};
use crate::app::studies::latest::{Latest, Polled};

/// Builds the wanted tree.
pub(crate) struct BuildRail {
    latest: Latest<BuildKey, BuildJob, Built>,
    /// A tree that has no picture yet.
    pending: Option<BuiltTree>,
    /// The file of the newest tree, as it was before it was read.
    file: Option<WatchedFile>,
    /// Number of times that the file was seen to change.
    revision: u32,
    /// The revision that the newest tree was read from, or whose reading was given up.
    read_revision: u32,
    /// Since when the presented tree differs from the wanted one.
    stale_since: Option<Instant>,
}

impl BuildRail {
    /// Starts the worker; `wake` is called from its thread after each result.
    pub(crate) fn new(wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Self> {
        Ok(Self {
            latest: Latest::new(start_worker(wake)?),
            pending: None,
            file: None,
            revision: 0,
            read_revision: 0,
            stale_since: None,
        })
    }

    /// Requests a tree unless it is built or in flight. While the settings are changing, a tree in flight is finished
    /// first, because otherwise none would ever be shown; the newest request follows.
    ///
    /// # Errors
    ///
    /// Returns the reason where the settings do not suit the scene.
    pub(crate) fn request(&mut self, job: BuildJob, presented: Option<&Presented>, now: Instant) -> Result<(), String> {
        let BuildJob { ref key, moving, .. } = job;
        if self.has_built(key, presented) {
            if self.pending.is_none() {
                self.stale_since = None;
            }
            // A slider that passes over the presented tree's setting is about to leave it again.
            if !moving {
                self.stop();
            }
            return Ok(());
        }
        let refusal = match key.file {
            None => Follow::refusal(key.follow.policy, &key.settings, &key.scene),
            Some(_) => None,
        };
        if let Some(current) = self.latest.key() {
            let same_model = current.scene.is_same_model(&key.scene);
            if current == key || (moving && same_model) {
                if self.latest.newest() != Some(key) && refusal.is_none() {
                    self.latest.queue(key.clone(), job, now);
                }
                return Ok(());
            }
        }
        if let Some(reason) = refusal {
            return Err(reason);
        }
        self.stale_since.get_or_insert(now);
        self.latest.request(key.clone(), job, now);
        Ok(())
    }

    /// Whether the newest tree, pending or presented, has the inputs `key`.
    fn has_built(&self, key: &BuildKey, presented: Option<&Presented>) -> bool {
        let newest = match (&self.pending, presented) {
            (Some(pending), _) => Some((&pending.accel, pending.threads)),
            (None, Some(presented)) => Some((&presented.accel, presented.threads)),
            (None, None) => None,
        };
        newest.is_some_and(|(accel, threads)| {
            let file = accel.file.as_ref().map(|file| file.path.clone());
            let (scene, moment, revision) = (Arc::clone(&accel.scene), accel.scene.moment, self.read_revision);
            let (unfolded, follow, settings) = (scene.unfolded.ranges.clone(), accel.follow, accel.settings);
            *key == BuildKey { scene, moment, unfolded, follow, settings, file, revision, threads }
        })
    }

    /// Takes the newest outcome of the job in flight. A job that failed is no longer in flight.
    pub(crate) fn poll(&mut self) -> Polled<Built> {
        let polled = self.latest.poll();
        match &polled {
            Polled::Running => {}
            Polled::Result(built) => {
                self.latest.finish(&built.key);
                self.file.clone_from(&built.file);
                self.read_revision = built.key.revision;
            }
            Polled::Failed(_) => self.read_revision = self.revision,
        }
        polled
    }

    /// The file of the newest tree, as it was before it was read.
    pub(crate) const fn file(&self) -> Option<&WatchedFile> {
        self.file.as_ref()
    }

    /// Number of times that the file was seen to change.
    pub(crate) const fn revision(&self) -> u32 {
        self.revision
    }

    /// Makes the tree stale, so that its file is read again.
    pub(crate) const fn read_again(&mut self) {
        self.revision += 1;
    }

    /// Cancels building. Returns whether anything was being built.
    pub(crate) fn stop(&mut self) -> bool {
        self.read_revision = self.revision;
        self.latest.stop().is_some()
    }

    /// Holds `tree` until it has a picture.
    pub(crate) fn set_pending(&mut self, tree: BuiltTree, moving: bool) {
        if self.pending.is_some() && moving {
            // If each tree replaced the one that is being traced, no picture would ever be finished.
            drop_in_background(tree);
        } else {
            drop_in_background(self.pending.replace(tree));
        }
    }

    /// The tree that has no picture yet.
    pub(crate) const fn pending(&self) -> Option<&BuiltTree> {
        self.pending.as_ref()
    }

    /// Takes the pending tree if it is `accel`.
    pub(crate) fn take_pending(&mut self, accel: &Arc<Accel>) -> Option<BuiltTree> {
        self.pending.take_if(|tree| Arc::ptr_eq(&tree.accel, accel))
    }

    /// Discards the pending tree.
    pub(crate) fn discard_pending(&mut self) {
        if let Some(tree) = self.pending.take() {
            drop_in_background(tree);
        }
    }

    /// Notes that a tree is presented. Returns the time since it became wanted; 0 where that is unknown.
    pub(crate) fn note_presented(&mut self, now: Instant) -> Duration {
        let next = self.since();
        std::mem::replace(&mut self.stale_since, next).map_or(Duration::ZERO, |since| now.duration_since(since))
    }

    /// Whether a tree is being built.
    pub(crate) const fn is_busy(&self) -> bool {
        self.latest.is_busy()
    }

    /// When the job in flight was requested.
    pub(crate) fn since(&self) -> Option<Instant> {
        self.latest.since()
    }

    /// The job in flight, for the job strip, with what it does in words.
    pub(crate) fn status(&self, label: &str) -> Option<JobStatus> {
        self.latest.status(label)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a failure here is a failed test")]
mod tests {
    use bvhscope_engine::settings::BuildSettings;

    use super::*;
    use crate::app::shell::build_job::BuildJob;
    use crate::scene::{CopyRanges, LoadOptions, SceneSource, load};
    use bvhscope_engine::cancel::CancelToken;

    /// Waits for the tree that was requested.
    fn built(rail: &mut BuildRail) -> BuiltTree {
        let give_up = Instant::now() + Duration::from_mins(2);
        loop {
            match rail.poll() {
                Polled::Result(built) => return built.result.unwrap(),
                Polled::Failed(panic) => unreachable!("{panic:?}"),
                Polled::Running => assert!(rail.is_busy() && Instant::now() < give_up, "no tree"),
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn reading_a_file_again_is_not_given_up_for_the_tree_that_it_held_before() {
        let source = SceneSource::default_builtin();
        let scene = Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap());
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bvh");
        let tree = Accel::build(&scene, &BuildSettings::default(), &CancelToken::new()).unwrap();
        let mut bytes = Vec::new();
        let header = tree.file_header(false);
        bvhscope_engine::tree_file::write_tree(&tree.tree, &header, None, &mut bytes, &CancelToken::new()).unwrap();
        std::fs::write(&path, bytes).unwrap();

        let mut rail = BuildRail::new(|| {}).unwrap();
        let request = |rail: &mut BuildRail| {
            let (scene, file) = (Arc::clone(&scene), Some(path.clone()));
            let settings = BuildSettings::default();
            let key = BuildKey {
                scene,
                moment: None,
                unfolded: CopyRanges::default(),
                follow: Follow::default(),
                settings,
                file,
                revision: rail.revision(),
                threads: 0,
            };
            rail.request(BuildJob { key, view: None, overlay: None, moving: false }, None, Instant::now()).unwrap();
        };
        request(&mut rail);
        let first = built(&mut rail);
        rail.set_pending(first, false);
        request(&mut rail);
        assert!(!rail.is_busy(), "it was read");
        rail.read_again();
        // In each UI frame until the file is read.
        for _ in 0..3 {
            request(&mut rail);
            assert!(rail.is_busy());
        }
        let second = built(&mut rail);
        rail.set_pending(second, false);
        request(&mut rail);
        assert!(!rail.is_busy(), "once");
        // A cancelled request is not tried again by itself.
        rail.read_again();
        request(&mut rail);
        assert!(rail.stop());
        request(&mut rail);
        assert!(!rail.is_busy());
    }
}
