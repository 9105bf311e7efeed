//! Three rails: load, build, render. Once a UI frame what is wanted is compared with what is shown and what is on its way,
//! and the first stale product of each rail is asked for. Staleness is a comparison, not a flag.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::app::state::{AppState, JobStatus, PROGRESS_DELAY, Presented, Severity, Wanted};
use crate::app::work::file_watch::Stamp;
use crate::app::work::frame_pacing::FramePacing;
use crate::app::work::jobs::{
    BuildJob, BuildKey, Built, BuiltTree, FirstView, LoadJob, LoadKey, Loaded, RenderJob, RenderKey, Rendered,
    build_worker, load_worker, render_worker,
};
use crate::camera::Camera;
use crate::scene::LoadOptions;
use crate::view::CameraChoice;
use crate::worker::Worker;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::BuildSettings;

/// Nothing has changed for this long: everything rests, and the picture is refined.
const REST: Duration = Duration::from_millis(160);

/// Pixels along each side that share a ray, at least, while the wide tree is missing: few enough rays for the binary one.
const BEFORE_WIDE: u32 = 3;

/// Work that was asked for and has not come back.
pub(crate) struct InFlight<K> {
    pub key: K,
    pub token: CancelToken,
    pub since: Instant,
    /// A single coarse pass: soon over, so that it is better awaited than cancelled.
    pub brief: bool,
}

/// What the screen shows, and how good it is.
pub(crate) struct Shown {
    pub key: RenderKey,
    pub complete: bool,
}

/// The workers, and what the app remembers about their products.
pub struct Rails {
    pub(crate) load: Worker<LoadJob, Loaded>,
    pub(crate) build: Worker<BuildJob, Built>,
    pub(crate) render: Worker<RenderJob, Rendered>,
    pub(crate) loading: Option<InFlight<LoadKey>>,
    pub(crate) building: Option<InFlight<BuildKey>>,
    /// What is built after that.
    pub(crate) queued: Option<InFlight<BuildKey>>,
    pub(crate) rendering: Option<InFlight<RenderKey>>,
    /// The key of the newest loaded scene.
    pub(crate) loaded: Option<LoadKey>,
    /// The file that was last read, as it was before.
    pub(crate) read_file: Option<(PathBuf, Stamp)>,
    /// How often the user asked to read the model again.
    pub(crate) generation: u64,
    /// Files outside a model's folder may be read.
    pub load_options: LoadOptions,
    /// Not asked for again until something else is wanted: they failed or were cancelled.
    pub(crate) refused_load: Option<LoadKey>,
    pub(crate) refused_render: Option<RenderKey>,
    /// A tree without a picture yet.
    pub(crate) pending: Option<BuiltTree>,
    /// Since when the tree on the screen is not the wanted one.
    pub(crate) tree_wanted_at: Option<Instant>,
    /// The camera of a scene that is not presented yet.
    pub(crate) next_camera: Option<Camera>,
    /// The next scene keeps the camera if that still sees it.
    pub keep_camera: bool,
    /// The camera that the command line asks for, for the first scene.
    pub camera_choice: Option<CameraChoice>,
    pub(crate) shown: Option<Shown>,
    pub(crate) frame_pacing: FramePacing,
    pub(crate) frames: u64,
    watched: Option<Wanted>,
    changed_at: Option<Instant>,
    /// Nothing ever counts as moving: each picture is traced to its end, so that tests see the same each time.
    pub at_rest: bool,
}

impl Rails {
    /// Starts the workers; `wake` is called from their threads whenever there is news.
    pub fn new(wake: impl Fn() + Send + Sync + Clone + 'static) -> std::io::Result<Self> {
        Ok(Self {
            load: load_worker(wake.clone())?,
            build: build_worker(wake.clone())?,
            render: render_worker(wake)?,
            loading: None,
            building: None,
            queued: None,
            rendering: None,
            loaded: None,
            read_file: None,
            generation: 0,
            load_options: LoadOptions::default(),
            refused_load: None,
            refused_render: None,
            pending: None,
            tree_wanted_at: None,
            next_camera: None,
            keep_camera: false,
            camera_choice: None,
            shown: None,
            frame_pacing: FramePacing::default(),
            frames: 0,
            watched: None,
            changed_at: None,
            at_rest: false,
        })
    }

