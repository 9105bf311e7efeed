//! Where one tree takes more tests than another: the difference of two heat maps, pixel by pixel.

use std::sync::Arc;

use super::colors::diverging;
use crate::colors::ColorMap;
use crate::render::{Frame, RenderSettings, Shading, nth_smallest};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::kernel::parallel::par_collect;

/// The part of all pixels whose differences lie within the range of the colours.
const PERCENTILE: f64 = 0.99;
/// Entries of the lookup table from differences to colours; odd, so that 0 has one of its own.
const TABLE_STEPS: usize = 1023;

/// Tests of tree B minus tests of tree A in each pixel, with the colours that show them.
#[derive(Debug, Clone)]
pub struct DifferenceMap {
    /// The heat maps of A and of B that it was made from.
    pub frames: [Arc<Frame>; 2],
    /// Tests of B minus tests of A, row by row from the top left.
    pub values: Vec<f32>,
    /// The colours cover the differences from −`limit` to `limit`: the 99th percentile of their magnitudes, at least 1.
    pub limit: f32,
    /// sRGB RGBA of each pixel.
    pub rgba: Arc<Vec<[u8; 4]>>,
    /// Number of pixels with fewer tests in B, with as many, and with more.
    pub pixels: [u64; 3],
}

impl DifferenceMap {
    /// The difference of two heat maps; `None` where they are none, or not of the same rays.
    pub fn new(a: &Arc<Frame>, b: &Arc<Frame>, token: &CancelToken) -> Result<Option<Self>, Cancelled> {
        if !matches!(a.settings.shading, Shading::Heat(_)) || !shows_same_rays(a, b) || a.values.is_empty() {
            return Ok(None);
        }
        let values = par_collect(a.values.len(), token, |pixel| b.values[pixel] - a.values[pixel])?;
        let magnitudes = par_collect(values.len(), token, |pixel| values[pixel].abs())?;
        let rank = ((magnitudes.len() - 1) as f64 * PERCENTILE).round() as usize;
        let limit = nth_smallest(&magnitudes, rank, token)?.max(1.0);
        drop(magnitudes);
        let middle = (TABLE_STEPS / 2) as f32;
        let table: Vec<[u8; 4]> = (0..TABLE_STEPS)
            .map(|step| {
                let [r, g, b] = diverging(step as f32 / middle - 1.0);
                [r, g, b, 255]
            })
            .collect();
        let color = |value: f32| table[((value / limit).clamp(-1.0, 1.0) * middle + middle).round() as usize];
        let rgba = Arc::new(par_collect(values.len(), token, |pixel| color(values[pixel]))?);
        token.check()?;
        let count = |chosen: fn(&f32) -> bool| values.iter().filter(|value| chosen(value)).count() as u64;
        let pixels = [count(|&value| value < 0.0), count(|&value| value == 0.0), count(|&value| value > 0.0)];
        Ok(Some(Self { frames: [Arc::clone(a), Arc::clone(b)], values, limit, rgba, pixels }))
    }

    /// Tests of A, tests of B and their difference at pixel (x, y) of the requested picture.
    pub fn at(&self, x_px: u32, y_px: u32) -> Option<[f32; 3]> {
        let [a, b] = &self.frames;
        let index = a.index_of(x_px, y_px);
        Some([*a.values.get(index)?, *b.values.get(index)?, *self.values.get(index)?])
    }
}

/// Two pictures are of the same rays and show the same quantity.
fn shows_same_rays(a: &Frame, b: &Frame) -> bool {
    // These decide only how values are coloured.
    let compared = |frame: &Frame| RenderSettings { heat_range: None, color_map: ColorMap::Inferno, ..frame.settings };
    a.camera == b.camera
        && [a.width_px, a.height_px] == [b.width_px, b.height_px]
        && a.coarseness == b.coarseness
        && compared(a) == compared(b)
        && a.values.len() == b.values.len()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::render::HeatKind;

    fn heat(values: Vec<f32>) -> Arc<Frame> {
        let settings = RenderSettings { shading: Shading::Heat(HeatKind::Both), ..RenderSettings::default() };
        Arc::new(Frame::of_values(settings, values))
    }

    fn map(a: &Arc<Frame>, b: &Arc<Frame>) -> Option<DifferenceMap> {
        DifferenceMap::new(a, b, &CancelToken::new()).unwrap()
    }

    #[test]
    fn differences_are_those_of_b_minus_a() {
        let map = map(&heat(vec![10.0, 20.0, 30.0, 0.0]), &heat(vec![14.0, 20.0, 26.0, 1.0])).unwrap();
        assert_eq!(map.values, [4.0, 0.0, -4.0, 1.0]);
        assert_eq!((map.limit, map.pixels), (4.0, [1, 1, 2]));
        assert_eq!(map.at(2, 0), Some([30.0, 26.0, -4.0]));
        let color = |part: f32| diverging(part);
        let shown: Vec<[u8; 3]> = map.rgba.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
        assert_eq!(shown[..3], [color(1.0), color(0.0), color(-1.0)]);
    }

    #[test]
    fn the_range_is_symmetric_and_leaves_out_a_few_extreme_pixels() {
        let a = heat(vec![0.0; 1001]);
        let mut b: Vec<f32> = (0..1001_u32).map(|k| if k % 2 == 0 { 0.0 } else { -7.0 }).collect();
        b[0] = 5000.0;
        assert_eq!(map(&a, &heat(b)).unwrap().limit, 7.0);
        assert_eq!(map(&a, &heat(vec![0.0; 1001])).unwrap().limit, 1.0, "at least 1");
        // Of the magnitudes 0 to 1000, 990 is the 99th percentile.
        let ramp = (0..1001_u32).map(|k| if k % 2 == 0 { k as f32 } else { -(k as f32) }).collect();
        assert_eq!(map(&a, &heat(ramp)).unwrap().limit, 990.0);
    }

    #[test]
    fn equal_trees_differ_nowhere() {
        let a = heat(vec![3.0, 500.0, 12.0]);
        let map = map(&a, &a).unwrap();
        assert_eq!((map.values.as_slice(), map.pixels), (&[0.0; 3][..], [0, 3, 0]));
        let [r, g, b] = diverging(0.0);
        assert!(map.rgba.iter().all(|&pixel| pixel == [r, g, b, 255]));
    }

    #[test]
    fn pictures_of_other_rays_have_no_difference() {
        let a = heat(vec![1.0, 2.0]);
        let changed = |change: &dyn Fn(&mut Frame)| {
            let mut frame = (*a).clone();
            change(&mut frame);
            map(&a, &Arc::new(frame)).is_some()
        };
        assert!(changed(&|frame| frame.settings.heat_range = Some([0.0, 9.0])), "only the colours");
        assert!(!changed(&|frame| frame.camera.eye.x += 0.5));
        assert!(!changed(&|frame| frame.coarseness = 2.0));
        assert!(!changed(&|frame| frame.settings.shading = Shading::Heat(HeatKind::Containers)));
        assert!(!changed(&|frame| (frame.width_px, frame.height_px) = (1, 2)));
        let lit = |frame: &Frame| Frame { settings: RenderSettings::default(), ..frame.clone() };
        assert!(map(&Arc::new(lit(&a)), &Arc::new(lit(&a))).is_none(), "no counts");
    }
}
