//! Frames whose colours stand for numbers: ranges, colouring and histograms, all without tracing anything again.

use rayon::prelude::*;

use super::srgb::Encoder;
use super::view::background;
use super::{ColorMap, Frame, Shading};

/// Colours in the table that values are looked up in.
const TABLE_STEPS: usize = 1023;

impl Frame {
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
        if low < high {
            [low, high]
        } else if low.is_finite() {
            [low, low + low.abs().max(1e-6)]
        } else {
            [0.0, 1.0]
        }
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::geometry::Aabb;
    use crate::render::{FrameStats, HeatKind, RenderSettings};

    fn frame(shading: Shading, values: Vec<f32>) -> Frame {
        let count = values.len();
        Frame {
            width_px: count as u32,
            height_px: 1,
            coarseness: 1,
            rgba: vec![[1, 2, 3, 255]; count],
            depth: vec![1.0; count],
            distance: vec![1.0; count],
            primitive: vec![0; count],
            values,
            value_range: [0.0, 1.0],
            samples: 1,
            camera: Camera::framing(&Aabb::EMPTY, glam::Vec3::Y),
            settings: RenderSettings { shading, ..RenderSettings::default() },
            stats: FrameStats::default(),
        }
    }

    const HEAT: Shading = Shading::Heat(HeatKind::Both);

    #[test]
    fn a_few_extreme_pixels_do_not_stretch_the_fitted_range() {
        let mut values = vec![10.0; 999];
        values.push(5000.0);
        let frame = frame(HEAT, values);
        assert_eq!(frame.fitted_range(), [0.0, 10.0]);
    }

    #[test]
    fn values_at_the_ends_of_the_range_get_the_ends_of_the_map() {
        let mut frame = frame(HEAT, vec![0.0, 10.0, 20.0, 40.0]);
        frame.recolor(Some([10.0, 20.0]), ColorMap::Viridis);
        let [low, high] = [0.0, 1.0].map(|end| ColorMap::Viridis.srgb(end));
        let colors: Vec<[u8; 3]> = frame.rgba.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
        assert_eq!(colors, [low, low, high, high]);
        assert_eq!(frame.value_range, [10.0, 20.0]);
    }

    #[test]
    fn what_has_no_depth_keeps_the_background() {
        let mut frame = frame(Shading::Depth, vec![2.0, Frame::NO_HIT, 5.0]);
        frame.recolor(None, ColorMap::Inferno);
        assert_eq!(frame.value_range, [2.0, 5.0]);
        assert_eq!(frame.rgba[1], Encoder::new().rgba(background(0.5)));
        assert_ne!(frame.rgba[0], frame.rgba[2]);
    }

    #[test]
    fn degenerate_values_and_ranges_give_finite_ranges() {
        for values in [vec![Frame::NO_HIT], vec![3.0], vec![3.0, 3.0]] {
            let mut frame = frame(Shading::Depth, values);
            frame.recolor(None, ColorMap::Turbo);
            let [low, high] = frame.value_range;
            assert!(low < high && high.is_finite(), "{low} {high}");
        }
        let mut upside_down = frame(HEAT, vec![0.0, 3.0]);
        upside_down.recolor(Some([2.0, 2.0]), ColorMap::Turbo);
        upside_down.recolor(Some([f32::NAN, f32::INFINITY]), ColorMap::Turbo);
        assert!(upside_down.rgba.iter().all(|pixel| pixel[3] == 255));
    }

    #[test]
    fn pictures_without_values_stay_as_they_are() {
        let mut frame = frame(Shading::Lit, Vec::new());
        frame.rgba = vec![[1, 2, 3, 255]];
        frame.recolor(None, ColorMap::Turbo);
        assert_eq!(frame.rgba, [[1, 2, 3, 255]]);
    }
}
