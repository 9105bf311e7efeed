//! Accumulated pixels, tile by tile, into a frame, row by row.

use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::kernel::parallel::par_tasks;
use glam::Vec3;

use super::adaptation::Metered;
use super::edges;
use super::frame::{Frame, FrameStats};
use super::grid::Grid;
use super::queries::line_spacing;
use super::request::RenderRequest;
use super::settings::Shading;
use super::tone::tone_map;
use crate::colors::srgb::Encoder;
use crate::vectors::length;

/// Poll for cancellation about every 16,384 pixels.
const PIXELS_PER_CHECK: u32 = 1 << 14;

/// The accumulated samples of a traced pixel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pixel {
    /// Sum of the linear colours of samples that are shown as they are, such as those of the background.
    pub(super) shown: Vec3,
    /// Sum of the linear radiances of all other samples.
    pub(super) radiance: Vec3,
    /// Number of samples in `radiance`.
    pub(super) radiance_samples: u32,
    /// Number of samples that show nothing; a shadow on the ground counts in part.
    pub(super) clear: f32,
    pub(super) depth: f32,
    pub(super) distance: f32,
    pub(super) primitive: u32,
    pub(super) value: f32,
}

impl Pixel {
    /// A pixel before its first sample.
    pub(super) const BLANK: Self = Self {
        shown: Vec3::ZERO,
        radiance: Vec3::ZERO,
        radiance_samples: 0,
        clear: 0.0,
        depth: Frame::NO_HIT,
        distance: f32::INFINITY,
        primitive: u32::MAX,
        value: 0.0,
    };

    /// The mean colour of `samples` samples on a screen as sRGB and opacity: radiance times `exposure` is tone mapped, the rest
    /// covers its part of the pixel unchanged.
    fn on_screen(&self, samples: u32, exposure: f32, encoder: Encoder) -> [u8; 4] {
        let covered = samples as f32 - self.clear;
        if covered <= 0.0 {
            return [0; 4];
        }
        let mut color = self.shown / covered;
        if self.radiance_samples > 0 {
            let count = self.radiance_samples as f32;
            color += tone_map(self.radiance * (exposure / count)) * (count / covered);
        }
        let [r, g, b, _] = encoder.rgba(color);
        [r, g, b, (covered / samples as f32 * 255.0 + 0.5) as u8]
    }

    /// The mean linear radiance of `samples` samples.
    fn linear(&self, samples: u32) -> [f32; 3] {
        ((self.shown + self.radiance) / samples as f32).to_array()
    }
}

/// Linear radiance of each pixel after `samples` samples, row by row, neither exposed nor tone mapped; the background and unlit
/// surfaces have the colours with which they are shown.
pub(super) fn radiance(
    grid: &Grid,
    pixels: &[Vec<Pixel>],
    samples: u32,
    token: &CancelToken,
) -> Result<Vec<[f32; 3]>, Cancelled> {
    Rows { grid, pixels, token }.list(|pixel| pixel.linear(samples))
}

/// Resolves `pixels` of all tiles after `samples` samples into a frame shown with `metered`; values are coloured, edges
/// drawn over them.
pub(super) fn assemble(
    request: &RenderRequest,
    grid: &Grid,
    pixels: &[Vec<Pixel>],
    samples: u32,
    (metered, is_adapted): (Metered, bool),
    stats: FrameStats,
    token: &CancelToken,
) -> Result<Frame, Cancelled> {
    let settings = request.settings;
    let rows = Rows { grid, pixels, token };
    let (exposure, encoder) = (metered.stops.exp2(), Encoder::default());
    let mut frame = Frame {
        width_px: grid.width,
        height_px: grid.height,
        coarseness: grid.coarseness,
        rgba: rows.list(|pixel| pixel.on_screen(samples, exposure, encoder))?,
        depth: rows.list(|pixel| pixel.depth)?,
        distance: rows.list(|pixel| pixel.distance)?,
        primitive: rows.list(|pixel| pixel.primitive)?,
        values: Vec::new(),
        value_range: [0.0, 1.0],
        samples,
        exposure_stops: metered.stops,
        openness: metered.openness,
        is_adapted,
        camera: request.camera,
        settings,
        clusters: request.clusters.clone(),
        layout: request.counted_layout().map(|layout| layout.choice),
        line_spacing: line_spacing(length(request.accel.scene.bounds.extent())),
        stats,
    };
    if settings.shading.has_values() {
        frame.values = rows.list(|pixel| pixel.value)?;
        let range = if matches!(settings.shading, Shading::Heat(_)) { settings.heat_range } else { None };
        frame.recolor(range, settings.color_map, token)?;
        if settings.mesh_edges || settings.shading == Shading::Distance {
            rows.for_each(&mut frame.rgba, |color, pixel| *color = edges::over_value(*color, pixel.shown.x))?;
        }
    }
    Ok(frame)
}

/// Row-by-row access to pixels that are stored tile by tile.
struct Rows<'a> {
    grid: &'a Grid,
    pixels: &'a [Vec<Pixel>],
    token: &'a CancelToken,
}

impl Rows<'_> {
    /// `value` of each pixel, in a list row by row.
    fn list<T: bytemuck::Zeroable + Send>(&self, value: impl Fn(&Pixel) -> T + Sync) -> Result<Vec<T>, Cancelled> {
        let mut list = bytemuck::zeroed_vec(self.grid.width as usize * self.grid.height as usize);
        self.for_each(&mut list, |slot, pixel| *slot = value(pixel))?;
        Ok(list)
    }

    /// Calls `visit` with each slot of `list`, which has one for every pixel, and that pixel. In parallel.
    fn for_each<T: Send>(&self, list: &mut [T], visit: impl Fn(&mut T, &Pixel) + Sync) -> Result<(), Cancelled> {
        let rows = PIXELS_PER_CHECK.div_ceil(self.grid.width);
        let chunks = list.chunks_mut((rows * self.grid.width) as usize).enumerate();
        par_tasks(chunks, self.token, |(chunk, list), _| {
            let first = chunk as u32 * rows;
            for (row, y) in list.chunks_mut(self.grid.width as usize).zip(first..) {
                for (slot, x) in row.iter_mut().zip(0..) {
                    let (tile, within) = self.grid.index(x, y);
                    visit(slot, &self.pixels[tile][within]);
                }
            }
            Ok(())
        })
        .map(drop)
    }
}
