//! What the worker threads for models, trees and pictures do: from a request to a product that remembers what it was made from.

use std::cell::RefCell;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::accel::{Accel, BuildSession};
use crate::app::work::file_watch::Stamp;
use crate::camera::Camera;
use crate::lab::available_threads;
use crate::overlay::{NodeTable, OverlaySettings};
use crate::render::{Frame, RenderRequest, RenderSettings, render};
use crate::scene::{LoadError, LoadOptions, Scene, SceneSource, load};
use crate::worker::Worker;
use bvhscope_engine::builders::BuildError;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::settings::BuildSettings;

/// So long after a tree its first picture is on the screen, and a hand that rests is known to rest.
const FIRST_PICTURE: Duration = Duration::from_millis(170);

/// Which model is asked for: the source and how often it was read again.
pub type LoadKey = (SceneSource, u64);

/// Read a model.
pub struct LoadJob {
    /// Which.
    pub key: LoadKey,
    /// What it may read.
    pub options: LoadOptions,
}

/// A model was read or was unusable.
pub struct Loaded {
    /// What was asked for.
    pub key: LoadKey,
    /// The file as it was before it was read, where it was one.
    pub file: Option<(PathBuf, Stamp)>,
    /// What came of it.
    pub result: Result<Arc<Scene>, LoadError>,
}

/// What a tree was made from.
#[derive(Clone)]
pub struct BuildKey {
    /// The scene, compared by identity.
    pub scene: Arc<Scene>,
    /// How it is built.
    pub settings: BuildSettings,
    /// With how many threads; 0 for all.
    pub threads: usize,
}

impl PartialEq for BuildKey {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.scene, &other.scene) && self.settings == other.settings && self.threads == other.threads
    }
}

/// Build a tree, and trace its first picture, which is on the screen as soon as the tree is there.
pub struct BuildJob {
    /// What is built.
    pub key: BuildKey,
    /// From where it is seen first, if that is known.
    pub view: Option<FirstView>,
    /// The containers that are seen first, if any.
    pub overlay: Option<OverlaySettings>,
    /// Something else may be wanted by the time it is there: what only a resting picture needs waits.
    pub moving: bool,
}

/// The coarse picture that a new tree is seen in first.
#[derive(Clone, Copy)]
pub struct FirstView {
    /// From where.
    pub camera: Camera,
    /// How.
    pub settings: RenderSettings,
    /// Width and height in pixels.
    pub size_px: [u32; 2],
    /// How many pixels share a ray, along each side.
    pub coarseness: u32,
}

/// A tree with everything that the window derives from it once.
#[derive(Clone)]
pub struct BuiltTree {
    /// The tree.
    pub accel: Arc<Accel>,
    /// Its nodes for the overlay.
    pub table: Arc<NodeTable>,
    /// The thread count that was asked for.
    pub threads: usize,
}

/// A tree was built or refused.
pub struct Built {
    /// What was asked for.
    pub key: BuildKey,
    /// What came of it.
    pub result: Result<BuiltTree, BuildError>,
    /// Its first picture, if one was asked for.
    pub picture: Option<Rendered>,
}

/// What a picture was made from.
#[derive(Clone)]
pub struct RenderKey {
    /// The tree, compared by identity.
    pub accel: Arc<Accel>,
    /// From where.
    pub camera: Camera,
    /// How.
    pub settings: RenderSettings,
    /// Width and height in pixels.
    pub size_px: [u32; 2],
}

impl PartialEq for RenderKey {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.accel, &other.accel)
            && self.camera == other.camera
            && self.settings == other.settings
            && self.size_px == other.size_px
    }
}

/// Trace a picture, coarsest pass first.
pub struct RenderJob {
    /// What is seen.
    pub key: RenderKey,
    /// The passes: how many pixels share a ray, along each side.
    pub passes: Vec<u32>,
    /// With how many threads; 0 for all.
    pub threads: usize,
    /// Tests a ray are counted once the picture has its full resolution.
    pub count_tests: bool,
}

/// A picture on the way or finished.
pub struct Rendered {
    /// What was asked for.
    pub key: RenderKey,
    /// The picture.
    pub frame: Arc<Frame>,
    /// Nothing more comes of this job.
    pub last: bool,
}

/// A pool of the wanted number of threads, kept until another number is wanted.
#[derive(Default)]
pub(crate) struct Pool {
    current: RefCell<Option<(usize, Arc<ThreadPool>)>>,
}

