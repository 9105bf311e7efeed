//! A traced picture.

use std::time::Duration;

use rayon::prelude::*;

use super::srgb::Encoder;
use super::view::background;
use super::{ColorMap, RenderSettings, Shading};
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

impl Frame {
    /// View depth where nothing was hit.
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

    /// The range that fits the values. Heat maps: 0 to the 99.5th percentile, so that a few extreme pixels do not darken
    /// all others, and at least to 1. Depth: nearest to farthest hit. `[0, 1]` where there are no values.
    pub fn fitted_range(&self) -> [f32; 2] {
        if self.values.is_empty() {
            return [0.0, 1.0];
        }
        if matches!(self.settings.shading, Shading::Heat(_)) {
            let mut sorted = self.values.clone();
            let rank = ((sorted.len() - 1) as f64 * 0.995).round() as usize;
            let (_, value, _) = sorted.select_nth_unstable_by(rank, f32::total_cmp);
            return [0.0, value.max(1.0)];
        }
        let hits = self.values.iter().copied().filter(|&value| value < Self::NO_HIT);
        let [low, high] = hits.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
        if low < high { [low, high] } else { [low.min(1e30), low.min(1e30) + 1.0] }
    }

    /// Colours the values anew without tracing anything; `None` fits the range. Does nothing where there are no values.
    pub fn recolor(&mut self, range: Option<[f32; 2]>, map: ColorMap) {
        if self.values.is_empty() {
            return;
        }
        let [low, high] = range.unwrap_or_else(|| self.fitted_range());
        self.value_range = [low, high];
        self.settings.color_map = map;
        if matches!(self.settings.shading, Shading::Heat(_)) {
            self.settings.heat_range = range;
        }
        let table: Vec<[u8; 4]> = (0..=TABLE_STEPS)
            .map(|step| {
                let [r, g, b] = map.srgb(step as f32 / TABLE_STEPS as f32);
                [r, g, b, 255]
            })
            .collect();
        let scale = TABLE_STEPS as f32 / (high - low).max(f32::MIN_POSITIVE);
        let (encoder, width, height) = (Encoder::new(), self.width_px as usize, self.height_px as f32);
        let (values, settings) = (&self.values, &self.settings);
        self.rgba.par_chunks_mut(width).zip(values.par_chunks(width)).enumerate().for_each(|(y, (rgba, values))| {
            // Nothing has no depth: there the picture keeps its background.
            let behind = encoder.rgba(background((y as f32 + 0.5) / height));
            let keeps_background = settings.shading == Shading::Depth;
            for (pixel, &value) in rgba.iter_mut().zip(values) {
                *pixel = if keeps_background && value >= Self::NO_HIT {
                    behind
                } else {
                    table[(((value - low) * scale + 0.5) as usize).min(TABLE_STEPS)]
                };
            }
        });
    }

    /// How often values fall into each of `bins` equal parts of 0 to the largest value (heat maps) or of the fitted range
    /// (depth); pixels without hit count in heat maps only. Empty for no values or no bins.
    pub fn histogram(&self, bins: usize) -> Vec<u32> {
        if self.values.is_empty() || bins == 0 {
            return Vec::new();
        }
        let [low, high] = self.histogram_range();
        let mut counts = vec![0; bins];
        for &value in self.values.iter().filter(|&&value| value < Self::NO_HIT) {
            let bin = ((value - low) / (high - low) * bins as f32) as usize;
            counts[bin.min(bins - 1)] += 1;
        }
        counts
    }

    /// The values at the two ends of [`Frame::histogram`].
    pub fn histogram_range(&self) -> [f32; 2] {
        if matches!(self.settings.shading, Shading::Heat(_)) {
            [0.0, self.values.iter().copied().fold(1.0, f32::max)]
        } else {
            self.fitted_range()
        }
    }
}

/// Colours in the table that values are looked up in.
const TABLE_STEPS: usize = 1023;
