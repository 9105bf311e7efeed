//! Loading models: from a source to a scene.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use crate::app::shell::file_watch::WatchedFile;
use crate::app::shell::present::drop_in_background;
use crate::app::state::{AppState, JobStatus, Request, Severity, TreeSide, preferences};
use crate::app::studies::latest::{Latest, Polled, WorkerPool, report_panic};
use crate::app::viewport::orbit;
use crate::camera::Camera;
use crate::console::note;
use crate::scene::{CopyRanges, Instancing, LoadError, LoadOptions, Scene, SceneSource, is_tree_alone, load};
use crate::view::{CameraChoice, NamedView};
use crate::worker::Worker;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::follow::Policy;

/// The inputs of a loaded scene.
#[derive(Debug, Clone, PartialEq)]
struct LoadKey {
    source: SceneSource,
    /// The scene of the file; `None` for its default.
    scene: Option<usize>,
    /// Form of copies of meshes.
    instances: Instancing,
    /// Incremented when the user reads the same source again.
    generation: u64,
}

struct LoadJob {
    key: LoadKey,
    options: LoadOptions,
}

struct Loaded {
    key: LoadKey,
    /// The file as it was before it was read; `None` for built-in scenes.
    file: Option<WatchedFile>,
    result: Result<Arc<Scene>, LoadError>,
    /// There is no scene, because the file holds a tree alone.
    is_tree: bool,
}

/// Loads the wanted model.
pub(crate) struct LoadRail {
    latest: Latest<LoadKey, LoadJob, Loaded>,
    /// The key of the newest loaded scene.
    loaded: Option<LoadKey>,
    /// The file of the newest loaded scene, as it was before it was read.
    file: Option<WatchedFile>,
    generation: u64,
    options: LoadOptions,
    /// The next scene keeps the present camera if the scene is in its view.
    keep_camera: bool,
    /// The camera that the command line sets for the first scene.
    first_camera: Option<CameraChoice>,
    /// The camera of the newest loaded scene until that is presented.
    next_camera: Option<Camera>,
    /// The form of the copies of the next model; `None` for that of the options.
    next_form: Option<Instancing>,
    /// The model on the screen as it was loaded, until the newest one is presented.
    before: Option<Arc<Scene>>,
}