impl Pool {
    /// Runs `work` in a pool of `threads` threads (0 for all), or of as many as the system gives.
    pub(crate) fn run<R: Send>(&self, name: &'static str, threads: usize, work: impl FnOnce() -> R + Send) -> R {
        let mut current = self.current.borrow_mut();
        if current.as_ref().is_none_or(|(count, _)| *count != threads) {
            let named = || ThreadPoolBuilder::new().thread_name(move |i| format!("{name} {i}"));
            let built = match named().num_threads(threads).build() {
                Ok(pool) => Some(pool),
                Err(error) => fewer_threads(named, threads, &error),
            };
            // Where this thread itself has become a pool, it stays the only one.
            if let Some(pool) = built {
                *current = Some((threads, Arc::new(pool)));
            }
        }
        let pool = current.as_ref().map(|(_, pool)| Arc::clone(pool));
        drop(current);
        match pool {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }
}

/// A pool of fewer threads than those `wanted`, which were refused; the calling thread alone where there is no other.
fn fewer_threads(
    named: impl Fn() -> ThreadPoolBuilder,
    wanted: usize,
    refusal: &rayon::ThreadPoolBuildError,
) -> Option<ThreadPool> {
    let wanted = if wanted == 0 { available_threads() } else { wanted };
    let halves = std::iter::successors(Some(wanted / 2), |fewer| Some(fewer / 2)).take_while(|&fewer| fewer > 0);
    let pool = halves
        .map(|fewer| named().num_threads(fewer).build())
        .find_map(Result::ok)
        .or_else(|| named().num_threads(1).use_current_thread().build().ok());
    let threads = pool.as_ref().map_or(1, ThreadPool::current_num_threads);
    log::warn!("{wanted} threads cannot be started ({refusal}); working with {threads}");
    pool
}

/// The thread that reads models.
pub fn load_worker(wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Worker<LoadJob, Loaded>> {
    let pool = Pool::default();
    Worker::new("load", wake, move |job: LoadJob, token: &CancelToken, _| {
        let file = job.key.0.path().and_then(|path| Some((path.to_owned(), Stamp::of(path)?)));
        match pool.run("load", 0, || load(&job.key.0, &job.options, token)) {
            Err(LoadError::Cancelled(_)) => None,
            result => Some(Loaded { key: job.key, file, result: result.map(Arc::new) }),
        }
    })
}

/// The thread that builds trees and what is derived from them.
pub fn build_worker(wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Worker<BuildJob, Built>> {
    let (pool, session) = (Pool::default(), RefCell::new(BuildSession::default()));
    Worker::new("build", wake, move |job: BuildJob, token: &CancelToken, deliver: &(dyn Fn(Built) + Sync)| {
        let BuildJob { key, view, overlay, moving } = job;
        let (threads, start) = (key.threads, Instant::now());
        let mut session = session.borrow_mut();
        let session: &mut BuildSession = &mut session;
        let result = pool.run("build", threads, || {
            // The first picture of a tree is coarse and traced through the binary one: it does not wait for the wide one.
            let accel = Arc::new(Accel::build_with_session(&key.scene, &key.settings, Some(&mut *session), token)?);
            let table = Arc::new(NodeTable::new(&accel));
            if let Some(overlay) = &overlay {
                table.list(Some(overlay), token)?;
            }
            let listed = start.elapsed();
            let picture = view.map(|view| first_picture(&accel, &view, token)).transpose()?;
            log::debug!(
                "δ {}: tree built in {:.1?}, listed after {listed:.1?}, traced after {:.1?}",
                key.settings.threshold,
                accel.report.build_time,
                start.elapsed()
            );
            Ok((BuiltTree { accel, table, threads }, picture))
        });
        match result {
            Err(BuildError::Cancelled(_)) => {}
            Err(refused) => deliver(Built { key, result: Err(refused), picture: None }),
            Ok((tree, picture)) => {
                let (accel, table) = (Arc::clone(&tree.accel), Arc::clone(&tree.table));
                deliver(Built { key, result: Ok(tree), picture });
                if moving {
                    pause(token);
                }
                let Ok(wide) = pool.run("build", threads, || accel.widen(token)) else { return None };
                log::debug!("collapsed in {:.1?}, after {:.1?}", wide.collapse_time, start.elapsed());
                // What only panels and clicks ask for is computed once the picture has had the cores.
                pause(token);
                if !token.is_cancelled() {
                    // No other build follows at once.
                    *session = BuildSession::default();
                    // Whoever cancels does without.
                    let _ = pool.run("build", threads, || accel.study(token).and_then(|()| table.list(None, token)));
                }
            }
        }
        None
    })
}

/// Leaves the cores to pictures, or to what is wanted instead.
fn pause(token: &CancelToken) {
    let over = Instant::now() + FIRST_PICTURE;
    while Instant::now() < over && !token.is_cancelled() {
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Traces `accel` as `view` says.
fn first_picture(accel: &Arc<Accel>, view: &FirstView, token: &CancelToken) -> Result<Rendered, Cancelled> {
    let FirstView { camera, settings, size_px, coarseness } = *view;
    let request = RenderRequest {
        accel: Arc::clone(accel),
        camera,
        settings,
        width_px: size_px[0],
        height_px: size_px[1],
        coarseness,
        count_tests: false,
    };
    let frame = Arc::new(render(&request, token, &|_| {})?);
    Ok(Rendered { key: RenderKey { accel: Arc::clone(accel), camera, settings, size_px }, frame, last: false })
}

/// The thread that traces pictures.
pub fn render_worker(wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Worker<RenderJob, Rendered>> {
    let pool = Pool::default();
    Worker::new("render", wake, move |job: RenderJob, token: &CancelToken, deliver: &(dyn Fn(Rendered) + Sync)| {
        let RenderJob { key, passes, threads, count_tests } = job;
        let part = |frame: Frame, last: bool| Rendered { key: key.clone(), frame: Arc::new(frame), last };
        let mut newest = None;
        for coarseness in passes {
            if let Some(frame) = newest.take() {
                deliver(part(frame, false));
            }
            let request = RenderRequest {
                accel: Arc::clone(&key.accel),
                camera: key.camera,
                settings: key.settings,
                width_px: key.size_px[0],
                height_px: key.size_px[1],
                coarseness,
                count_tests,
            };
            let frame = pool.run("render", threads, || render(&request, token, &|frame| deliver(part(frame, false))));
            newest = Some(frame.ok()?);
        }
        newest.map(|frame| part(frame, true))
    })
}
