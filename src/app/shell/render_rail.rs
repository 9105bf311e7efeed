//! Tracing pictures: requests the wanted picture, coarse while the settings change and refined at rest.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::app::shell::frame_pacing::FramePacing;
use crate::app::shell::present::drop_in_background;
use crate::app::shell::render_job::{RenderJob, RenderKey, Rendered, start_worker};
use crate::app::state::{JobStatus, MessageLog};
use crate::app::studies::latest::{Latest, Polled, report_panic};
use crate::camera::Camera;
use crate::render::{Adaptation, Frame, Metered, RenderSettings};
use crate::scene::{Moment, Scene};

/// Lower limit of the coarseness until the wide tree is built: few enough rays for the binary tree.
const COARSENESS_BEFORE_WIDE: f32 = 3.0;

/// Time constant with which the exposure follows a moving camera, and once that has come to rest. The meter's error differs from
/// view to view, by up to a third of a stop inside Crytek Sponza.
const ADAPTATION: [Duration; 2] = [Duration::from_millis(250), Duration::from_millis(100)];
/// Longest time for which the exposure follows in one picture: after a rest it starts gently.
const MAX_ADAPTATION_STEP: Duration = Duration::from_millis(60);

/// The pictures on the screen.
struct ShownPictures {
    key: RenderKey,
    /// The pictures through the first and the second tree.
    frames: [Option<Arc<Frame>>; 2],
    /// Whether each has its full resolution, all samples and counts.
    complete: [bool; 2],
    /// Nothing remains to be done.
    finished: bool,
    /// Exposure and openness that it is shown with, and whether they are those of its view.
    metered: Metered,
    is_adapted: bool,
    since: Instant,
    /// Time for which the picture before it was shown, at most [`MAX_ADAPTATION_STEP`]: the next one will follow it as soon.
    interval: Duration,
}

impl ShownPictures {
    /// The pictures that `key` demands too, and whether each is complete.
    fn for_key(&self, key: &RenderKey) -> ([Option<Arc<Frame>>; 2], [bool; 2]) {
        let same_view = self.key.is_same_view(key);
        let second = self.key.second.as_ref().zip(key.second.as_ref());
        let same = [
            same_view && Arc::ptr_eq(&self.key.accel, &key.accel),
            same_view && second.is_some_and(|(shown, wanted)| Arc::ptr_eq(shown, wanted)),
        ];
        let frames = [0, 1].map(|tree| self.frames[tree].clone().filter(|_| same[tree]));
        (frames, [0, 1].map(|tree| same[tree] && self.complete[tree]))
    }

    /// How the exposure of a picture of `key` follows that of this one; `None` where it need not.
    fn adaptation(&self, key: &RenderKey) -> Option<Adaptation> {
        let scene = &key.accel.scene;
        self.adaptation_at(scene, scene.moment, &key.camera, &key.settings)
    }

    fn adaptation_at(
        &self,
        model: &Arc<Scene>,
        moment: Option<Moment>,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Option<Adaptation> {
        let old = &self.key;
        if !old.accel.scene.is_same_model(model) || old.settings != *settings {
            return None;
        }
        let [moving, resting] = ADAPTATION;
        let is_still = old.camera == *camera && old.accel.scene.moment == moment;
        let time_constant = if is_still { resting } else { moving };
        let fraction = 1.0 - (-self.interval.div_duration_f32(time_constant)).exp();
        Some(Adaptation { from: self.metered, fraction })
    }
}

/// Traces the wanted picture.
pub(crate) struct RenderRail {
    latest: Latest<RenderKey, RenderJob, Rendered>,
    /// The picture in flight is a single coarse pass, which is soon finished and therefore never cancelled.
    single_pass: bool,
    shown: Option<ShownPictures>,
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
            latest: Latest::new(start_worker(wake)?),
            single_pass: false,
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
        self.latest.refuse(None);
    }

    /// Coarseness of the first picture of a tree without a wide one; `None` where pictures are never coarse.
    pub(crate) fn first_coarseness(&self, size_px: [u32; 2]) -> Option<f32> {
        (!self.full_resolution).then(|| self.pacing.coarseness(size_px).max(COARSENESS_BEFORE_WIDE))
    }

