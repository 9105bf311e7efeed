//! Building trees on a worker thread: from a scene to a tree, its overlay table and, where requested, its first picture.

use std::cell::RefCell;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::accel::followed::FollowSession;
use crate::accel::{Accel, BuildSession, Follow};
use crate::app::shell::file_watch::WatchedFile;
use crate::app::shell::render_job::{RenderKey, Rendered};
use crate::app::state::HiddenNodes;
use crate::app::studies::latest::WorkerPool;
use crate::camera::Camera;
use crate::overlay::{NodeTable, OverlaySettings, Selection};
use crate::render::cluster_cut::ClusterCut;
use crate::render::{Adaptation, RenderSettings};
use crate::scene::{CopyRanges, LoadError, Moment, Scene};
use crate::visibility::TriangleSet;
use crate::worker::Worker;
use bvhscope_engine::builders::BuildError;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::follow::Policy;
use bvhscope_engine::settings::{BuildSettings, Pass};

/// Delay after a tree is delivered, so that its first frame is shown, and the end of a drag noticed, before background work
/// takes the cores.
const BACKGROUND_DELAY: Duration = Duration::from_millis(170);

/// Interval between two checks for cancellation during [`BACKGROUND_DELAY`].
const CANCEL_POLL: Duration = Duration::from_millis(5);

/// The inputs of a tree.
#[derive(Clone)]
pub(crate) struct BuildKey {
    /// A scene of the model, compared by model: it is moved where its moment is another, and so are copies unfolded.
    pub scene: Arc<Scene>,
    /// The moment of a model that moves.
    pub moment: Option<Moment>,
    /// The copies below which the tree goes on in their meshes.
    pub unfolded: CopyRanges,
    /// How the tree of a moment follows the model, unless a file holds it.
    pub follow: Follow,
    /// How the tree is built, unless a file holds it.
    pub settings: BuildSettings,
    /// The file that holds the tree.
    pub file: Option<PathBuf>,
    /// Number of times that the file was seen to change.
    pub revision: u32,
    /// Number of threads; 0 for all.
    pub threads: usize,
}

impl PartialEq for BuildKey {
    fn eq(&self, other: &Self) -> bool {
        let same_tree = match (&self.file, &other.file) {
            (None, None) => self.settings == other.settings && self.follow == other.follow,
            (file, of_other) => {
                file == of_other && self.revision == other.revision && self.orients() == other.orients()
            }
        };
        self.scene.is_same_model(&other.scene)
            && self.moment == other.moment
            && self.unfolded == other.unfolded
            && same_tree
            && self.threads == other.threads
    }
}

impl BuildKey {
    /// True if a tree that is read gets oriented boxes: the one setting that it has.
    fn orients(&self) -> bool {
        self.settings.optimize.contains(Pass::Orient)
    }

    /// Builds the tree, or reads it.
    fn tree(&self, sessions: &mut Sessions, token: &CancelToken) -> Result<Accel, BuildError> {
        let scene = self.moved(token)?;
        match &self.file {
            None if self.follow.policy != Policy::Rebuild => {
                sessions.build = BuildSession::default();
                Accel::follow(&scene, &self.settings, self.follow, &mut sessions.follow, token)
            }
            None => {
                sessions.follow = FollowSession::default();
                Accel::build_with_session(&scene, &self.settings, Some(&mut sessions.build), token)
            }
            Some(path) => Ok(Accel::read(&scene, path, self.settings.optimize, token)?),
        }
    }

    /// The scene at the moment, with its unfolded copies.
    fn moved(&self, token: &CancelToken) -> Result<Arc<Scene>, LoadError> {
        let scene = match self.moment.filter(|_| self.scene.moment != self.moment) {
            Some(moment) => Arc::new(self.scene.at(moment, token)?),
            None => Arc::clone(&self.scene),
        };
        if self.unfolded == scene.unfolded.ranges {
            return Ok(scene);
        }
        scene.with_unfolded(&self.unfolded, token).map(Arc::new)
    }
}

/// Results of earlier builds for the next.
#[derive(Default)]
struct Sessions {
    build: BuildSession,
    follow: FollowSession,
}

/// A request for a tree.
pub(crate) struct BuildJob {
    /// The inputs.
    pub key: BuildKey,
    /// The picture to trace with the tree, so that both are presented at once.
    pub view: Option<FirstView>,
    /// The containers drawn over that picture, if any.
    pub overlay: Option<OverlaySettings>,
    /// The settings are still changing, so another tree is likely to follow.
    pub moving: bool,
}

/// View of the coarse picture that is delivered with a tree.
#[derive(Clone)]
pub(crate) struct FirstView {
    /// The camera.
    pub camera: Camera,
    /// Shading and sampling.
    pub settings: RenderSettings,
    /// Width and height in pixels.
    pub size_px: [u32; 2],
    /// Number of pixels along each side that share a ray.
    pub coarseness: f32,
    /// How the exposure follows that of the picture on the screen; `None` for that of the view.
    pub adaptation: Option<Adaptation>,
    /// The nodes whose triangles are left out.
    pub hidden: HiddenNodes,
    /// The cut whose nodes cluster colours show.
    pub clusters: Option<ClusterCut>,
}

