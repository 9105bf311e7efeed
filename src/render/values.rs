//! Frames whose colours encode values: range, colouring and histogram, without tracing again.

use super::frame::Frame;
use super::settings::{Background, Shading};
use crate::colors::ColorMap;
use crate::colors::srgb::Encoder;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::kernel::parallel::par_tasks;

/// Entries of the lookup table from values to colours.
const TABLE_STEPS: usize = 1023;

/// Poll for cancellation every this many values.
const LOOKED_AT_ONCE: usize = 1 << 16;

impl Frame {
    /// The range fitted to the values. Heat maps: 0 to the 99.5th percentile, at least 1, so that a few extreme pixels do not
    /// darken all others. Depth: nearest to farthest hit. `[0, 1]` if there are no values.
    pub fn fitted_range(&self, token: &CancelToken) -> Result<[f32; 2], Cancelled> {
        if self.values.is_empty() {
            return Ok([0.0, 1.0]);
        }
        if matches!(self.settings.shading, Shading::Heat(_)) {
            let rank = ((self.values.len() - 1) as f64 * 0.995).round() as usize;
            return Ok([0.0, nth_smallest(&self.values, rank, token)?.max(1.0)]);
        }
        let [mut low, mut high] = [f32::INFINITY, f32::NEG_INFINITY];
        for values in self.values.chunks(LOOKED_AT_ONCE) {
            token.check()?;
            let hits = values.iter().filter(|&&value| value < Self::NO_HIT);
            [low, high] = hits.fold([low, high], |[low, high], &x| [low.min(x), high.max(x)]);
        }
        Ok(if low < high {
            [low, high]
        } else if low.is_finite() {
            [low, low + low.abs().max(1e-6)]
        } else {
            [0.0, 1.0]
        })
    }

    /// Recolours the values; `None` fits the range. Does nothing if there are no values. If cancelled, some pixels keep their
    /// old colours.
    pub fn recolor(&mut self, range: Option<[f32; 2]>, map: ColorMap, token: &CancelToken) -> Result<(), Cancelled> {
        if self.values.is_empty() {
            return Ok(());
        }
        let [low, high] = match range {
            Some(range) => range,
            None => self.fitted_range(token)?,
        };
        self.value_range = [low, high];
        self.settings.color_map = map;
        if matches!(self.settings.shading, Shading::Heat(_)) {
            self.settings.heat_range = range;
        }
        let table: Vec<[u8; 4]> = (0..=TABLE_STEPS)
            .map(|step| {
                let [r, g, b] = self.settings.value_color(step as f32 / TABLE_STEPS as f32);
                [r, g, b, 255]
            })
            .collect();
        let scale = TABLE_STEPS as f32 / (high - low).max(f32::MIN_POSITIVE);
        let (encoder, width, height) = (Encoder::default(), self.width_px as usize, self.height_px as f32);
        let (values, settings) = (&self.values, &self.settings);
        let rows = self.rgba.chunks_mut(width).zip(values.chunks(width)).enumerate();
        par_tasks(rows, token, |(y, (rgba, values)), _| {
            // The background has no depth and keeps its colour.
            let behind = match settings.background {
                Background::Transparent => [0; 4],
                background => encoder.rgba(background.color((y as f32 + 0.5) / height)),
            };
            let keeps_background = settings.shading.is_length();
            for (pixel, &value) in rgba.iter_mut().zip(values) {
                *pixel = if keeps_background && value >= Self::NO_HIT {
                    behind
                } else {
                    table[(((value - low) * scale + 0.5) as usize).min(TABLE_STEPS)]
                };
            }
            Ok(())
        })
        .map(drop)
    }
}

