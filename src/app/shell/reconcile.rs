//! Compares once a UI frame what is wanted with what is shown and what is in flight, and requests what is stale. Staleness is
//! a comparison, not a flag.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::accel::{Follow, are_same};
use crate::app::shell::build_job::{BuildJob, BuildKey, Built, BuiltTree, FirstView, hidden_triangles};
use crate::app::shell::build_rail::BuildRail;
use crate::app::shell::file_watch::WatchedFile;
use crate::app::shell::frame_pacing::{Motion, REST_DELAY};
use crate::app::shell::load_rail::LoadRail;
use crate::app::shell::present::{present_difference, present_frame, present_second_tree, present_tree};
use crate::app::shell::render_job::{RenderKey, Rendered};
use crate::app::shell::render_rail::RenderRail;
use crate::app::shell::second_rail::SecondRail;
use crate::app::state::{AppState, HiddenNodes, JobStatus, Severity, TreeSide};
use crate::app::studies::latest::{Polled, report_panic};
use crate::scene::{Instancing, LoadOptions, Scene, SceneSource};
use crate::view::CameraChoice;
use crate::visibility::TriangleSet;
use bvhscope_engine::builders::BuildError;
use bvhscope_engine::settings::{BuildSettings, Pass};
use bvhscope_engine::tree::ContainerKind;

/// The rails from a model to a picture: load, build, render; and one that builds the second tree.
pub(crate) struct Reconciler {
    load: LoadRail,
    build: BuildRail,
    second: SecondRail,
    render: RenderRail,
    motion: Motion,
}

impl Reconciler {
    /// Starts the workers; `wake` is called from their threads after each result.
    pub(crate) fn new(wake: impl Fn() + Send + Sync + Clone + 'static) -> std::io::Result<Self> {
        Ok(Self {
            load: LoadRail::new(wake.clone())?,
            build: BuildRail::new(wake.clone())?,
            second: SecondRail::new(Arc::new(wake.clone())),
            render: RenderRail::new(wake)?,
            motion: Motion::default(),
        })
    }

    /// Sets what loading may do, the camera of the first scene, and whether that scene keeps the present camera if it is in
    /// its view.
    pub(crate) fn set_load_options(
        &mut self,
        options: LoadOptions,
        first_camera: Option<CameraChoice>,
        keep_camera: bool,
    ) {
        self.load.set_options(options, first_camera);
        self.load.set_keep_camera(keep_camera);
    }

    /// Sets the camera of the next scene.
    pub(crate) fn set_next_view(&mut self, camera: CameraChoice) {
        self.load.set_next_view(camera);
    }

    /// Sets whether each picture is traced to its end, as if the settings were always at rest: for tests, which thus see the
    /// same pictures each time.
    pub(crate) const fn set_always_at_rest(&mut self, always_at_rest: bool) {
        self.motion.set_disabled(always_at_rest);
        self.render.set_full_resolution(always_at_rest);
    }

    /// Sets the form of the copies of the next scene, unless that is the one of the command line.
    pub(crate) fn set_next_form(&mut self, form: Instancing) {
        self.load.set_next_form((form != Instancing::Auto).then_some(form));
    }

    /// Makes `source` the wanted model; if it already is, it is read again. With `keep_camera` the present camera stays if the
    /// model is in its view.
    pub(crate) fn open(&mut self, source: SceneSource, keep_camera: bool, state: &mut AppState) {
        self.load.set_keep_camera(keep_camera);
        self.load.set_next_form(None);
        if state.wanted.source == source {
            self.load.reload();
        } else {
            state.wanted.tree_files = [None, None];
            state.wanted.ray_file = None;
            state.wanted.stand_still();
            state.model.playback.playing = false;
        }
        self.load.allow_retry();
        self.render.allow_retry();
        state.wanted.source = source;
    }

    /// Reads the wanted model again and keeps the camera.
    pub(crate) fn reload(&mut self) {
        self.load.set_keep_camera(true);
        self.load.reload();
    }

