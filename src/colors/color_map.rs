//! Perceptual colour maps.
//!
//! Every fifth colour of the published 256 with linear interpolation: at most one byte off the original. Viridis and
//! inferno by Stéfan van der Walt and Nathaniel Smith (matplotlib, CC0), turbo by Anton Mikhailov (Google, Apache-2.0).

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::srgb;

/// A colour map from 0..1 to RGB.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ColorMap {
    /// Blue to yellow, uniform in perceived lightness.
    Viridis,
    /// Black to white through red.
    Inferno,
    /// A rainbow with improved perceptual order.
    Turbo,
}

impl ColorMap {
    /// All maps, in the order of menus.
    pub const ALL: [Self; 3] = [Self::Viridis, Self::Inferno, Self::Turbo];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Viridis => "viridis",
            Self::Inferno => "inferno",
            Self::Turbo => "turbo",
        }
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Viridis => "Viridis",
            Self::Inferno => "Inferno",
            Self::Turbo => "Turbo",
        }
    }

    /// The colour at `value`, clamped to 0..1 (NaN is 0), as sRGB bytes.
    pub fn srgb(self, value: f32) -> [u8; 3] {
        self.at(value).to_array().map(|component| (component + 0.5) as u8)
    }

    /// The colour at `value`, clamped to 0..1 (NaN is 0), as linear RGB.
    pub fn linear(self, value: f32) -> Vec3 {
        (self.at(value) / 255.0).map(srgb::decode)
    }

    /// The colour in sRGB, 0 to 255.
    fn at(self, value: f32) -> Vec3 {
        let knots = match self {
            Self::Viridis => &VIRIDIS,
            Self::Inferno => &INFERNO,
            Self::Turbo => &TURBO,
        };
        let value = if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) };
        let position = value * (KNOTS - 1) as f32;
        let knot = (position as usize).min(KNOTS - 2);
        let color = |[r, g, b]: [u8; 3]| Vec3::new(f32::from(r), f32::from(g), f32::from(b));
        color(knots[knot]).lerp(color(knots[knot + 1]), position - knot as f32)
    }
}

const KNOTS: usize = 52;

#[rustfmt::skip]
const VIRIDIS: [[u8; 3]; KNOTS] = [
    [68, 1, 84], [70, 8, 92], [71, 16, 99], [72, 23, 105], [72, 29, 111], [72, 36, 117],
    [71, 42, 122], [70, 48, 126], [69, 55, 129], [67, 61, 132], [65, 66, 135], [63, 72, 137],
    [61, 78, 138], [58, 83, 139], [56, 89, 140], [53, 94, 141], [51, 99, 141], [49, 104, 142],
    [46, 109, 142], [44, 113, 142], [42, 118, 142], [41, 123, 142], [39, 128, 142], [37, 132, 142],
    [35, 137, 142], [33, 142, 141], [32, 146, 140], [31, 151, 139], [30, 156, 137], [31, 161, 136],
    [33, 165, 133], [36, 170, 131], [40, 174, 128], [46, 179, 124], [53, 183, 121], [61, 188, 116],
    [70, 192, 111], [80, 196, 106], [90, 200, 100], [101, 203, 94], [112, 207, 87], [124, 210, 80],
    [137, 213, 72], [149, 216, 64], [162, 218, 55], [176, 221, 47], [189, 223, 38], [202, 225, 31],
    [216, 226, 25], [229, 228, 25], [241, 229, 29], [253, 231, 37],
];

#[rustfmt::skip]
const INFERNO: [[u8; 3]; KNOTS] = [
    [0, 0, 4], [2, 2, 12], [5, 4, 23], [10, 7, 34], [16, 9, 45], [22, 11, 57],
    [30, 12, 69], [38, 12, 81], [47, 10, 91], [56, 9, 98], [64, 10, 103], [73, 11, 106],
    [81, 14, 108], [89, 16, 110], [97, 19, 110], [105, 22, 110], [113, 25, 110], [120, 28, 109],
    [128, 31, 108], [136, 34, 106], [144, 37, 104], [152, 39, 102], [160, 42, 99], [168, 46, 95],
    [176, 49, 91], [183, 53, 87], [191, 57, 82], [198, 61, 77], [204, 66, 72], [211, 71, 67],
    [217, 77, 61], [223, 83, 55], [228, 90, 49], [233, 97, 43], [237, 105, 37], [241, 113, 31],
    [244, 121, 24], [247, 130, 18], [249, 139, 11], [250, 148, 7], [251, 157, 7], [252, 166, 12],
    [252, 176, 20], [251, 186, 31], [250, 196, 42], [248, 205, 55], [246, 215, 70], [244, 225, 86],
    [242, 234, 105], [242, 242, 125], [245, 249, 146], [252, 255, 164],
];

