//! Tracing speed, and how coarse a picture must be to follow a moving camera or slider; whether the settings are
//! changing.

use std::cell::Cell;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crate::app::state::{AppState, Wanted};
use crate::render::Frame;
use crate::render::cluster_cut::ClusterCut;

/// Maximum time from one picture to the next while the settings change, drawing included: 30 a second, and a little more, so that
/// a screen with 60 frames a second, which shows each of them twice, is within it.
const FRAME_BUDGET: Duration = Duration::from_micros(33_600);
/// Least part of [`FRAME_BUDGET`] that is left for tracing where drawing takes longer than the rest: below, the picture would only
/// get coarser.
const MIN_TRACING: f64 = 0.3;
/// The values of coarseness: close to each other, because each doubling shows, and few, because each has textures of its own. At
/// most one ray for 8×8 pixels.
const STEPS: [f32; 10] = [1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0];
/// A picture that is requested within this time after the last belongs to the same movement.
const CONTINUOUS: Duration = Duration::from_millis(12);
/// A finer step than the last is taken where it needs at most this part of [`FRAME_BUDGET`], so that the resolution does not
/// flicker between two.
const FINER: f64 = 0.85;
/// Coarseness before anything has been measured.
const INITIAL_COARSENESS: f32 = 4.0;
/// The displayed speed is the median over this time, so that it does not flicker.
const MEDIAN_WINDOW: Duration = Duration::from_secs(1);

/// Measured tracing speed of the presented scene.
#[derive(Debug, Default)]
pub(crate) struct FramePacing {
    secs_per_ray: Option<f64>,
    /// Seconds from one picture to the next in which nothing is traced: the UI frame and its drawing.
    overhead_secs: f64,
    /// When the last picture of a moving camera arrived.
    last_arrival: Option<Instant>,
    /// The coarseness that was chosen last.
    last: Cell<f32>,
    speeds: VecDeque<(Instant, f64)>,
}

impl FramePacing {
    /// Records the tracing time of a finished picture.
    pub(crate) fn record(&mut self, frame: &Frame, now: Instant) {
        if frame.stats.primary_rays == 0 {
            return;
        }
        let measured = frame.stats.trace_time.as_secs_f64() / frame.stats.primary_rays as f64;
        // An exponential moving average, which follows a change within a few pictures.
        self.secs_per_ray = Some(self.secs_per_ray.map_or(measured, |average| (average + measured) * 0.5));
        self.speeds.push_back((now, frame.mrays_per_s()));
        while self.speeds.front().is_some_and(|(then, _)| now.duration_since(*then) > MEDIAN_WINDOW) {
            self.speeds.pop_front();
        }
    }

    /// Records that a picture of a moving camera, traced in `trace_time` and requested at `since`, arrived in a UI frame, which requests
    /// the next one.
    pub(crate) fn record_arrival(&mut self, trace_time: Duration, since: Instant, now: Instant) {
        let last = self.last_arrival.replace(now);
        // From one picture to the next, unless nothing was wanted for a while in between.
        let from = last.filter(|&last| since.saturating_duration_since(last) < CONTINUOUS).unwrap_or(since);
        let overhead = now.saturating_duration_since(from).saturating_sub(trace_time).as_secs_f64();
        self.overhead_secs = (self.overhead_secs + overhead) * 0.5;
    }

    /// Forgets all measurements.
    pub(crate) fn reset(&mut self) {
        *self = Self::default();
    }

    /// Coarseness, one of [`STEPS`], with which a picture of this size is traced and drawn within [`FRAME_BUDGET`]: the number of
    /// pixels along each side that share a ray.
    pub(crate) fn coarseness(&self, size_px: [u32; 2]) -> f32 {
        let Some(secs_per_ray) = self.secs_per_ray else { return INITIAL_COARSENESS };
        let full_resolution_secs = secs_per_ray * f64::from(size_px[0]) * f64::from(size_px[1]);
        let whole = FRAME_BUDGET.as_secs_f64();
        let fits = |step: f32| {
            let budget = whole * if step < self.last.get() { FINER } else { 1.0 };
            full_resolution_secs <= (budget - self.overhead_secs).max(whole * MIN_TRACING) * f64::from(step).powi(2)
        };
        let coarseness = STEPS.into_iter().find(|&step| fits(step)).unwrap_or(STEPS[STEPS.len() - 1]);
        self.last.set(coarseness);
        coarseness
    }

    /// Median speed of the last second in Mray/s; 0 where nothing was traced.
    pub(crate) fn mrays_per_s(&self) -> f64 {
        let mut speeds: Vec<f64> = self.speeds.iter().map(|(_, speed)| *speed).collect();
        speeds.sort_by(f64::total_cmp);
        speeds.get(speeds.len() / 2).copied().unwrap_or(0.0)
    }
}

/// Time without a change after which the settings are at rest and the picture is refined.
pub(crate) const REST_DELAY: Duration = Duration::from_millis(160);

