//! Tracing speed, and how coarse a picture must be to follow a moving camera or slider.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crate::render::Frame;

/// Maximum time to trace a picture while the settings change: 30 frames per second.
const FRAME_BUDGET: Duration = Duration::from_millis(33);
/// Largest coarseness: one ray for 8×8 pixels.
const MAX_COARSENESS: u32 = 8;
/// Coarseness before anything has been measured.
const INITIAL_COARSENESS: u32 = 4;
/// The displayed speed is the median over this time, so that it does not flicker.
const MEDIAN_WINDOW: Duration = Duration::from_secs(1);

/// Measured tracing speed of the presented scene.
#[derive(Debug, Default)]
pub(crate) struct FramePacing {
    secs_per_ray: Option<f64>,
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

    /// Forgets all measurements.
    pub(crate) fn reset(&mut self) {
        *self = Self::default();
    }

    /// Coarseness, 1 to [`MAX_COARSENESS`], with which a picture of this size is traced within [`FRAME_BUDGET`]: the
    /// number of pixels along each side that share a ray.
    pub(crate) fn coarseness(&self, size_px: [u32; 2]) -> u32 {
        let Some(secs_per_ray) = self.secs_per_ray else { return INITIAL_COARSENESS };
        let full_resolution_secs = secs_per_ray * f64::from(size_px[0]) * f64::from(size_px[1]);
        let coarseness = (full_resolution_secs / FRAME_BUDGET.as_secs_f64()).sqrt().ceil();
        (coarseness as u32).clamp(1, MAX_COARSENESS)
    }

    /// Median speed of the last second in Mray/s; 0 where nothing was traced.
    pub(crate) fn mrays_per_s(&self) -> f64 {
        let mut speeds: Vec<f64> = self.speeds.iter().map(|(_, speed)| *speed).collect();
        speeds.sort_by(f64::total_cmp);
        speeds.get(speeds.len() / 2).copied().unwrap_or(0.0)
    }
}
