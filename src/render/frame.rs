//! A traced picture.

use crate::catalog::reading::{Times, TraceReading};
use std::time::Duration;

use glam::Vec3;

use super::adaptation::Metered;
use super::cluster_cut::ClusterCut;
use super::settings::RenderSettings;
use crate::camera::Camera;
use crate::catalog::layouts::{LayoutChoice, NamedLayout};

/// A traced picture with its per-pixel data and measurements. All lists are row by row from the top left.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Traced width in pixels; smaller than the requested width in a coarse pass.
    pub width_px: u32,
    /// Traced height in pixels.
    pub height_px: u32,
    /// Edge in requested pixels of the square that a traced pixel covers; 1 at full resolution.
    pub coarseness: f32,
    /// sRGB RGBA, 8 bits a channel; alpha is 255.
    pub rgba: Vec<[u8; 4]>,
    /// Linear view depth of each pixel's centre in world units; [`Frame::NO_HIT`] on the background.
    pub depth: Vec<f32>,
    /// Hit distance along the unit ray through each pixel's centre in world units; infinity on the background.
    pub distance: Vec<f32>,
    /// Index of the triangle, or in a scene of two levels of the copy, at each pixel's centre; `u32::MAX` on the background.
    pub primitive: Vec<u32>,
    /// The value that each colour encodes (test counts of heat maps, view depth of the depth mode); empty in other modes.
    pub values: Vec<f32>,
    /// The range of `values` that the colour map covers; `[0, 1]` in modes without values.
    pub value_range: [f32; 2],
    /// Accumulated antialiasing samples per pixel.
    pub samples: u32,
    /// Exposure of lit shading in stops, set or metered; 0 in other modes.
    pub exposure_stops: f32,
    /// Light of the sky that arrives at the surfaces in view, which the first sample of lit shading is shown with; see
    /// [`Metered::openness`].
    pub openness: Vec3,
    /// Exposure and openness are those of the view, not on the way there from those of another one; see
    /// [`render_adapting`](super::render_adapting).
    pub is_adapted: bool,
    /// The camera of the picture.
    pub camera: Camera,
    /// The settings of the picture.
    pub settings: RenderSettings,
    /// The cut whose nodes cluster colours show; `None` for those at [`RenderSettings::cluster_depth`].
    pub clusters: Option<ClusterCut>,
    /// The layout whose counts a heat map shows; `None` for those of the trees that are traced.
    pub layout: Option<LayoutChoice>,
    /// Distance between two lines of [`Shading::Distance`](super::Shading::Distance) in world units.
    pub line_spacing: f32,
    /// Measurements of the newest pass.
    pub stats: FrameStats,
}

/// Measurements taken while tracing a frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FrameStats {
    /// Number of primary rays in the newest sample pass.
    pub primary_rays: u64,
    /// Number of primary rays that hit a surface.
    pub hits: u64,
    /// Wall-clock time of the newest sample pass.
    pub trace_time: Duration,
    /// Container tests per primary ray; `None` if they were not counted.
    pub container_tests_per_ray: Option<f32>,
    /// Primitive tests per primary ray; `None` if they were not counted.
    pub primitive_tests_per_ray: Option<f32>,
    /// Number of samples with a NaN or infinite colour in all passes; they count as black.
    pub nan_samples: u64,
}

impl FrameStats {
    /// Container and primitive tests per primary ray; `None` if they were not counted.
    pub fn tests_per_ray(&self) -> Option<[f32; 2]> {
        Some([self.container_tests_per_ray?, self.primitive_tests_per_ray?])
    }
}

impl Frame {
    /// View depth of the background.
    pub const NO_HIT: f32 = 1e30;

    /// Exposure and openness with which the picture is shown.
    pub const fn metered(&self) -> Metered {
        Metered { stops: self.exposure_stops, openness: self.openness }
    }

    /// Primary rays of the newest pass in Mray/s, shading included.
    pub fn mrays_per_s(&self) -> f64 {
        let seconds = self.stats.trace_time.as_secs_f64();
        if seconds > 0.0 { self.stats.primary_rays as f64 / seconds / 1e6 } else { 0.0 }
    }

    /// Its rays, as the source of the numbers of its tree.
    pub fn reading(&self) -> TraceReading {
        TraceReading {
            rays: self.stats.primary_rays,
            hits: self.stats.hits,
            entering: None,
            tests: self.stats.tests_per_ray(),
            binary: Some(Times::single(self.stats.trace_time.as_secs_f64() * 1e3)),
            wide: None,
            picture_mrays_per_s: Some(self.mrays_per_s()),
        }
    }

    /// The layout that a heat map counts, to follow what is counted: " in 8 optimal, f32, leaves 4"; empty for the trees that are traced.
    pub fn in_layout(&self) -> String {
        self.layout.map_or_else(String::new, |layout| format!(" in {}", NamedLayout::from(layout).name()))
    }

    /// Index of the traced pixel that covers the requested pixel (x, y).
    pub fn index_of(&self, x_px: u32, y_px: u32) -> usize {
        let traced = |pixel: u32| ((pixel as f32 + 0.5) / self.coarseness) as u32;
        let (x, y) = (traced(x_px).min(self.width_px - 1), traced(y_px).min(self.height_px - 1));
        (y * self.width_px + x) as usize
    }
}

#[cfg(test)]
impl Frame {
    /// A row of black pixels with these values, for tests.
    pub(crate) fn of_values(settings: RenderSettings, values: Vec<f32>) -> Self {
        let count = values.len();
        Self {
            width_px: count as u32,
            height_px: 1,
            coarseness: 1.0,
            rgba: vec![[0, 0, 0, 255]; count],
            depth: vec![1.0; count],
            distance: vec![1.0; count],
            primitive: vec![0; count],
            values,
            value_range: [0.0, 1.0],
            samples: 1,
            exposure_stops: 0.0,
            openness: Vec3::ONE,
            is_adapted: true,
            camera: Camera::framing(&bvhscope_engine::geometry::Aabb::EMPTY, Vec3::Y),
            settings,
            clusters: None,
            layout: None,
            line_spacing: 1.0,
            stats: FrameStats::default(),
        }
    }
}