/// Watches the settings that decide the picture.
#[derive(Default)]
pub(crate) struct Motion {
    last: Option<Wanted>,
    /// The cut that was shown in cluster colours.
    clusters: Option<ClusterCut>,
    changed_at: Option<Instant>,
    disabled: bool,
}

impl Motion {
    /// Sets whether changes are ignored, so that nothing ever counts as moving.
    pub(crate) const fn set_disabled(&mut self, disabled: bool) {
        self.disabled = disabled;
    }

    /// Compares the settings with those of the last UI frame. Returns whether they are changing.
    pub(crate) fn observe(&mut self, state: &AppState, now: Instant) -> bool {
        let wanted = &state.wanted;
        let clusters = state.cluster_cut(state.model.presented.as_ref().map(|shown| &shown.accel));
        let same = self.last.as_ref().is_some_and(|last| {
            let second = |wanted: &Wanted| wanted.second.map(|second| (second.build, second.policy));
            last.camera == wanted.camera
                && (last.moment, last.follow) == (wanted.moment, wanted.follow)
                && last.build == wanted.build
                && last.tree_files == wanted.tree_files
                && second(last) == second(wanted)
                && last.render == wanted.render
                && self.clusters == clusters
        });
        if !same || state.model.playback.playing {
            if self.last.is_some() {
                self.changed_at = Some(now);
            }
            (self.last, self.clusters) = (Some(wanted.clone()), clusters);
        }
        self.is_moving(now)
    }

    /// Whether a setting has changed within [`REST_DELAY`].
    pub(crate) fn is_moving(&self, now: Instant) -> bool {
        !self.disabled && self.changed_at.is_some_and(|then| now.duration_since(then) < REST_DELAY)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pacing(secs_per_ray: f64) -> FramePacing {
        FramePacing { secs_per_ray: Some(secs_per_ray), ..FramePacing::default() }
    }

    #[test]
    fn the_finest_step_within_the_budget_is_chosen() {
        let size = [1000, 500];
        let budget = FRAME_BUDGET.as_secs_f64() / 500_000.0;
        for (times, expected) in [(0.5, 1.0), (1.0, 1.0), (1.5, 1.25), (2.2, 1.5), (3.9, 2.0), (60.0, 8.0), (1e6, 8.0)]
        {
            assert_eq!(pacing(budget * times).coarseness(size), expected, "{times} times the budget");
        }
        assert_eq!(FramePacing::default().coarseness(size), INITIAL_COARSENESS);
    }

    #[test]
    fn drawing_takes_its_part_of_the_budget() {
        let size = [1000, 500];
        let budget = FRAME_BUDGET.as_secs_f64();
        let coarseness = |tracing: f64, overhead: f64| {
            let pacing = FramePacing { overhead_secs: budget * overhead, ..pacing(budget * tracing / 500_000.0) };
            pacing.coarseness(size)
        };
        assert_eq!([coarseness(1.0, 0.0), coarseness(1.0, 0.5), coarseness(2.0, 0.6)], [1.0, 1.5, 2.5]);
        assert_eq!([coarseness(1.0, 0.9), coarseness(1.0, 5.0)], [2.0; 2], "some of it is always left");
    }

    #[test]
    fn time_without_tracing_is_measured_from_picture_to_picture() {
        let millis = Duration::from_millis;
        let mut pacing = FramePacing::default();
        let start = Instant::now();
        // The first one takes 30 ms; the next one is requested 2 ms after it and arrives 28 ms later.
        pacing.record_arrival(millis(10), start, start + millis(30));
        assert!((pacing.overhead_secs - 0.010).abs() < 1e-9, "half of 20 ms: {}", pacing.overhead_secs);
        pacing.record_arrival(millis(10), start + millis(32), start + millis(60));
        assert!((pacing.overhead_secs - 0.015).abs() < 1e-9, "towards 20 ms: {}", pacing.overhead_secs);
        // Then nobody moves for a second.
        pacing.record_arrival(millis(10), start + millis(1060), start + millis(1085));
        assert!((pacing.overhead_secs - 0.015).abs() < 1e-9, "15 ms: {}", pacing.overhead_secs);
    }

    #[test]
    fn the_resolution_does_not_flicker_around_a_limit() {
        let size = [1000, 500];
        let limit = FRAME_BUDGET.as_secs_f64() / 500_000.0 * 4.0;
        let mut pacing = pacing(limit * 1.01);
        let mut chosen = Vec::new();
        for times in [1.01, 0.99, 1.01, 0.95, 1.02, 0.9] {
            pacing.secs_per_ray = Some(limit * times);
            chosen.push(pacing.coarseness(size));
        }
        assert_eq!(chosen, [2.5; 6]);
        pacing.secs_per_ray = Some(limit * 0.8);
        assert_eq!(pacing.coarseness(size), 2.0, "a clear gain is taken");
    }
}