    /// Asks for whatever is stale. Returns after what time to look again although nothing arrives.
    pub fn reconcile(&mut self, state: &mut AppState, now: Instant) -> Option<Duration> {
        let moving = self.watch(&state.wanted, now);
        self.ask_for_scene(state, now);
        self.ask_for_tree(state, moving, now);
        self.ask_for_picture(state, moving, now);
        self.tell_jobs(state);
        if moving {
            Some(REST)
        } else if let Some(oldest) = self.busy_since() {
            // The progress bars move, but what is soon over gets none: drawing them costs time as well.
            let age = now.saturating_duration_since(oldest);
            Some(PROGRESS_DELAY.saturating_sub(age).max(Duration::from_millis(100)))
        } else {
            None
        }
    }

    /// When the oldest of what is on its way was asked for.
    fn busy_since(&self) -> Option<Instant> {
        let loading = self.loading.as_ref().map(|job| job.since);
        let building = self.building.as_ref().map(|job| job.since);
        let rendering = self.rendering.as_ref().map(|job| job.since);
        [loading, building, rendering].into_iter().flatten().min()
    }

    /// Whether anything is on its way.
    pub fn is_busy(&self) -> bool {
        self.loading.is_some() || self.building.is_some() || self.rendering.is_some()
    }

    /// Reads the model again although it has the same name.
    pub fn reload(&mut self) {
        self.generation += 1;
        self.refused_load = None;
    }

    /// What failed or was cancelled may be asked for again.
    pub(crate) fn allow_again(&mut self) {
        self.refused_load = None;
        self.refused_render = None;
    }

    /// Stops everything that runs; the settings return to what is shown.
    pub fn cancel(&mut self, state: &mut AppState) {
        if let Some(job) = self.loading.take() {
            self.load.cancel();
            self.refused_load = Some(job.key);
            self.revert_source(state);
            state.messages.notify(Severity::Info, "Loading cancelled");
        }
        if self.stop_building() {
            self.revert_build(state);
            let stays = if state.model.presented.is_some() { ": the tree on the screen stays" } else { "" };
            state.messages.notify(Severity::Info, format!("Building cancelled{stays}"));
        }
        if let Some(job) = self.rendering.take() {
            self.render.cancel();
            self.refused_render = Some(job.key);
        }
    }

    /// The wanted model becomes the one that is shown. With nothing shown the wish stays, but is not tried again.
    pub(crate) fn revert_source(&mut self, state: &mut AppState) {
        if let Some(scene) = &state.model.loaded {
            state.wanted.source = scene.source.clone();
            self.generation = self.loaded.as_ref().map_or(self.generation, |(_, generation)| *generation);
        }
    }

    /// The wanted tree becomes the one that is shown; where the shown one belongs to another scene, the default one.
    pub(crate) fn revert_build(&mut self, state: &mut AppState) {
        match (&state.model.presented, &state.model.loaded) {
            (Some(presented), Some(scene)) if Arc::ptr_eq(&presented.accel.scene, scene) => {
                state.wanted.build = presented.accel.settings;
                state.wanted.threads = presented.threads;
            }
            (Some(presented), _) => {
                // The new scene is given up with its tree.
                let scene = Arc::clone(&presented.accel.scene);
                state.wanted.source = scene.source.clone();
                state.wanted.build = presented.accel.settings;
                state.wanted.threads = presented.threads;
                self.loaded = Some((scene.source.clone(), self.generation));
                self.next_camera = None;
                self.pending = None;
                state.model.loaded = Some(scene);
            }
            (None, _) => self.refused_load.clone_from(&self.loaded),
        }
    }

    /// Whether something that decides the picture changed a moment ago.
    fn watch(&mut self, wanted: &Wanted, now: Instant) -> bool {
        let same = self.watched.as_ref().is_some_and(|seen| {
            seen.camera == wanted.camera && seen.build == wanted.build && seen.render == wanted.render
        });
        if !same {
            if self.watched.is_some() {
                self.changed_at = Some(now);
            }
            self.watched = Some(wanted.clone());
        }
        self.is_moving(now)
    }

