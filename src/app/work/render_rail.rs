//! Tracing pictures: requests the wanted picture, coarse while the settings change and refined at rest.

use std::time::Instant;

use crate::app::state::{JobStatus, MessageLog};
use crate::app::work::background_drop::drop_in_background;
use crate::app::work::frame_pacing::FramePacing;
use crate::app::work::in_flight::{InFlight, Polled, poll, report_panic};
use crate::app::work::render_job::{RenderJob, RenderKey, Rendered, start_worker};
use crate::render::Frame;
use crate::worker::Worker;

/// Lower limit of the coarseness until the wide tree is built: few enough rays for the binary tree.
const COARSENESS_BEFORE_WIDE: f32 = 3.0;

/// A picture being traced.
struct Tracing {
    job: InFlight<RenderKey>,
    /// A single coarse pass, which is soon finished and therefore never cancelled.
    single_pass: bool,
}

/// The picture on the screen.
struct Shown {
    key: RenderKey,
    /// It has its full resolution, all samples and counts.
    complete: bool,
}

/// Traces the wanted picture.
pub(crate) struct RenderRail {
    worker: Worker<RenderJob, Rendered>,
    in_flight: Option<Tracing>,
    /// A key that failed or was cancelled; it is not requested again until something else is.
    refused: Option<RenderKey>,
    shown: Option<Shown>,
    pacing: FramePacing,
    /// Number of pictures presented so far.
    frame_count: u64,
    /// Pictures are never coarse.
    full_resolution: bool,
}

impl RenderRail {
    /// Starts the worker; `wake` is called from its thread after each result.
    pub(crate) fn new(wake: impl Fn() + Send + Sync + 'static) -> std::io::Result<Self> {
        Ok(Self {
            worker: start_worker(wake)?,
            in_flight: None,
            refused: None,
            shown: None,
            pacing: FramePacing::default(),
            frame_count: 0,
            full_resolution: false,
        })
    }

    /// Sets whether every picture is traced at full resolution at once.
    pub(crate) const fn set_full_resolution(&mut self, full_resolution: bool) {
        self.full_resolution = full_resolution;
    }

    /// Allows a request for what failed or was cancelled.
    pub(crate) fn allow_retry(&mut self) {
        self.refused = None;
    }

    /// Coarseness of the first picture of a tree without a wide one; `None` where pictures are never coarse.
    pub(crate) fn first_coarseness(&self, size_px: [u32; 2]) -> Option<f32> {
        (!self.full_resolution).then(|| self.pacing.coarseness(size_px).max(COARSENESS_BEFORE_WIDE))
    }

    /// Requests a picture unless it is shown, in flight or refused. While the settings are `moving` it is a single coarse
    /// pass. The picture of a `stale` tree, one that is about to be replaced, is not refined.
    pub(crate) fn request(&mut self, key: RenderKey, threads: usize, moving: bool, stale: bool, now: Instant) {
        let min_coarseness = if key.accel.known_wide().is_none() { COARSENESS_BEFORE_WIDE } else { 1.0 };
        let coarseness =
            if self.full_resolution { 1.0 } else { self.pacing.coarseness(key.size_px).max(min_coarseness) };
        let shown = self.shown.as_ref().filter(|shown| shown.key == key);
        if shown.is_some_and(|shown| shown.complete || moving) || self.refused.as_ref() == Some(&key) {
            return;
        }
        if stale && shown.is_some() {
            // The new tree is built on the same cores.
            if self.in_flight.take_if(|tracing| !tracing.single_pass).is_some() {
                self.worker.cancel();
            }
            return;
        }
        if let Some(tracing) = &self.in_flight
            && (tracing.job.key == key || tracing.single_pass)
        {
            return;
        }
        let passes = match shown {
            _ if moving => vec![coarseness],
            None if coarseness > 1.0 => vec![coarseness, 1.0],
            _ => vec![1.0],
        };
        let mut job_key = key.clone();
        if moving {
            job_key.settings.samples = 1;
        }
        let token = self.worker.request(RenderJob { key: job_key, passes, threads, count_tests: !moving });
        self.refused = None;
        self.in_flight = Some(Tracing { job: InFlight { key, token, since: now }, single_pass: moving });
    }

    /// Takes a traced picture, with the key that was requested: the picture's own key has fewer samples while the settings
    /// are changing.
    pub(crate) fn poll(&mut self, messages: &mut MessageLog, now: Instant) -> Option<(RenderKey, Rendered)> {
        let tracing = self.in_flight.as_ref()?;
        match poll(&self.worker) {
            Polled::Running => None,
            Polled::Result(rendered) => {
                let key = tracing.job.key.clone();
                if rendered.last {
                    self.in_flight = None;
                }
                self.measure(&rendered.frame, now);
                Some((key, rendered))
            }
            Polled::Failed(panic) => {
                self.refused = self.in_flight.take().map(|tracing| tracing.job.key);
                if let Some(text) = panic {
                    report_panic(messages, "Tracing", &text);
                }
                None
            }
        }
    }

    /// Cancels tracing.
    pub(crate) fn stop(&mut self) {
        if self.in_flight.take().is_some() {
            self.worker.cancel();
        }
    }

    /// Cancels tracing; the same picture is not requested again until another one is.
    pub(crate) fn cancel(&mut self) {
        if let Some(tracing) = self.in_flight.take() {
            self.worker.cancel();
            self.refused = Some(tracing.job.key);
        }
    }

    /// Records the tracing speed of `frame`.
    pub(crate) fn measure(&mut self, frame: &Frame, now: Instant) {
        self.pacing.record(frame, now);
    }

    /// Forgets the measured tracing speed, which was another scene's.
    pub(crate) fn reset_pacing(&mut self) {
        self.pacing.reset();
    }

    /// Median tracing speed of the last second in Mray/s.
    pub(crate) fn mrays_per_s(&self) -> f64 {
        self.pacing.mrays_per_s()
    }

    /// A new identifier for a presented picture.
    pub(crate) const fn next_frame_id(&mut self) -> u64 {
        self.frame_count += 1;
        self.frame_count
    }

    /// Notes that `rendered`, which was requested as `key`, is on the screen.
    pub(crate) fn note_shown(&mut self, key: RenderKey, rendered: &Rendered) {
        let coarseness = rendered.frame.coarseness;
        let complete =
            rendered.last && coarseness == 1.0 && rendered.counts_tests && rendered.key.settings == key.settings;
        if coarseness == 1.0 {
            log::info!("picture at full resolution, {} samples a pixel", rendered.frame.samples);
        }
        drop_in_background(self.shown.replace(Shown { key, complete }));
    }

    /// When the job in flight was requested.
    pub(crate) fn since(&self) -> Option<Instant> {
        self.in_flight.as_ref().map(|tracing| tracing.job.since)
    }

    /// The job in flight, for the job strip.
    pub(crate) fn status(&self) -> Option<JobStatus> {
        self.in_flight.as_ref().map(|tracing| tracing.job.status("Tracing".to_owned()))
    }
}
