//! Tracing pictures on a worker thread: from a tree and a camera to frames of increasing resolution.

use std::sync::Arc;

use crate::accel::Accel;
use crate::app::work::pool::WorkerPool;
use crate::camera::Camera;
use crate::render::{Frame, RenderRequest, RenderSettings, render};
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
}

impl PartialEq for RenderKey {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.accel, &other.accel)
            && self.camera == other.camera
            && self.settings == other.settings
            && self.size_px == other.size_px
            && self.hidden.as_ref().map(Arc::as_ptr) == other.hidden.as_ref().map(Arc::as_ptr)
    }
}

impl RenderKey {
    /// Traces one picture in which `coarseness`² pixels share a ray.
    pub(crate) fn trace(
        &self,
        coarseness: f32,
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
        };
        render(&request, token, deliver)
    }
}

/// A request for a picture, coarsest pass first.
pub(crate) struct RenderJob {
    /// The inputs.
    pub key: RenderKey,
    /// Coarseness of each pass: the number of pixels along each side that share a ray.
    pub passes: Vec<f32>,
    /// Number of threads; 0 for all.
    pub threads: usize,
    /// Count tests per ray in the pass at full resolution.
    pub count_tests: bool,
}

/// A traced picture.
pub(crate) struct Rendered {
    /// Its inputs.
    pub key: RenderKey,
    /// The picture.
    pub frame: Arc<Frame>,
    /// The last picture of its job.
    pub last: bool,
    /// Its job counts tests per ray.
    pub counts_tests: bool,
}

/// Starts the worker that traces pictures; `wake` is called from its thread after each result.
pub(crate) fn start_worker(wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Worker<RenderJob, Rendered>> {
    let pool = WorkerPool::default();
    Worker::new("render", wake, move |job: RenderJob, token: &CancelToken, deliver: &(dyn Fn(Rendered) + Sync)| {
        let RenderJob { key, passes, threads, count_tests } = job;
        let rendered = |frame: Frame, last: bool| Rendered {
            key: key.clone(),
            frame: Arc::new(frame),
            last,
            counts_tests: count_tests,
        };
        let mut newest = None;
        for coarseness in passes {
            if let Some(frame) = newest.take() {
                deliver(rendered(frame, false));
            }
            let deliver_sample = |frame| deliver(rendered(frame, false));
            let frame = pool.run("render", threads, || key.trace(coarseness, count_tests, token, &deliver_sample));
            newest = Some(frame.ok()?);
        }
        newest.map(|frame| rendered(frame, true))
    })
}
