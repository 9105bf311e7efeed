//! Building the second tree, with which the presented one is compared. It follows the first tree: its rail starts when that one
//! rests, and is given up with its thread and memory when there is no second tree.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use crate::accel::Accel;
use crate::app::shell::build_job::{BuildJob, BuildKey, BuiltTree};
use crate::app::shell::build_rail::BuildRail;
use crate::app::shell::file_watch::WatchedFile;
use crate::app::shell::present::{drop_in_background, remove_second_tree};
use crate::app::state::{AppState, JobStatus, Severity, TreeSide};
use crate::app::studies::latest::{Polled, report_panic};
use bvhscope_engine::builders::BuildError;

/// Builds the wanted second tree.
pub(crate) struct SecondRail {
    wake: Arc<dyn Fn() + Send + Sync>,
    build: Option<BuildRail>,
}

impl SecondRail {
    /// No tree yet; `wake` is called from the rail's thread after each result.
    pub(crate) fn new(wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        Self { wake, build: None }
    }

    /// Takes a finished tree.
    pub(crate) fn poll(&mut self, state: &mut AppState, moving: bool) {
        let Some(build) = &mut self.build else { return };
        match build.poll() {
            Polled::Running => {}
            Polled::Result(built) => match built.result {
                Ok(tree) => build.set_pending(tree, moving),
                Err(BuildError::Refused(reason)) => refuse(&reason, state),
                Err(BuildError::Cancelled(_)) => {}
            },
            Polled::Failed(panic) => {
                revert(state);
                if let Some(text) = panic {
                    report_panic(&mut state.messages, "Building tree B", &text);
                }
            }
        }
    }

    /// Requests the wanted second tree of the scene of the newest first tree: `pending`, or else the presented one. Drops one that
    /// is no longer wanted; returns whether it did.
    pub(crate) fn request(
        &mut self,
        state: &mut AppState,
        pending: Option<&Arc<Accel>>,
        moving: bool,
        now: Instant,
    ) -> bool {
        let Some(second) = state.wanted.second else {
            let gone = self.build.is_some();
            if let Some(mut build) = self.build.take() {
                build.stop();
                drop_in_background(build);
            }
            remove_second_tree(state);
            return gone;
        };
        let Some(presented) = &state.model.presented else { return false };
        // A new model shows its first tree first.
        if state.model.loaded.as_ref().is_none_or(|loaded| !loaded.is_same_model(&presented.accel.scene)) {
            return false;
        }
        let newest = pending.filter(|pending| pending.scene.is_same_model(&presented.accel.scene));
        let scene = Arc::clone(&newest.unwrap_or(&presented.accel).scene);
        let build = match &mut self.build {
            Some(build) => build,
            none => {
                let wake = Arc::clone(&self.wake);
                match BuildRail::new(move || wake()) {
                    Ok(build) => none.insert(build),
                    Err(error) => {
                        refuse(&format!("no thread could be started: {error}"), state);
                        return false;
                    }
                }
            }
        };
        let overlay = state.preferences.show_containers.then_some(state.wanted.overlay);
        let file = state.wanted.tree_file(TreeSide::B).map(Path::to_path_buf);
        let (revision, threads) = (build.revision(), state.wanted.threads);
        let (moment, unfolded) = (scene.moment, scene.unfolded.ranges.clone());
        let follow = state.wanted.follow_at(TreeSide::B, moment);
        let key = BuildKey { scene, moment, unfolded, follow, settings: second.build, file, revision, threads };
        let job = BuildJob { key, view: None, overlay, moving };
        if let Err(reason) = build.request(job, state.model.second.as_ref(), now) {
            refuse(&reason, state);
        }
        false
    }

    /// The tree to trace: the newest one that is built, if it is of the scene of `first`.
    pub(crate) fn newest(&self, first: &Accel, state: &AppState) -> Option<Arc<Accel>> {
        state.wanted.second?;
        let pending = self.build.as_ref().and_then(BuildRail::pending).map(|tree| &tree.accel);
        let newest = pending.or_else(|| state.model.second.as_ref().map(|shown| &shown.accel))?;
        newest.scene.is_same_pose(&first.scene).then(|| Arc::clone(newest))
    }

    /// Whether the first tree `pending` waits for a second one, to show a new moment of the model together.
    pub(crate) fn is_awaited(&self, pending: &Arc<Accel>, state: &AppState) -> bool {
        let is_moved = state.model.presented.as_ref().is_some_and(|shown| {
            let scene = &shown.accel.scene;
            scene.is_same_model(&pending.scene) && !scene.is_same_pose(&pending.scene)
        });
        is_moved && state.wanted.second.is_some() && self.newest(pending, state).is_none()
    }

    /// Takes the pending tree if it is `accel`.
    pub(crate) fn take_pending(&mut self, accel: &Arc<Accel>) -> Option<BuiltTree> {
        self.build.as_mut()?.take_pending(accel)
    }

    /// Notes that the pending tree was presented.
    pub(crate) fn note_presented(&mut self, now: Instant) {
        if let Some(build) = &mut self.build {
            let wait = build.note_presented(now);
            log::info!("presented tree B {} ms after it was wanted", wait.as_millis());
        }
    }

    /// The file of the tree, as it was before it was read.
    pub(crate) fn file(&self) -> Option<&WatchedFile> {
        self.build.as_ref().and_then(BuildRail::file)
    }

    /// Makes the tree stale, so that its file is read again.
    pub(crate) fn read_again(&mut self) {
        if let Some(build) = &mut self.build {
            build.read_again();
        }
    }

    /// Cancels building; the settings return to what is shown. Returns whether anything was being built.
    pub(crate) fn cancel(&mut self, state: &mut AppState) -> bool {
        let was_building = self.build.as_mut().is_some_and(BuildRail::stop);
        if was_building {
            revert(state);
        }
        was_building
    }

    /// When the job in flight was requested.
    pub(crate) fn since(&self) -> Option<Instant> {
        self.build.as_ref().and_then(BuildRail::since)
    }

    /// The job in flight, for the job strip.
    pub(crate) fn status(&self) -> Option<JobStatus> {
        self.build.as_ref().and_then(|build| build.status("Building tree B"))
    }
}

/// Reports why the second tree cannot be built. The one on the screen stays; where there is none, it is given up.
fn refuse(reason: &str, state: &mut AppState) {
    let remains = if kept_tree(state).is_some() { "its present tree stays" } else { "it is removed" };
    let text = match state.wanted.tree_file(TreeSide::B) {
        Some(_) => format!("Tree B cannot be read, and {remains}: {reason}"),
        None => format!("Tree B cannot be built, and {remains}: {reason}"),
    };
    state.messages.notify(Severity::Warning, text);
    revert(state);
}

/// The tree on the screen, unless the model has moved on.
fn kept_tree(state: &AppState) -> Option<Arc<Accel>> {
    let shown = state.model.second.as_ref().map(|shown| &shown.accel)?;
    (shown.scene.moment == state.wanted.moment).then(|| Arc::clone(shown))
}

/// Sets the wanted second tree to the one on the screen; none where there is none.
fn revert(state: &mut AppState) {
    let shown = kept_tree(state);
    let file = shown.as_ref().and_then(|accel| accel.file.as_ref()).map(|file| file.path.clone());
    state.wanted.second = state.wanted.second.zip(shown).map(|(mut second, accel)| {
        if accel.file.is_none() {
            second.build = accel.settings;
            second.policy = if accel.scene.moment.is_some() { accel.follow.policy } else { second.policy };
        }
        second
    });
    state.wanted.set_tree_file(TreeSide::B, file);
}