impl LoadRail {
    /// Starts the worker; `wake` is called from its thread after each result.
    pub(crate) fn new(wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Self> {
        Ok(Self {
            latest: Latest::new(start_worker(wake)?),
            loaded: None,
            file: None,
            generation: 0,
            options: LoadOptions::default(),
            keep_camera: false,
            first_camera: None,
            next_camera: None,
            next_form: None,
            before: None,
        })
    }

    /// Sets what loading may do, and the camera of the first scene.
    pub(crate) fn set_options(&mut self, options: LoadOptions, first_camera: Option<CameraChoice>) {
        self.options = options;
        self.first_camera = first_camera;
    }

    /// Sets the camera of the next scene.
    pub(crate) fn set_next_view(&mut self, camera: CameraChoice) {
        self.first_camera = Some(camera);
    }

    /// Sets the form of the copies of the next scene; `None` for that of the options.
    pub(crate) const fn set_next_form(&mut self, form: Option<Instancing>) {
        self.next_form = form;
    }

    /// Sets whether the next scene keeps the present camera if the scene is in its view.
    pub(crate) const fn set_keep_camera(&mut self, keep_camera: bool) {
        self.keep_camera = keep_camera;
    }

    /// Makes the loaded scene stale, so that its source is read again.
    pub(crate) fn reload(&mut self) {
        self.generation += 1;
        self.allow_retry();
    }

    /// True if the newest loaded scene is of `source`.
    pub(crate) fn has_loaded(&self, source: &SceneSource) -> bool {
        self.loaded.as_ref().is_some_and(|key| key.source == *source)
    }

    /// Allows a request for what failed or was cancelled.
    pub(crate) fn allow_retry(&mut self) {
        self.latest.refuse(None);
    }

    /// Requests the wanted model, the scene and the form of copies of `options`, unless it is loaded, in flight or refused.
    pub(crate) fn request(&mut self, source: &SceneSource, options: &LoadOptions, now: Instant) {
        // Scene and form were chosen for the model that is loaded.
        let is_loaded = self.loaded.as_ref().is_none_or(|loaded| loaded.source == *source);
        let chosen = (options.scene, options.instances);
        let (scene, instances) =
            if is_loaded { chosen } else { (None, self.next_form.unwrap_or(self.options.instances)) };
        let key = LoadKey { source: source.clone(), scene, instances, generation: self.generation };
        if self.loaded.as_ref() == Some(&key) {
            self.latest.stop();
        } else if ![self.latest.key(), self.latest.refused()].contains(&Some(&key)) {
            let job = LoadJob { key: key.clone(), options: LoadOptions { scene, instances, ..self.options.clone() } };
            self.latest.request(key, job, now);
        }
    }

    /// Takes a finished scene. Returns whether there was one.
    pub(crate) fn poll(&mut self, state: &mut AppState) -> bool {
        match self.latest.poll() {
            Polled::Running => false,
            Polled::Result(loaded) => {
                self.latest.finish(&loaded.key);
                match loaded.result {
                    Ok(scene) => {
                        self.adopt(loaded.key, loaded.file, scene, state);
                        true
                    }
                    Err(_) if loaded.is_tree && state.model.presented.is_some() => {
                        // A tree of the present model.
                        let path = loaded.key.source.path().map(Path::to_path_buf);
                        self.revert(state);
                        state.activity.requests.extend(path.map(|path| Request::OpenTree(state.edited_side(), path)));
                        false
                    }
                    Err(error) => {
                        self.report_failure(loaded.key, &error, state);
                        false
                    }
                }
            }
            Polled::Failed(panic) => {
                if let Some(text) = panic {
                    self.revert(state);
                    report_panic(&mut state.messages, "Loading", &text);
                }
                false
            }
        }
    }

    fn adopt(&mut self, key: LoadKey, file: Option<WatchedFile>, scene: Arc<Scene>, state: &mut AppState) {
        preferences::remember(&mut state.preferences.recent, &scene.source);
        state.messages.forget_errors();
        let present = state.wanted.camera.shifted(state.move_to_offset(scene.offset));
        let before = self.loaded.as_ref().filter(|before| before.source == key.source);
        let is_loaded = before.is_some();
        // In another form it is the same model.
        let is_same = before.is_some_and(|before| before.scene == key.scene && before.instances != key.instances);
        let keep = (self.keep_camera || is_same) && orbit::still_sees(&present, &scene.bounds);
        self.next_camera = Some(match self.first_camera.take() {
            Some(choice) => choice.camera(&scene),
            None if keep => present,
            None => NamedView::Default.camera_in(&scene, scene.up, state.layout.aspect()),
        });
        (self.keep_camera, self.next_form) = (false, None);
        state.model.load_options.scene = key.scene;
        if !is_loaded {
            state.model.load_options.instances = key.instances;
        }
        // A tree file with its triangles is model and tree in one, until another tree of the model is chosen; one of two levels has no tree
        // of the flat scene.
        let path = scene.source.path().map(Path::to_path_buf);
        let is_new = |loaded: &LoadKey| loaded.source != key.source || loaded.instances != key.instances;
        if scene.has_tree && self.loaded.as_ref().is_none_or(is_new) {
            state.wanted.tree_files[0] = state.wanted.tree_files[0].take().or(path);
        } else if !scene.has_tree && path.is_some() && state.wanted.tree_files[0] == path {
            state.wanted.tree_files[0] = None;
        }
        self.loaded = Some(key);
        self.file = file;
        adopt_moment(&scene, state);
        let old = state.model.loaded.replace(scene);
        if self.before.is_none() {
            self.before = old;
        } else {
            drop_in_background(old);
        }
    }

    fn report_failure(&mut self, key: LoadKey, error: &LoadError, state: &mut AppState) {
        note(format_args!("error: {error}"));
        let remains = if state.model.presented.is_some() { ". The present scene stays" } else { "" };
        state.messages.notify(Severity::Error, format!("{error}{remains}"));
        self.latest.refuse(Some(key));
        self.revert(state);
        if state.model.presented.is_none() && state.model.loaded.is_none() {
            // There is no scene to fall back on but a built-in one.
            state.wanted.source = SceneSource::default_builtin();
        }
    }

    /// Cancels loading and returns to the loaded model. Returns whether anything was being loaded.
    pub(crate) fn cancel(&mut self, state: &mut AppState) -> bool {
        let was_loading = self.latest.cancel();
        if was_loading {
            self.revert(state);
        }
        was_loading
    }

    /// Sets the wanted model to the loaded one. Where none is loaded, it stays as it is and is not requested again.
    fn revert(&mut self, state: &mut AppState) {
        if let Some(scene) = &state.model.loaded {
            state.wanted.source = scene.source.clone();
            state.model.load_options.scene = self.loaded.as_ref().and_then(|key| key.scene);
            state.model.load_options.instances =
                self.loaded.as_ref().map_or_else(Instancing::default, |key| key.instances);
            self.generation = self.loaded.as_ref().map_or(self.generation, |key| key.generation);
            let shown = state.model.presented.as_ref().map(|shown| &shown.accel.scene);
            let shown = shown.filter(|shown| shown.is_same_model(scene));
            state.wanted.moment = shown.and_then(|shown| shown.moment);
            state.wanted.unfolded = shown.map_or_else(CopyRanges::default, |shown| shown.unfolded.ranges.clone());
        }
    }

    /// Returns to the model of `scene`, which was loaded before the newest one, and wants it.
    pub(crate) fn return_to(&mut self, scene: &Arc<Scene>, state: &mut AppState) {
        let before = self.before.take().filter(|before| before.is_same_model(scene));
        drop_in_background(state.model.loaded.replace(before.unwrap_or_else(|| Arc::clone(scene))));
        state.wanted.source = scene.source.clone();
        state.move_to_offset(scene.offset);
        state.model.load_options.scene = (scene.scene_names.len() > 1).then_some(scene.shown_scene);
        if scene.repeats_meshes {
            let is_two_level = scene.copies.is_some();
            state.model.load_options.instances = if is_two_level { Instancing::TwoLevel } else { Instancing::Flat };
        }
        let LoadOptions { scene, instances, .. } = state.model.load_options;
        let source = state.wanted.source.clone();
        self.loaded = Some(LoadKey { source, scene, instances, generation: self.generation });
        self.next_camera = None;
    }

    /// Refuses the loaded model: its first tree was cancelled, and there is no other model to return to.
    pub(crate) fn refuse_loaded(&mut self) {
        self.latest.refuse(self.loaded.clone());
    }

    /// Whether the loaded model was refused by [`LoadRail::refuse_loaded`] and no other one is being loaded.
    pub(crate) fn has_refused_loaded(&self) -> bool {
        !self.latest.is_busy() && self.loaded.is_some() && self.latest.refused() == self.loaded.as_ref()
    }

    /// The camera of the newest loaded scene, while that has not been presented.
    pub(crate) const fn next_camera(&self) -> Option<Camera> {
        self.next_camera
    }

    /// Forgets the camera of [`LoadRail::next_camera`], because its scene is presented. Returns whether there was one.
    pub(crate) fn take_next_camera(&mut self) -> bool {
        drop_in_background(self.before.take());
        self.next_camera.take().is_some()
    }

    /// The file of the newest loaded scene, as it was before it was read.
    pub(crate) const fn file(&self) -> Option<&WatchedFile> {
        self.file.as_ref()
    }

    /// When the job in flight was requested.
    pub(crate) fn since(&self) -> Option<Instant> {
        self.latest.since()
    }

    /// The job in flight, for the job strip.
    pub(crate) fn status(&self) -> Option<JobStatus> {
        self.latest.status(format!("Loading {}", self.latest.key()?.source.label()))
    }
}

/// Keeps the wanted moment where the model has its clip, and the policies where a tree can follow the model.
fn adopt_moment(scene: &Scene, state: &mut AppState) {
    if scene.motion.as_ref().is_some_and(|motion| !motion.keeps_triangles()) {
        for side in TreeSide::ALL {
            *state.wanted.policy_mut(side) = Policy::Rebuild;
        }
    }
    let wanted = state.wanted.moment;
    state.wanted.moment = scene.motion.as_ref().zip(wanted).and_then(|(motion, wanted)| motion.within(wanted));
    if wanted.is_some() && state.wanted.moment.is_none() {
        state.model.playback.playing = false;
        let text = "The model has no such clip: it is shown in the pose of its file";
        state.messages.notify(Severity::Warning, text);
    }
}

fn start_worker(wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Worker<LoadJob, Loaded>> {
    let pool = WorkerPool::default();
    Worker::new("load", wake, move |job: LoadJob, token: &CancelToken, _| {
        let file = job.key.source.path().and_then(WatchedFile::of);
        match pool.run("load", 0, || load(&job.key.source, &job.options, token)) {
            Err(LoadError::Cancelled(_)) => None,
            result => {
                let is_tree = result.is_err() && job.key.source.path().is_some_and(is_tree_alone);
                Some(Loaded { key: job.key, file, result: result.map(Arc::new), is_tree })
            }
        }
    })
}