/// The value of zero-based `rank` in the order of [`f32::total_cmp`], found by radix selection.
pub(crate) fn nth_smallest(values: &[f32], mut rank: usize, token: &CancelToken) -> Result<f32, Cancelled> {
    const DIGIT_BITS: u32 = 16;
    // Bit patterns that order like the numbers.
    let bits = |value: f32| {
        let bits = value.to_bits();
        if bits >> 31 == 0 { bits | 1 << 31 } else { !bits }
    };
    let mut leading = 0;
    for shift in [DIGIT_BITS, 0] {
        let mut counts = vec![0_usize; 1 << DIGIT_BITS];
        for values in values.chunks(LOOKED_AT_ONCE) {
            token.check()?;
            for &value in values {
                let digits = bits(value) >> shift;
                if shift > 0 || digits >> DIGIT_BITS == leading {
                    counts[digits as usize % (1 << DIGIT_BITS)] += 1;
                }
            }
        }
        let mut digit = 0;
        while rank >= counts[digit as usize] {
            rank -= counts[digit as usize];
            digit += 1;
        }
        leading = leading << DIGIT_BITS | digit;
    }
    Ok(f32::from_bits(if leading >> 31 == 1 { leading & !(1 << 31) } else { !leading }))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::render::settings::{HeatKind, RenderSettings};

    fn frame(shading: Shading, values: Vec<f32>) -> Frame {
        let rgba = vec![[1, 2, 3, 255]; values.len()];
        Frame { rgba, ..Frame::of_values(RenderSettings { shading, ..RenderSettings::default() }, values) }
    }

    #[test]
    fn ranks_are_those_of_the_sorted_values() {
        let mut values: Vec<f32> = (0..3_000_u32).map(|k| f32::from_bits(k.wrapping_mul(0x9E37_79B9))).collect();
        values.extend([0.0, -0.0, 1.0, 1.0, 1.5, f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY]);
        let mut sorted = values.clone();
        sorted.sort_unstable_by(f32::total_cmp);
        for (rank, expected) in sorted.iter().enumerate() {
            let found = nth_smallest(&values, rank, &CancelToken::new()).unwrap();
            assert_eq!(found.to_bits(), expected.to_bits(), "{rank}");
        }
    }

    const HEAT: Shading = Shading::Heat(HeatKind::Both);

    #[test]
    fn a_few_extreme_pixels_do_not_stretch_the_fitted_range() {
        let mut values = vec![10.0; 999];
        values.push(5000.0);
        let frame = frame(HEAT, values);
        assert_eq!(frame.fitted_range(&CancelToken::new()), Ok([0.0, 10.0]));
    }

    /// The values 0 to 1000 in any order: 995 is the 99.5th percentile.
    #[test]
    fn heat_ranges_end_at_the_percentile() {
        let range = |values: Vec<f32>| frame(HEAT, values).fitted_range(&CancelToken::new()).unwrap();
        assert_eq!(range((0..=1000_u32).map(|k| (k * 5 % 1001) as f32).collect()), [0.0, 995.0]);
        // Ranks are rounded: of 0 to 100 the rank 99.5 is the hundredth.
        assert_eq!(range((0..=100_u8).map(f32::from).collect()), [0.0, 100.0]);
        assert_eq!(range(vec![0.25; 9]), [0.0, 1.0], "at least 1");
    }

    #[test]
    fn depth_ranges_are_those_of_the_hits() {
        let range = |values: Vec<f32>| frame(Shading::Depth, values).fitted_range(&CancelToken::new()).unwrap();
        assert_eq!(range(vec![7.0, Frame::NO_HIT, 3.0, 5.0]), [3.0, 7.0]);
        assert_eq!(range(vec![4.0, Frame::NO_HIT]), [4.0, 8.0], "one depth");
        assert_eq!(range(vec![Frame::NO_HIT]), [0.0, 1.0]);
        assert_eq!(range(Vec::new()), [0.0, 1.0]);
    }

    #[test]
    fn values_at_the_ends_of_the_range_get_the_ends_of_the_map() {
        let mut frame = frame(HEAT, vec![0.0, 10.0, 20.0, 40.0]);
        frame.recolor(Some([10.0, 20.0]), ColorMap::Viridis, &CancelToken::new()).unwrap();
        let [low, high] = [0.0, 1.0].map(|end| ColorMap::Viridis.srgb(end));
        let colors: Vec<[u8; 3]> = frame.rgba.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
        assert_eq!(colors, [low, low, high, high]);
        assert_eq!(frame.value_range, [10.0, 20.0]);
    }

    #[test]
    fn frames_keep_the_range_and_map_of_their_colors() {
        let mut heat = frame(HEAT, vec![10.6, Frame::NO_HIT, 1023.0]);
        heat.recolor(Some([0.0, 1023.0]), ColorMap::Turbo, &CancelToken::new()).unwrap();
        assert_eq!((heat.settings.color_map, heat.settings.heat_range), (ColorMap::Turbo, Some([0.0, 1023.0])));
        // The nearest of the 1023 steps; a count has no background.
        let expected = [11.0 / 1023.0, 1.0, 1.0].map(|value| ColorMap::Turbo.srgb(value));
        let colors: Vec<[u8; 3]> = heat.rgba.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
        assert_eq!(colors, expected);
        heat.recolor(None, ColorMap::Inferno, &CancelToken::new()).unwrap();
        assert_eq!(heat.settings.heat_range, None, "fitted again");
    }

    #[test]
    fn what_has_no_depth_keeps_the_background() {
        let mut frame = frame(Shading::Depth, vec![2.0, Frame::NO_HIT, 5.0]);
        frame.recolor(None, ColorMap::Inferno, &CancelToken::new()).unwrap();
        assert_eq!(frame.value_range, [2.0, 5.0]);
        assert_eq!(frame.rgba[1], Encoder::default().rgba(Background::Dark.color(0.5)));
        assert_ne!(frame.rgba[0], frame.rgba[2]);
        let nearest: u32 = frame.rgba[0][..3].iter().map(|&channel| u32::from(channel)).sum();
        assert!(nearest > 120, "the nearest surface looks like a hole: {:?}", frame.rgba[0]);
    }

    #[test]
    fn degenerate_values_and_ranges_give_finite_ranges() {
        for values in [vec![Frame::NO_HIT], vec![3.0], vec![3.0, 3.0]] {
            let mut frame = frame(Shading::Depth, values);
            frame.recolor(None, ColorMap::Turbo, &CancelToken::new()).unwrap();
            let [low, high] = frame.value_range;
            assert!(low < high && high.is_finite(), "{low} {high}");
        }
        let mut upside_down = frame(HEAT, vec![0.0, 3.0]);
        upside_down.recolor(Some([2.0, 2.0]), ColorMap::Turbo, &CancelToken::new()).unwrap();
        upside_down.recolor(Some([f32::NAN, f32::INFINITY]), ColorMap::Turbo, &CancelToken::new()).unwrap();
        assert!(upside_down.rgba.iter().all(|pixel| pixel[3] == 255));
    }

    #[test]
    fn pictures_without_values_stay_as_they_are() {
        let mut frame = frame(Shading::Lit, Vec::new());
        frame.rgba = vec![[1, 2, 3, 255]];
        frame.recolor(None, ColorMap::Turbo, &CancelToken::new()).unwrap();
        assert_eq!(frame.rgba, [[1, 2, 3, 255]]);
    }
}
