//! Compares once a UI frame what is wanted with what is shown and what is in flight, and requests what is stale. Staleness is
//! a comparison, not a flag.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::app::state::{AppState, PROGRESS_DELAY, Severity};
use crate::app::work::build_job::{BuildJob, BuildKey, Built, BuiltTree, FirstView};
use crate::app::work::build_rail::BuildRail;
use crate::app::work::file_watch::WatchedFile;
use crate::app::work::in_flight::{Polled, report_panic};
use crate::app::work::load_rail::LoadRail;
use crate::app::work::motion::{Motion, REST_DELAY};
use crate::app::work::present::{present_frame, present_tree};
use crate::app::work::render_job::{RenderKey, Rendered};
use crate::app::work::render_rail::RenderRail;
use crate::render::Frame;
use crate::scene::{LoadOptions, SceneSource};
use crate::view::CameraChoice;
use crate::visibility::TriangleSet;
use bvhscope_engine::builders::BuildError;
use bvhscope_engine::settings::BuildSettings;

/// Interval between two updates of the progress bars.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(100);

/// The three rails from a model to a picture: load, build, render.
pub(crate) struct Reconciler {
    load: LoadRail,
    build: BuildRail,
    render: RenderRail,
    motion: Motion,
}

impl Reconciler {
    /// Starts the workers; `wake` is called from their threads after each result.
    pub(crate) fn new(wake: impl Fn() + Send + Sync + Clone + 'static) -> std::io::Result<Self> {
        Ok(Self {
            load: LoadRail::new(wake.clone())?,
            build: BuildRail::new(wake.clone())?,
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

    /// Sets whether each picture is traced to its end, as if the settings were always at rest: for tests, which thus see the
    /// same pictures each time.
    pub(crate) const fn set_always_at_rest(&mut self, always_at_rest: bool) {
        self.motion.set_disabled(always_at_rest);
        self.render.set_full_resolution(always_at_rest);
    }

    /// Makes `source` the wanted model; if it already is, it is read again. With `keep_camera` the present camera stays if the
    /// model is in its view.
    pub(crate) fn open(&mut self, source: SceneSource, keep_camera: bool, state: &mut AppState) {
        self.load.set_keep_camera(keep_camera);
        if state.wanted.source == source {
            self.load.reload();
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
        if self.build.stop() {
            self.revert_build(state);
            let remains = if state.model.presented.is_some() { ": the tree on the screen stays" } else { "" };
            state.messages.notify(Severity::Info, format!("Building cancelled{remains}"));
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

    /// The file of the newest loaded scene.
    pub(crate) const fn file(&self) -> Option<&WatchedFile> {
        self.load.file()
    }

    fn oldest_request(&self) -> Option<Instant> {
        [self.load.since(), self.build.since(), self.render.since()].into_iter().flatten().min()
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
        if let Some((key, rendered)) = self.render.poll(&mut state.messages, now) {
            self.take_picture(key, &rendered, state, now);
        }
        state.activity.mrays_per_s = self.render.mrays_per_s();
    }

    /// Requests whatever is stale. Returns the delay after which this is to be called again even if nothing arrives.
    pub(crate) fn reconcile(&mut self, state: &mut AppState, now: Instant) -> Option<Duration> {
        let moving = self.motion.observe(&state.wanted, now);
        self.load.request(&state.wanted.source, now);
        self.request_tree(state, moving, now);
        self.request_picture(state, moving, now);
        state.activity.load = self.load.status();
        state.activity.build = self.build.status();
        state.activity.render = self.render.status();
        if moving {
            return Some(REST_DELAY);
        }
        // The progress bars move. Short jobs show none, because drawing a UI frame takes time from them.
        let age = now.saturating_duration_since(self.oldest_request()?);
        Some(PROGRESS_DELAY.saturating_sub(age).max(PROGRESS_INTERVAL))
    }

    fn request_tree(&mut self, state: &mut AppState, moving: bool, now: Instant) {
        let Some(scene) = state.model.loaded.clone() else { return };
        let presented = state.model.presented.as_ref();
        if presented.is_none() && self.build.pending().is_none() && self.load.has_refused_loaded() {
            return;
        }
        let size_px = state.layout.viewport_px;
        // A tree of the presented scene comes with its first picture, so that both are presented in the same UI frame.
        let is_on_screen = presented.is_some_and(|presented| Arc::ptr_eq(&presented.accel.scene, &scene));
        let coarseness = self.render.first_coarseness(size_px).filter(|_| is_on_screen && !size_px.contains(&0));
        let view = coarseness.map(|coarseness| FirstView {
            camera: state.wanted.camera,
            settings: state.wanted.render,
            size_px,
            coarseness,
        });
        let overlay = state.preferences.show_containers.then_some(state.wanted.overlay);
        let key = BuildKey { scene, settings: state.wanted.build, threads: state.wanted.threads };
        if let Err(reason) = self.build.request(BuildJob { key, view, overlay, moving }, presented, now) {
            self.refuse_tree(&reason, state);
        }
    }

    fn request_picture(&mut self, state: &AppState, moving: bool, now: Instant) {
        let pending = self.build.pending();
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
        let stale = self.build.is_busy() && pending.is_none();
        // Nodes are hidden in the presented tree; the next one shows all.
        let hidden = if pending.is_some() { None } else { hidden_triangles(state) };
        let key = RenderKey { accel, camera, settings: state.wanted.render, size_px, hidden };
        self.render.request(key, state.wanted.threads, moving, stale, now);
    }

    fn take_tree(&mut self, built: Built, state: &mut AppState, now: Instant) {
        match built.result {
            Ok(tree) => {
                let is_loaded = state.model.loaded.as_ref().is_some_and(|scene| Arc::ptr_eq(scene, &built.key.scene));
                let fits = |rendered: &Rendered| {
                    let (key, wanted) = (&rendered.key, &state.wanted);
                    key.camera == wanted.camera
                        && key.settings == wanted.render
                        && key.size_px == state.layout.viewport_px
                        && key.hidden.is_none()
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
        self.present(tree, &rendered.frame, state, now);
        self.render.note_shown(rendered.key.clone(), &rendered);
    }

    fn take_picture(&mut self, key: RenderKey, rendered: &Rendered, state: &mut AppState, now: Instant) {
        if let Some(tree) = self.build.take_pending(&rendered.key.accel) {
            self.present(tree, &rendered.frame, state, now);
        } else if let Some(presented) = &mut state.model.presented
            && Arc::ptr_eq(&presented.accel, &rendered.key.accel)
        {
            let hides = rendered.key.hidden.is_some();
            present_frame(presented, &rendered.frame, self.render.next_frame_id(), hides);
        } else {
            return;
        }
        self.render.note_shown(key, rendered);
    }

    fn present(&mut self, tree: BuiltTree, frame: &Arc<Frame>, state: &mut AppState, now: Instant) {
        log::info!(
            "presented {} · δ {} · {} triangles · {} nodes · {} ms after it was wanted",
            tree.accel.scene.source.label(),
            tree.accel.settings.threshold,
            tree.accel.scene.triangles.len(),
            tree.accel.tree.node_count(),
            self.build.note_presented(now).as_millis()
        );
        let is_new_scene = present_tree(tree, frame, self.render.next_frame_id(), state);
        if is_new_scene {
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
        if shown.is_some_and(|(presented, scene)| Arc::ptr_eq(&presented.accel.scene, scene)) {
            let text = format!("This tree cannot be built: {reason}. The present tree stays");
            state.messages.notify(Severity::Warning, text);
            self.revert_build(state);
        } else {
            let text = format!("This tree cannot be built: {reason}. AAC builds it instead");
            state.messages.notify(Severity::Warning, text);
            state.wanted.build = BuildSettings { container: state.wanted.build.container, ..BuildSettings::default() };
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
        state.wanted.build = presented.accel.settings;
        state.wanted.threads = presented.threads;
        if state.model.loaded.as_ref().is_none_or(|loaded| !Arc::ptr_eq(loaded, &scene)) {
            state.wanted.source = scene.source.clone();
            self.load.return_to(&scene);
            self.build.discard_pending();
            state.model.loaded = Some(scene);
        }
    }
}

/// The triangles below hidden nodes of the presented tree, if the picture leaves them out.
fn hidden_triangles(state: &AppState) -> Option<Arc<TriangleSet>> {
    let presented = state.model.presented.as_ref().filter(|_| state.wanted.overlay.hide_triangles)?;
    let visibility = presented.table.visibility(&state.selection.nodes)?;
    Some(Arc::clone(&visibility.triangles)).filter(|triangles| !triangles.is_empty())
}
