//! Tracing pictures on a worker thread: from a tree and a camera to frames of increasing resolution.

use std::sync::Arc;

use crate::accel::laid::CountedLayout;
use crate::accel::{Accel, are_same};
use crate::app::studies::latest::WorkerPool;
use crate::camera::Camera;
use crate::lab::diff::DifferenceMap;
use crate::render::cluster_cut::ClusterCut;
use crate::render::{Adaptation, Frame, RenderRequest, RenderSettings, render_adapting};
use crate::visibility::TriangleSet;
use crate::worker::Worker;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// The inputs of a picture.
#[derive(Clone)]
pub(crate) struct RenderKey {
    /// The tree, compared by identity.
    pub accel: Arc<Accel>,
    /// The camera.
    pub camera: Camera,
    /// Shading and sampling.
    pub settings: RenderSettings,
    /// Width and height in pixels.
    pub size_px: [u32; 2],
    /// Triangles that rays pass through, compared by identity.
    pub hidden: Option<Arc<TriangleSet>>,
    /// The cut through the first tree whose nodes cluster colours show.
    pub clusters: Option<ClusterCut>,
    /// The layout of the first tree that a heat map counts; `None` beside a second tree.
    pub layout: Option<CountedLayout>,
    /// The second tree, which is traced after the first one in the same view; compared by identity.
    pub second: Option<Arc<Accel>>,
    /// Whether the difference of the two pictures is wanted.
    pub difference: bool,
}

impl PartialEq for RenderKey {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.accel, &other.accel)
            && are_same(self.second.as_ref(), other.second.as_ref())
            && self.difference == other.difference
            && self.is_same_view(other)
    }
}

impl RenderKey {
    /// Whether the rays and what they show are the same, whatever the trees.
    pub(crate) fn is_same_view(&self, other: &Self) -> bool {
        self.camera == other.camera
            && self.settings == other.settings
            && self.size_px == other.size_px
            && self.clusters == other.clusters
            && self.layout == other.layout
            && are_same(self.hidden.as_ref(), other.hidden.as_ref())
    }

    /// The inputs of the picture through the first tree (0) or the second (1) alone.
    fn through(&self, tree: usize) -> Option<Self> {
        let accel = if tree == 0 { Arc::clone(&self.accel) } else { Arc::clone(self.second.as_ref()?) };
        // Merges are shown in the first tree.
        let clusters = self.clusters.clone().filter(|_| tree == 0);
        let (hidden, layout) = (self.hidden.clone(), self.layout.clone());
        Some(Self { accel, second: None, difference: false, hidden, clusters, layout, ..*self })
    }

    /// Traces one picture through the first tree in which `coarseness`² pixels share a ray, and whose exposure
    /// follows by `adaptation`.
    pub(crate) fn trace(
        &self,
        coarseness: f32,
        adaptation: Option<Adaptation>,
        count_tests: bool,
        token: &CancelToken,
        deliver: &(dyn Fn(Frame) + Sync),
    ) -> Result<Frame, Cancelled> {
        let request = RenderRequest {
            accel: Arc::clone(&self.accel),
            camera: self.camera,
            settings: self.settings,
            width_px: self.size_px[0],
            height_px: self.size_px[1],
            coarseness,
            count_tests,
            hidden: self.hidden.clone(),
            clusters: self.clusters.clone(),
            layout: self.layout.clone(),
        };
        render_adapting(&request, adaptation, token, deliver)
    }
}

/// A request for a picture, coarsest pass first.
pub(crate) struct RenderJob {
    /// The inputs.
    pub key: RenderKey,
    /// Coarseness of each pass: the number of pixels along each side that share a ray.
    pub passes: Vec<f32>,
    /// How the exposure follows that of the picture on the screen; `None` for that of the view.
    pub adaptation: Option<Adaptation>,
    /// Number of threads; 0 for all.
    pub threads: usize,
    /// Count tests per ray in the pass at full resolution.
    pub count_tests: bool,
    /// The pictures of this view so far, through the tree and through the second one.
    pub known: [Option<Arc<Frame>>; 2],
    /// Whether its picture is complete and is not traced again, for each.
    pub keep: [bool; 2],
}