    pub(crate) fn is_moving(&self, now: Instant) -> bool {
        !self.at_rest && self.changed_at.is_some_and(|then| now.duration_since(then) < REST)
    }

    /// Whether trees are built one after the other while a slider moves.
    pub fn rebuilds_under_a_hand(&self, now: Instant) -> bool {
        self.building.is_some() && self.is_moving(now)
    }

    fn ask_for_scene(&mut self, state: &mut AppState, now: Instant) {
        let key = (state.wanted.source.clone(), self.generation);
        if self.loaded.as_ref() == Some(&key) {
            if self.loading.take().is_some() {
                self.load.cancel();
            }
            return;
        }
        let on_its_way = self.loading.as_ref().is_some_and(|job| job.key == key);
        if on_its_way || self.refused_load.as_ref() == Some(&key) {
            return;
        }
        let token = self.load.request(LoadJob { key: key.clone(), options: self.load_options.clone() });
        self.loading = Some(InFlight { key, token, since: now, brief: false });
    }

    fn ask_for_tree(&mut self, state: &mut AppState, moving: bool, now: Instant) {
        let Some(scene) = state.model.loaded.clone() else { return };
        if state.model.presented.is_none()
            && self.pending.is_none()
            && self.refused_load.is_some()
            && self.loading.is_none()
        {
            // The very first build was cancelled.
            if self.refused_load == self.loaded {
                return;
            }
        }
        let key = BuildKey { scene, settings: state.wanted.build, threads: state.wanted.threads };
        if self.has_tree(state, &key) {
            if self.pending.is_none() {
                self.tree_wanted_at = None;
            }
            // A slider that passes over the tree on the screen goes on from there.
            if !moving {
                self.stop_building();
            }
            return;
        }
        let refusal = key.settings.refusal(key.scene.triangles.len());
        if let Some(job) = &self.building {
            let same_scene = Arc::ptr_eq(&job.key.scene, &key.scene);
            // While the slider moves, a started build may finish: otherwise no tree would ever be shown. The newest follows.
            if job.key == key || (moving && same_scene) {
                let newest = self.queued.as_ref().unwrap_or(job);
                if newest.key != key && refusal.is_none() {
                    let token = self.build.queue(self.build_job(state, &key, moving));
                    self.queued = Some(InFlight { key, token, since: now, brief: false });
                }
                return;
            }
        }
        if let Some(why) = refusal {
            self.refuse_tree(state, &why);
            return;
        }
        self.tree_wanted_at.get_or_insert(now);
        let token = self.build.request(self.build_job(state, &key, moving));
        self.queued = None;
        self.building = Some(InFlight { key, token, since: now, brief: false });
    }

    /// Gives up what is built. Returns whether anything was.
    pub(crate) fn stop_building(&mut self) -> bool {
        self.queued = None;
        let builds = self.building.take().is_some();
        if builds {
            self.build.cancel();
        }
        builds
    }

    /// A tree of the scene on the screen comes with its first picture, so that no UI frame stands between the two.
    fn build_job(&self, state: &AppState, key: &BuildKey, moving: bool) -> BuildJob {
        let on_screen =
            state.model.presented.as_ref().is_some_and(|presented| Arc::ptr_eq(&presented.accel.scene, &key.scene));
        let size_px = state.layout.viewport_px;
        let view = (on_screen && !self.at_rest && !size_px.contains(&0)).then(|| FirstView {
            camera: state.wanted.camera,
            settings: state.wanted.render,
            size_px,
            coarseness: self.frame_pacing.coarseness(size_px).max(BEFORE_WIDE),
        });
        let overlay = state.preferences.show_containers.then_some(state.wanted.overlay);
        BuildJob { key: key.clone(), view, overlay, moving }
    }

    /// Whether the newest tree is the wanted one.
    fn has_tree(&self, state: &AppState, key: &BuildKey) -> bool {
        let newest = match (&self.pending, &state.model.presented) {
            (Some(pending), _) => Some((&pending.accel, pending.threads)),
            (None, Some(presented)) => Some((&presented.accel, presented.threads)),
            (None, None) => None,
        };
        newest.is_some_and(|(accel, threads)| {
            *key == BuildKey { scene: Arc::clone(&accel.scene), settings: accel.settings, threads }
        })
    }