impl FirstView {
    /// Traces this view of `accel`, whose overlay table is `table`.
    fn trace(mut self, accel: &Arc<Accel>, table: &NodeTable, token: &CancelToken) -> Result<Rendered, Cancelled> {
        let hidden = hidden_triangles(accel, table, &mut self.hidden);
        let Self { camera, settings, size_px, coarseness, adaptation, clusters, .. } = self;
        let accel = Arc::clone(accel);
        // Layouts of the tree are made once it is presented.
        let (layout, second) = (None, None);
        let key = RenderKey { accel, camera, settings, size_px, hidden, clusters, layout, second, difference: false };
        let frame = Arc::new(key.trace(coarseness, adaptation, false, token, &|_| {})?);
        Ok(Rendered { key, frame, second: None, difference: None, complete: [false; 2], last: false })
    }
}

/// The triangles of `accel` below the nodes `hidden`, where it has them; `None` where nothing is hidden. Equal nodes give the
/// identical set, see [`NodeTable::visibility`].
pub(crate) fn hidden_triangles(accel: &Accel, table: &NodeTable, hidden: &mut HiddenNodes) -> Option<Arc<TriangleSet>> {
    let mut nodes = Selection::default();
    hidden.resolve(accel, &mut nodes);
    table
        .visibility(&nodes)
        .map(|visibility| Arc::clone(&visibility.triangles))
        .filter(|triangles| !triangles.is_empty())
}

/// A tree and its overlay table.
#[derive(Clone)]
pub(crate) struct BuiltTree {
    /// The tree.
    pub accel: Arc<Accel>,
    /// Its nodes by depth, for the overlay.
    pub table: Arc<NodeTable>,
    /// The requested number of threads; 0 for all.
    pub threads: usize,
}

/// The outcome of a [`BuildJob`].
pub(crate) struct Built {
    /// The inputs.
    pub key: BuildKey,
    /// The file of the tree as it was before it was read.
    pub file: Option<WatchedFile>,
    /// The tree, or why it was not built.
    pub result: Result<BuiltTree, BuildError>,
    /// Its first picture, where the job had a view.
    pub picture: Option<Rendered>,
}

/// Starts the worker that builds trees; `wake` is called from its thread after each result. After a tree is delivered the
/// worker collapses it into the wide tree and computes what panels and clicks need, unless another tree is requested.
pub(crate) fn start_worker(wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Worker<BuildJob, Built>> {
    let (pool, session) = (WorkerPool::default(), RefCell::new(Sessions::default()));
    Worker::new("build", wake, move |job: BuildJob, token: &CancelToken, deliver: &(dyn Fn(Built) + Sync)| {
        let BuildJob { key, view, overlay, moving } = job;
        let (threads, start) = (key.threads, Instant::now());
        let mut session = session.borrow_mut();
        let session: &mut Sessions = &mut session;
        let file = key.file.as_deref().and_then(WatchedFile::of);
        let result = pool.run("build", threads, || {
            let accel = Arc::new(key.tree(session, token)?);
            let table = Arc::new(NodeTable::new(&accel));
            if let Some(overlay) = &overlay {
                table.list(Some(overlay), token)?;
            }
            let listed = start.elapsed();
            // The first picture is coarse and traced through the binary tree, so it need not wait for the wide one.
            let picture = view.map(|view| view.trace(&accel, &table, token)).transpose()?;
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
            Err(refused) => deliver(Built { key, file, result: Err(refused), picture: None }),
            Ok((tree, picture)) => {
                let (accel, table) = (Arc::clone(&tree.accel), Arc::clone(&tree.table));
                deliver(Built { key, file, result: Ok(tree), picture });
                if moving {
                    wait_for_first_frame(token);
                }
                let Ok(wide) = pool.run("build", threads, || accel.widen(token)) else { return None };
                log::debug!("collapsed in {:.1?}, after {:.1?}", wide.collapse_time, start.elapsed());
                // Data for panels and clicks is computed once the picture has had the cores.
                wait_for_first_frame(token);
                if !token.is_cancelled() {
                    // No other build has followed, so the buffers for reuse are freed.
                    session.build.forget_scene();
                    // Where it is cancelled, the derived worker computes what is needed.
                    let _ = pool
                        .run("build", threads, || accel.compute_derived(token).and_then(|()| table.list(None, token)));
                }
            }
        }
        None
    })
}

/// Sleeps for [`BACKGROUND_DELAY`] or until cancelled.
fn wait_for_first_frame(token: &CancelToken) {
    let end = Instant::now() + BACKGROUND_DELAY;
    while Instant::now() < end && !token.is_cancelled() {
        std::thread::sleep(CANCEL_POLL);
    }
}