/// A traced picture.
pub(crate) struct Rendered {
    /// Its inputs.
    pub key: RenderKey,
    /// The picture.
    pub frame: Arc<Frame>,
    /// The picture of the same view through the second tree, where there is one.
    pub second: Option<Arc<Frame>>,
    /// The difference of the two, where it is wanted and they are of the same pass.
    pub difference: Option<Arc<DifferenceMap>>,
    /// Whether each picture is complete: at full resolution, with all samples and counts.
    pub complete: [bool; 2],
    /// The last picture of its job.
    pub last: bool,
}

/// Starts the worker that traces pictures; `wake` is called from its thread after each result.
pub(crate) fn start_worker(wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Worker<RenderJob, Rendered>> {
    let pool = WorkerPool::default();
    Worker::new("render", wake, move |job: RenderJob, token: &CancelToken, deliver: &(dyn Fn(Rendered) + Sync)| {
        let passes = Passes { complete: job.keep, newest: job.known.clone(), difference: None, job: &job };
        pool.run("render", job.threads, || passes.run(token, deliver)).ok().flatten()
    })
}

/// The passes of a job under way. Each result has the newest pictures of both trees, because the next may replace it before it
/// is taken.
struct Passes<'a> {
    job: &'a RenderJob,
    newest: [Option<Arc<Frame>>; 2],
    complete: [bool; 2],
    difference: Option<Arc<DifferenceMap>>,
}

impl Passes<'_> {
    /// Traces all passes, each through both trees before the next. Returns the last result.
    fn run(mut self, token: &CancelToken, deliver: &(dyn Fn(Rendered) + Sync)) -> Result<Option<Rendered>, Cancelled> {
        let job = self.job;
        let trees = if job.key.second.is_some() { 2 } else { 1 };
        for (index, &coarseness) in job.passes.iter().enumerate() {
            if index > 0
                && let Some(rendered) = self.result(false)
            {
                deliver(rendered);
            }
            for tree in (0..trees).filter(|&tree| !job.keep[tree]) {
                let step = index * trees + tree;
                self.trace(tree, coarseness, &token.part(step, job.passes.len() * trees), deliver)?;
            }
            self.subtract(token)?;
        }
        Ok(self.result(true))
    }

    /// Traces one pass through one of the trees.
    fn trace(
        &mut self,
        tree: usize,
        coarseness: f32,
        token: &CancelToken,
        deliver: &(dyn Fn(Rendered) + Sync),
    ) -> Result<(), Cancelled> {
        let Some(key) = self.job.key.through(tree) else { return Ok(()) };
        let with = |frame: Frame| {
            let mut newest = self.newest.clone();
            newest[tree] = Some(Arc::new(frame));
            newest
        };
        let deliver_sample = |frame: Frame| {
            let sample = Passes { newest: with(frame), difference: self.difference.clone(), ..*self };
            if let Some(rendered) = sample.result(false) {
                deliver(rendered);
            }
        };
        let frame = key.trace(coarseness, self.job.adaptation, self.job.count_tests, token, &deliver_sample)?;
        self.newest = with(frame);
        self.complete[tree] = coarseness == 1.0 && self.job.count_tests;
        Ok(())
    }

    /// Compares the newest pictures, where that is wanted and they are of the same pass.
    fn subtract(&mut self, token: &CancelToken) -> Result<(), Cancelled> {
        if let ([Some(a), Some(b)], true) = (&self.newest, self.job.key.difference) {
            self.difference = DifferenceMap::new(a, b, token)?.map(Arc::new);
        }
        Ok(())
    }

    /// The newest result; `None` before each tree has a picture.
    fn result(&self, last: bool) -> Option<Rendered> {
        let [first, second] = &self.newest;
        if second.is_none() && self.job.key.second.is_some() {
            return None;
        }
        Some(Rendered {
            key: self.job.key.clone(),
            frame: first.clone()?,
            second: second.clone(),
            difference: self.difference.clone(),
            complete: self.complete,
            last,
        })
    }
}