    /// Says why a tree cannot be built. A scene on the screen keeps its tree; a new scene gets the default one.
    pub(crate) fn refuse_tree(&mut self, state: &mut AppState, why: &str) {
        let shown = state.model.presented.as_ref().zip(state.model.loaded.as_ref());
        if shown.is_some_and(|(presented, scene)| Arc::ptr_eq(&presented.accel.scene, scene)) {
            state
                .messages
                .notify(Severity::Warning, format!("This tree cannot be built: {why}. The present tree stays"));
            self.revert_build(state);
        } else {
            state
                .messages
                .notify(Severity::Warning, format!("This tree cannot be built: {why}. AAC builds it instead"));
            state.wanted.build = BuildSettings { container: state.wanted.build.container, ..BuildSettings::default() };
        }
    }

    fn ask_for_picture(&mut self, state: &mut AppState, moving: bool, now: Instant) {
        let accel = match (&self.pending, &state.model.presented) {
            (Some(pending), _) => Arc::clone(&pending.accel),
            (None, Some(presented)) => Arc::clone(&presented.accel),
            (None, None) => return,
        };
        if state.layout.viewport_px.contains(&0) {
            return;
        }
        let camera = self.next_camera.filter(|_| self.pending.is_some()).unwrap_or(state.wanted.camera);
        let key = RenderKey { accel, camera, settings: state.wanted.render, size_px: state.layout.viewport_px };
        // The first picture of a tree is traced before the wide tree is there.
        let coarsest = if key.accel.known_wide().is_none() { BEFORE_WIDE } else { 1 };
        let coarseness = if self.at_rest { 1 } else { self.frame_pacing.coarseness(key.size_px).max(coarsest) };
        let shown = self.shown.as_ref().filter(|shown| shown.key == key);
        if shown.is_some_and(|shown| shown.complete || moving) || self.refused_render.as_ref() == Some(&key) {
            return;
        }
        if self.building.is_some() && self.pending.is_none() && shown.is_some() {
            // The picture of the old tree is refined no further: the new one wants the cores.
            if self.rendering.take_if(|job| !job.brief).is_some() {
                self.render.cancel();
            }
            return;
        }
        if let Some(job) = &self.rendering
            && (job.key == key || job.brief)
        {
            return;
        }
        let passes = match shown {
            _ if moving => vec![coarseness],
            None if coarseness > 1 => vec![coarseness, 1],
            _ => vec![1],
        };
        let mut job_key = key.clone();
        if moving {
            job_key.settings.samples = 1;
        }
        let brief = moving;
        let token = self.render.request(RenderJob {
            key: job_key,
            passes,
            threads: state.wanted.threads,
            count_tests: !moving,
        });
        self.refused_render = None;
        self.rendering = Some(InFlight { key, token, since: now, brief });
    }

    /// Fills in the job strip.
    fn tell_jobs(&self, state: &mut AppState) {
        let status = |label: String, token: &CancelToken, since| JobStatus { label, progress: token.progress(), since };
        state.activity.load =
            self.loading.as_ref().map(|job| status(format!("Loading {}", job.key.0.label()), &job.token, job.since));
        state.activity.build = self.building.as_ref().map(|job| status("Building".to_owned(), &job.token, job.since));
        state.activity.render = self.rendering.as_ref().map(|job| status("Tracing".to_owned(), &job.token, job.since));
    }

    /// The tree and picture that are on the screen, as the panels see them.
    pub(crate) fn present(&mut self, tree: BuiltTree, rendered: &Rendered, state: &mut AppState) {
        self.frames += 1;
        let old = state.model.presented.replace(Presented {
            accel: tree.accel,
            table: tree.table,
            frame: Arc::clone(&rendered.frame),
            frame_id: self.frames,
            tests_per_ray: rendered.frame.stats.tests_per_ray(),
            threads: tree.threads,
        });
        drop_elsewhere(old);
    }
}

/// Drops `value` on another thread: giving back the hundreds of megabytes of a tree takes longer than a UI frame may.
pub(crate) fn drop_elsewhere(value: impl Send + 'static) {
    // Where no thread can be started, the value is dropped here, along with the work that nobody takes.
    let _ = std::thread::Builder::new().name("drop".to_owned()).spawn(move || drop(value));
}
