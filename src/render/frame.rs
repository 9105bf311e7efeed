//! A traced picture.

use std::time::Duration;

use super::settings::RenderSettings;
use crate::camera::Camera;

/// A picture with what was measured while making it.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Width in pixels of the picture as traced; a coarse pass is smaller than what was asked for.
    pub width_px: u32,
    /// Height in pixels as traced.
    pub height_px: u32,
    /// Coarseness: each traced pixel stands for a square of this many wanted pixels; 1 at full resolution.
    pub coarseness: u32,
    /// sRGB bytes with alpha 255, row by row from the top.
    pub rgba: Vec<[u8; 4]>,
    /// Linear view depth of each pixel's first sample; [`Frame::NO_HIT`] where nothing was hit.
    pub depth: Vec<f32>,
    /// Distance of the hit along each pixel's unit ray; infinity where nothing was hit.
    pub distance: Vec<f32>,
    /// The triangle under each pixel; `u32::MAX` where nothing was hit.
    pub primitive: Vec<u32>,
    /// The value that the colour stands for (tests of heat maps, view depth of the depth mode); empty in other modes.
    pub values: Vec<f32>,
    /// The range of `values` that the colour map covers; `[0, 1]` in modes without values.
    pub value_range: [f32; 2],
    /// Antialiasing samples a pixel that went into it.
    pub samples: u32,
    /// The camera that it was taken with.
    pub camera: Camera,
    /// The settings that it was made with.
    pub settings: RenderSettings,
    /// What was measured.
    pub stats: FrameStats,
}

/// What was measured while tracing a frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FrameStats {
    /// Primary rays of the newest sample pass.
    pub primary_rays: u64,
    /// Primary rays that hit something.
    pub hits: u64,
    /// Wall-clock time of the newest sample pass.
    pub trace_time: Duration,
    /// Container tests a primary ray; `None` where they were not counted.
    pub container_tests_per_ray: Option<f32>,
    /// Primitive tests a primary ray; `None` where they were not counted.
    pub primitive_tests_per_ray: Option<f32>,
    /// Samples of all passes whose colour was not a number; they are black.
    pub nan_samples: u64,
}

impl FrameStats {
    /// Container and primitive tests a primary ray; `None` where they were not counted.
    pub fn tests_per_ray(&self) -> Option<[f32; 2]> {
        Some([self.container_tests_per_ray?, self.primitive_tests_per_ray?])
    }
}

impl Frame {
    /// TraceContext depth where nothing was hit.
    pub const NO_HIT: f32 = 1e30;

    /// Millions of primary rays a second of the newest pass, shading included.
    pub fn mrays_per_s(&self) -> f64 {
        let seconds = self.stats.trace_time.as_secs_f64();
        if seconds > 0.0 { self.stats.primary_rays as f64 / seconds / 1e6 } else { 0.0 }
    }

    /// Index of the traced pixel that shows the wanted pixel (x, y).
    pub fn index_of(&self, x_px: u32, y_px: u32) -> usize {
        let x = (x_px / self.coarseness).min(self.width_px - 1);
        let y = (y_px / self.coarseness).min(self.height_px - 1);
        (y * self.width_px + x) as usize
    }
}