    /// Cancels everything in flight; the settings return to what is shown.
    pub(crate) fn cancel(&mut self, state: &mut AppState) {
        if self.load.cancel(state) {
            state.messages.notify(Severity::Info, "Loading cancelled");
        }
        let was_waiting = self.awaits_second(state);
        if self.build.stop() || was_waiting {
            if was_waiting {
                self.build.discard_pending();
            }
            self.revert_build(state);
            let remains = if state.model.presented.is_some() { ": the tree on the screen stays" } else { "" };
            state.messages.notify(Severity::Info, format!("Building cancelled{remains}"));
        }
        if self.second.cancel(state) {
            state.messages.notify(Severity::Info, "Building tree B cancelled");
        }
        self.render.cancel();
    }

    /// Whether anything is in flight.
    pub(crate) fn is_busy(&self) -> bool {
        self.oldest_request().is_some()
    }

    /// Whether a tree is being built while the settings are changing.
    pub(crate) fn is_rebuilding_in_motion(&self, now: Instant) -> bool {
        self.build.is_busy() && self.motion.is_moving(now)
    }

    /// Whether a single coarse picture is being traced, soon to be shown.
    pub(crate) fn is_following_motion(&self) -> bool {
        self.render.is_single_pass()
    }

    /// The file of the newest loaded scene.
    pub(crate) const fn file(&self) -> Option<&WatchedFile> {
        self.load.file()
    }

    /// The file of a tree, as it was before it was read.
    pub(crate) fn tree_file(&self, side: TreeSide) -> Option<&WatchedFile> {
        match side {
            TreeSide::A => self.build.file(),
            TreeSide::B => self.second.file(),
        }
    }

    /// Reads a tree from its file again.
    pub(crate) fn read_tree_again(&mut self, side: TreeSide) {
        match side {
            TreeSide::A => self.build.read_again(),
            TreeSide::B => self.second.read_again(),
        }
    }

    /// Whether the pending first tree waits for a second one of the same moment.
    fn awaits_second(&self, state: &AppState) -> bool {
        self.build.pending().is_some_and(|pending| self.second.is_awaited(&pending.accel, state))
    }

    fn oldest_request(&self) -> Option<Instant> {
        [self.load.since(), self.build.since(), self.second.since(), self.render.since()].into_iter().flatten().min()
    }

    /// Takes finished products and presents those that are still wanted. Never blocks.
    pub(crate) fn poll(&mut self, state: &mut AppState, now: Instant) {
        if self.load.poll(state) {
            self.build.discard_pending();
        }
        match self.build.poll() {
            Polled::Running => {}
            Polled::Result(built) => self.take_tree(built, state, now),
            Polled::Failed(panic) => {
                self.revert_build(state);
                if let Some(text) = panic {
                    report_panic(&mut state.messages, "Building", &text);
                }
            }
        }
        let moving = self.motion.is_moving(now);
        self.second.poll(state, moving);
        if let Some((key, rendered)) = self.render.poll(&mut state.messages, now) {
            self.take_picture(key, &rendered, state, now);
        }
        state.activity.mrays_per_s = self.render.mrays_per_s();
    }

    /// Requests whatever is stale. Returns the delay after which this is to be called again even if nothing arrives.
    pub(crate) fn reconcile(&mut self, state: &mut AppState, now: Instant) -> Option<Duration> {
        let moving = self.motion.observe(state, now);
        self.load.request(&state.wanted.source, &state.model.load_options, now);
        // A file that holds a tree of the model to come is none of the present one.
        let awaits_model = !self.load.has_loaded(&state.wanted.source);
        let awaits = |side: TreeSide| awaits_model && state.wanted.tree_file(side).is_some();
        let [awaits_first, awaits_second] = [TreeSide::A, TreeSide::B].map(awaits);
        if !awaits_first {
            self.request_tree(state, moving, now);
        }
        // The first tree comes first: both are built on the same cores.
        if !awaits_second && (!self.build.is_busy() || state.wanted.second.is_none()) {
            let pending = self.build.pending().map(|tree| &tree.accel);
            if self.second.request(state, pending, moving, now) {
                self.render.forget_second();
            }
        }
        self.request_picture(state, moving, now);
        state.activity.load = self.load.status();
        state.activity.build = self.build.status("Building").or_else(|| self.second.status());
        state.activity.render = self.render.status();
        if moving {
            return Some(REST_DELAY);
        }
        if !self.build.is_busy() {
            state.report_missing_hidden();
        }
        Some(JobStatus::next_update(self.oldest_request()?, now))
    }