    /// How the exposure of the first picture of `model` at another moment follows that of the picture on the screen; `None` where it
    /// need not.
    pub(crate) fn adaptation_at(
        &self,
        model: &Arc<Scene>,
        moment: Option<Moment>,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Option<Adaptation> {
        let shown = self.shown.as_ref().filter(|shown| shown.key.accel.scene.moment != moment)?;
        shown.adaptation_at(model, moment, camera, settings)
    }

    /// Requests a picture unless it is shown, in flight or refused. While the settings are `moving`, and until the exposure is
    /// that of the view, it is a single coarse pass. The picture of a `stale` tree, one that is about to be replaced, is not refined.
    pub(crate) fn request(&mut self, key: RenderKey, threads: usize, moving: bool, stale: bool, now: Instant) {
        let min_coarseness = if key.accel.known_wide().is_none() { COARSENESS_BEFORE_WIDE } else { 1.0 };
        // Two trees take two pictures in the time of one.
        let rays = if key.second.is_some() { [key.size_px[0], key.size_px[1] * 2] } else { key.size_px };
        let coarseness = if self.full_resolution { 1.0 } else { self.pacing.coarseness(rays).max(min_coarseness) };
        let (known, keep) = self.shown.as_ref().map_or_else(|| ([None, None], [false; 2]), |shown| shown.for_key(&key));
        let shown = self.shown.as_ref().filter(|shown| shown.key == key);
        let is_adapting = shown.is_some_and(|shown| !shown.is_adapted);
        if shown.is_some_and(|shown| shown.finished || moving && !is_adapting) || self.latest.refused() == Some(&key) {
            return;
        }
        if stale && shown.is_some() {
            // The new tree is built on the same cores.
            if !self.single_pass {
                self.latest.stop();
            }
            return;
        }
        if self.latest.key() == Some(&key) || self.is_single_pass() {
            return;
        }
        let single_pass = moving || is_adapting;
        let passes = match shown {
            _ if single_pass => vec![coarseness],
            None if coarseness > 1.0 => vec![coarseness, 1.0],
            _ => vec![1.0],
        };
        let mut job_key = key.clone();
        let mut adaptation = None;
        if single_pass {
            job_key.settings.samples = 1;
            adaptation = self.shown.as_ref().and_then(|shown| shown.adaptation(&key));
        }
        // While settings change, both pictures of a difference are coarse alike; what stays as it is remains sharp otherwise.
        let keep = if single_pass && key.difference { [false; 2] } else { keep };
        let job = RenderJob { key: job_key, passes, adaptation, threads, count_tests: !single_pass, known, keep };
        self.latest.request(key, job, now);
        self.latest.refuse(None);
        self.single_pass = single_pass;
    }

    /// Takes a traced picture, with the key that was requested: the picture's own key has fewer samples while the settings
    /// are changing.
    pub(crate) fn poll(&mut self, messages: &mut MessageLog, now: Instant) -> Option<(RenderKey, Rendered)> {
        match self.latest.poll() {
            Polled::Running => None,
            Polled::Result(rendered) => {
                let (key, since) = (self.latest.key()?.clone(), self.latest.since()?);
                if rendered.last {
                    self.latest.finish(&key);
                }
                self.measure(&rendered.frame, now);
                if self.single_pass {
                    self.pacing.record_arrival(rendered.frame.stats.trace_time, since, now);
                }
                Some((key, rendered))
            }
            Polled::Failed(panic) => {
                if let Some(text) = panic {
                    report_panic(messages, "Tracing", &text);
                }
                None
            }
        }
    }

    /// Cancels tracing.
    pub(crate) fn stop(&mut self) {
        self.latest.stop();
    }

    /// Drops the second tree and its picture.
    pub(crate) fn forget_second(&mut self) {
        self.allow_retry();
        if let Some(shown) = &mut self.shown {
            let second = (shown.key.second.take(), shown.frames[1].take());
            (shown.key.difference, shown.finished) = (false, shown.finished && shown.complete[0]);
            drop_in_background(second);
        }
    }

    /// Cancels tracing; the same picture is not requested again until another one is.
    pub(crate) fn cancel(&mut self) {
        self.latest.cancel();
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
    pub(crate) fn note_shown(&mut self, key: RenderKey, rendered: &Rendered, now: Instant) {
        let coarseness = rendered.frame.coarseness;
        let complete = rendered.complete;
        let finished = rendered.last && complete[0] && (complete[1] || key.second.is_none());
        if coarseness == 1.0 {
            log::info!("picture at full resolution, {} samples a pixel", rendered.frame.samples);
        }
        let frame = &rendered.frame;
        log::trace!(
            "picture 1:{coarseness}, {} samples, exposed by {:+.3} EV, traced in {:.1} ms",
            frame.samples,
            frame.exposure_stops,
            frame.stats.trace_time.as_secs_f64() * 1e3
        );
        let interval = self.shown.as_ref().map(|before| now.saturating_duration_since(before.since));
        let shown = ShownPictures {
            key,
            frames: [Some(Arc::clone(frame)), rendered.second.clone()],
            complete,
            finished,
            metered: frame.metered(),
            is_adapted: frame.is_adapted,
            since: now,
            interval: interval.map_or(MAX_ADAPTATION_STEP, |interval| interval.min(MAX_ADAPTATION_STEP)),
        };
        drop_in_background(self.shown.replace(shown));
    }

    /// When the job in flight was requested.
    pub(crate) fn since(&self) -> Option<Instant> {
        self.latest.since()
    }

    /// Whether a single coarse picture is in flight.
    pub(crate) fn is_single_pass(&self) -> bool {
        self.latest.is_busy() && self.single_pass
    }

    /// The job in flight, for the job strip.
    pub(crate) fn status(&self) -> Option<JobStatus> {
        self.latest.status("Tracing")
    }
}
