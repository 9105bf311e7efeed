//! How coarse a picture must be to keep up with the hand, and how fast tracing is.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crate::render::Frame;

/// A picture traced while something moves should take no longer.
const MOVING_TARGET: Duration = Duration::from_millis(33);
/// Coarsest picture: one ray for 8×8 pixels.
const COARSEST: u32 = 8;
/// Coarseness before anything was measured.
const FIRST_GUESS: u32 = 4;
/// Trace figures are medians over this time, so that they do not flicker.
const WINDOW: Duration = Duration::from_secs(1);

/// Measured tracing speed.
#[derive(Debug, Default)]
pub struct FramePacing {
    secs_per_ray: Option<f64>,
    speeds: VecDeque<(Instant, f64)>,
}

impl FramePacing {
    /// Learns from a finished picture.
    pub fn learn(&mut self, frame: &Frame, now: Instant) {
        if frame.stats.primary_rays == 0 {
            return;
        }
        let measured = frame.stats.trace_time.as_secs_f64() / frame.stats.primary_rays as f64;
        // Half old, half new: follows a change within a few pictures without jumping at each.
        self.secs_per_ray = Some(self.secs_per_ray.map_or(measured, |old| (old + measured) * 0.5));
        self.speeds.push_back((now, frame.mrays_per_s()));
        while self.speeds.front().is_some_and(|(then, _)| now.duration_since(*then) > WINDOW) {
            self.speeds.pop_front();
        }
    }

    /// Forgets what was measured: another scene.
    pub fn forget(&mut self) {
        *self = Self::default();
    }

    /// Pixels along each side that share a ray, 1 to 8, so that a picture of this size keeps up with the hand.
    pub fn coarseness(&self, size_px: [u32; 2]) -> u32 {
        let Some(secs_per_ray) = self.secs_per_ray else { return FIRST_GUESS };
        let full = secs_per_ray * f64::from(size_px[0]) * f64::from(size_px[1]);
        let needed = (full / MOVING_TARGET.as_secs_f64()).sqrt().ceil();
        (needed as u32).clamp(1, COARSEST)
    }

    /// Median speed of the last second in Mray/s; 0 where nothing was traced.
    pub fn mrays_per_s(&self) -> f64 {
        let mut speeds: Vec<f64> = self.speeds.iter().map(|(_, speed)| *speed).collect();
        speeds.sort_by(f64::total_cmp);
        speeds.get(speeds.len() / 2).copied().unwrap_or(0.0)
    }
}