    fn request_tree(&mut self, state: &mut AppState, moving: bool, now: Instant) {
        let Some(scene) = state.model.loaded.clone() else { return };
        let presented = state.model.presented.as_ref();
        if presented.is_none() && self.build.pending().is_none() && self.load.has_refused_loaded() {
            return;
        }
        if self.awaits_second(state) {
            return;
        }
        let size_px = state.layout.viewport_px;
        // A tree of the presented model comes with its first picture, so that both are presented in the same UI frame.
        let shown = presented.map(|presented| &presented.accel.scene).filter(|shown| shown.is_same_model(&scene));
        let is_on_screen = shown.is_some();
        let moment = scene.motion.as_ref().zip(state.wanted.moment).and_then(|(motion, moment)| motion.within(moment));
        // While there are two trees, both are traced in the same passes instead.
        let is_alone = is_on_screen && state.wanted.second.is_none();
        let coarseness = self.render.first_coarseness(size_px).filter(|_| is_alone && !size_px.contains(&0));
        let view = coarseness.map(|coarseness| FirstView {
            camera: state.wanted.camera,
            settings: state.wanted.render,
            size_px,
            coarseness,
            adaptation: self.render.adaptation_at(&scene, moment, &state.wanted.camera, &state.wanted.render),
            hidden: nodes_to_leave_out(state),
            clusters: state.cluster_cut(None),
        });
        let overlay = state.preferences.show_containers.then_some(state.wanted.overlay);
        let file = state.wanted.tree_file(TreeSide::A).map(Path::to_path_buf);
        let (revision, threads) = (self.build.revision(), state.wanted.threads);
        let mut settings = state.wanted.build;
        if !is_on_screen || state.model.playback.playing {
            // Annealing takes minutes: a new model is seen with its tree as it is before that, and so is one that plays.
            settings.optimize = settings.optimize.without(Pass::Anneal);
        }
        let unfolded = scene.copies_among(&state.wanted.unfolded);
        let is_as_shown = |shown: &&Arc<Scene>| shown.moment == moment && shown.unfolded.ranges == unfolded;
        let scene = shown.filter(is_as_shown).map_or(scene.clone(), Arc::clone);
        let follow = state.wanted.follow_at(TreeSide::A, moment);
        let key = BuildKey { scene, moment, unfolded, follow, settings, file, revision, threads };
        if let Err(reason) = self.build.request(BuildJob { key, view, overlay, moving }, presented, now) {
            self.refuse_tree(&reason, state);
        }
    }

    fn request_picture(&mut self, state: &AppState, moving: bool, now: Instant) {
        let pending = self.build.pending().filter(|_| !self.awaits_second(state));
        let accel = match (pending, &state.model.presented) {
            (Some(pending), _) => Arc::clone(&pending.accel),
            (None, Some(presented)) => Arc::clone(&presented.accel),
            (None, None) => return,
        };
        let size_px = state.layout.viewport_px;
        if size_px.contains(&0) {
            return;
        }
        let camera = self.load.next_camera().filter(|_| pending.is_some()).unwrap_or(state.wanted.camera);
        // Annealing takes minutes, on one thread.
        let anneals = state.wanted.build.annealing_rounds().is_some();
        let stale = self.build.is_busy() && pending.is_none() && !anneals;
        let hidden = match pending {
            Some(tree) => hidden_in(tree, state),
            None => state.hidden_triangles(),
        };
        let second = self.second.newest(&accel, state);
        let difference = second.is_some() && state.wanted.shows_difference();
        let (settings, clusters) = (state.wanted.traced(), state.cluster_cut(Some(&accel)));
        let layout = state.counted_layout(&accel);
        let key = RenderKey { accel, camera, settings, size_px, hidden, clusters, layout, second, difference };
        self.render.request(key, state.wanted.threads, moving, stale, now);
    }