#[rustfmt::skip]
const TURBO: [[u8; 3]; KNOTS] = [
    [48, 18, 59], [54, 33, 95], [59, 47, 128], [63, 62, 156], [66, 75, 181], [69, 89, 203],
    [70, 102, 221], [71, 115, 235], [70, 128, 246], [69, 140, 253], [64, 153, 255], [56, 165, 251],
    [47, 178, 244], [39, 190, 233], [31, 201, 221], [26, 212, 208], [24, 221, 194], [26, 228, 182],
    [34, 235, 170], [47, 241, 155], [63, 246, 138], [82, 250, 122], [101, 253, 105], [121, 254, 89],
    [139, 255, 75], [156, 254, 64], [169, 251, 57], [183, 247, 53], [195, 241, 52], [208, 234, 52],
    [219, 226, 54], [229, 217, 56], [238, 207, 58], [245, 197, 58], [250, 186, 57], [253, 174, 53],
    [254, 161, 48], [254, 147, 42], [252, 132, 35], [249, 117, 29], [244, 102, 23], [239, 88, 17],
    [232, 75, 12], [225, 65, 9], [216, 55, 6], [206, 45, 4], [195, 37, 3], [183, 29, 2],
    [169, 22, 1], [155, 15, 1], [139, 9, 2], [122, 4, 3],
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_middle_are_the_published_colors() {
        assert_eq!(ColorMap::Viridis.srgb(0.0), [68, 1, 84]);
        assert_eq!(ColorMap::Viridis.srgb(1.0), [253, 231, 37]);
        assert_eq!(ColorMap::Inferno.srgb(0.0), [0, 0, 4]);
        assert_eq!(ColorMap::Inferno.srgb(1.0), [252, 255, 164]);
        assert_eq!(ColorMap::Turbo.srgb(0.0), [48, 18, 59]);
        assert_eq!(ColorMap::Turbo.srgb(1.0), [122, 4, 3]);
        // Entry 128 of matplotlib's 256, which is interpolated here.
        let middle = ColorMap::Viridis.srgb(128.0 / 255.0);
        assert!(middle.iter().zip([33_u8, 145, 140]).all(|(a, b)| a.abs_diff(b) <= 1), "{middle:?}");
    }

    #[test]
    fn bytes_are_rounded_and_linear_colors_decoded() {
        // Three fifths of the way from [68, 1, 84] to [70, 8, 92].
        assert_eq!(ColorMap::Viridis.srgb(0.6 / 51.0), [69, 5, 89]);
        let linear = ColorMap::Viridis.linear(1.0);
        let expected = Vec3::new(253.0, 231.0, 37.0).map(|byte| srgb::decode(byte / 255.0));
        assert!((linear - expected).abs().max_element() < 1e-6, "{linear} instead of {expected}");
    }

    #[test]
    fn values_outside_are_clamped() {
        for map in ColorMap::ALL {
            assert_eq!(map.srgb(-1.0), map.srgb(0.0));
            assert_eq!(map.srgb(f32::INFINITY), map.srgb(1.0));
            assert_eq!(map.srgb(f32::NAN), map.srgb(0.0));
        }
    }

    #[test]
    fn viridis_and_inferno_grow_lighter_all_the_way() {
        for map in [ColorMap::Viridis, ColorMap::Inferno] {
            let lightness = |i: u32| map.linear(i as f32 / 50.0).dot(Vec3::new(0.2126, 0.7152, 0.0722));
            assert!((0..50).all(|i| lightness(i) < lightness(i + 1)), "{map:?}");
        }
    }
}