    fn take_tree(&mut self, built: Built, state: &mut AppState, now: Instant) {
        match built.result {
            Ok(tree) => {
                let is_loaded = state.model.loaded.as_ref().is_some_and(|scene| scene.is_same_model(&built.key.scene));
                let fits = |rendered: &Rendered| {
                    let (key, wanted) = (&rendered.key, &state.wanted);
                    key.camera == wanted.camera
                        && key.settings == wanted.render
                        && key.size_px == state.layout.viewport_px
                        && key.clusters == state.cluster_cut(None)
                        && are_same(key.hidden.as_ref(), hidden_in(&tree, state).as_ref())
                };
                match built.picture.filter(fits) {
                    _ if !is_loaded => {}
                    Some(rendered) => self.present_with_picture(tree, rendered, state, now),
                    None => self.build.set_pending(tree, self.motion.is_moving(now)),
                }
            }
            Err(BuildError::Refused(reason)) => self.refuse_tree(&reason, state),
            Err(BuildError::Cancelled(_)) => {}
        }
    }

    /// Presents a tree at once with the coarse picture that it came with.
    fn present_with_picture(&mut self, tree: BuiltTree, rendered: Rendered, state: &mut AppState, now: Instant) {
        self.render.stop();
        self.build.discard_pending();
        self.render.measure(&rendered.frame, now);
        self.present(tree, &rendered, state, now);
        self.render.note_shown(rendered.key.clone(), &rendered, now);
    }

    fn take_picture(&mut self, key: RenderKey, rendered: &Rendered, state: &mut AppState, now: Instant) {
        if let Some(tree) = self.build.take_pending(&rendered.key.accel) {
            self.present(tree, rendered, state, now);
        } else if let Some(presented) = &mut state.model.presented
            && Arc::ptr_eq(&presented.accel, &rendered.key.accel)
        {
            let hides = rendered.key.hidden.is_some();
            present_frame(presented, &rendered.frame, self.render.next_frame_id(), hides);
        } else {
            return;
        }
        self.take_second_picture(rendered, state, now);
        self.render.note_shown(key, rendered, now);
    }

    /// Presents the picture through the second tree and the difference, which belong to the picture that was just presented.
    fn take_second_picture(&mut self, rendered: &Rendered, state: &mut AppState, now: Instant) {
        let Some((accel, frame)) = rendered.key.second.as_ref().zip(rendered.second.as_ref()) else { return };
        let hides = rendered.key.hidden.is_some();
        let frame_id = self.render.next_frame_id();
        if let Some(tree) = self.second.take_pending(accel) {
            present_second_tree(tree, frame, hides, frame_id, state);
            self.second.note_presented(now);
        } else if let Some(second) = state.model.second.as_mut().filter(|second| Arc::ptr_eq(&second.accel, accel)) {
            present_frame(second, frame, frame_id, hides);
        } else {
            return;
        }
        match &rendered.difference {
            Some(map) => present_difference(map, self.render.next_frame_id(), state),
            // Not needed in this view; the next difference is made of the next pictures.
            None if !rendered.key.difference => state.model.difference = None,
            None => {}
        }
    }

    fn present(&mut self, tree: BuiltTree, rendered: &Rendered, state: &mut AppState, now: Instant) {
        let (frame, hides) = (&rendered.frame, rendered.key.hidden.is_some());
        log::info!(
            "presented {} · δ {} · {} triangles · {} nodes · {} ms after it was wanted",
            tree.accel.scene.source.label(),
            tree.accel.settings.threshold,
            tree.accel.scene.triangles.len(),
            tree.accel.tree.node_count(),
            self.build.note_presented(now).as_millis()
        );
        let is_new_model = present_tree(tree, frame, hides, self.render.next_frame_id(), state);
        if is_new_model {
            self.render.reset_pacing();
            if self.load.take_next_camera() {
                state.wanted.camera = frame.camera;
            }
            state.undo.settle(&state.wanted);
        }
    }

    /// Reports why a tree cannot be built. A presented scene keeps its tree; a new scene gets the default one.
    fn refuse_tree(&mut self, reason: &str, state: &mut AppState) {
        let shown = state.model.presented.as_ref().zip(state.model.loaded.as_ref());
        if state.wanted.tree_file(TreeSide::A).is_some() {
            let is_shown = shown.is_some_and(|(presented, scene)| presented.accel.scene.is_same_model(scene));
            let remains = if is_shown { "The present tree stays" } else { "AAC builds one instead" };
            state.messages.notify(Severity::Error, format!("{reason}. {remains}"));
            if is_shown {
                self.revert_build(state);
            } else {
                state.wanted.set_tree_file(TreeSide::A, None);
            }
        } else if shown.is_some_and(|(presented, scene)| presented.accel.scene.is_same_model(scene)) {
            let text = format!("This tree cannot be built: {reason}. The present tree stays");
            state.messages.notify(Severity::Warning, text);
            self.revert_build(state);
        } else {
            let text = format!("This tree cannot be built: {reason}. AAC builds it instead");
            state.messages.notify(Severity::Warning, text);
            let has_copies = state.model.loaded.as_ref().is_some_and(|scene| scene.copies.is_some());
            let container = if has_copies { ContainerKind::Aabb } else { state.wanted.build.container };
            state.wanted.build = BuildSettings { container, ..BuildSettings::default() };
            (state.wanted.moment, state.wanted.follow) = (None, Follow::default());
        }
    }

    /// Sets the wanted tree to the presented one. Where that belongs to another scene than the loaded one, the loaded scene is
    /// given up with its tree.
    fn revert_build(&mut self, state: &mut AppState) {
        let Some(presented) = &state.model.presented else {
            self.load.refuse_loaded();
            return;
        };
        let scene = Arc::clone(&presented.accel.scene);
        let file = presented.accel.file.as_ref().map(|file| file.path.clone());
        if file.is_none() {
            state.wanted.build = presented.accel.settings;
        }
        state.wanted.set_tree_file(TreeSide::A, file);
        state.wanted.threads = presented.threads;
        state.wanted.moment = scene.moment;
        state.wanted.unfolded = scene.unfolded.ranges.clone();
        if scene.moment.is_some() {
            state.wanted.follow.policy = presented.accel.follow.policy;
        }
        state.model.playback.playing = false;
        if state.model.loaded.as_ref().is_none_or(|loaded| !loaded.is_same_model(&scene)) {
            self.build.discard_pending();
            self.load.return_to(&scene, state);
        }
    }
}

/// The triangles that will be hidden in `tree` once it is presented, if the picture leaves them out.
fn hidden_in(tree: &BuiltTree, state: &AppState) -> Option<Arc<TriangleSet>> {
    let presented = state.model.presented.as_ref()?;
    if presented.accel.scene.is_same_model(&tree.accel.scene) {
        hidden_triangles(&tree.accel, &tree.table, &mut nodes_to_leave_out(state))
    } else {
        None
    }
}

/// The hidden nodes, if the picture leaves their triangles out.
fn nodes_to_leave_out(state: &AppState) -> HiddenNodes {
    if state.wanted.overlay.hide_triangles { state.selection.hidden.clone() } else { HiddenNodes::default() }
}
