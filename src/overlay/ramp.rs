//! The colour scale of containers: its range, its ramp and its legend, shared by shader and window.

use crate::overlay::node_table::NodeTable;
use crate::overlay::settings::{ColorBy, OverlaySettings};

/// Number of colours of the ramp, between which window and shader interpolate.
pub const RAMP_STOPS: usize = 16;

/// The colour map viridis (Smith and van der Walt, 2015) at evenly spaced positions, sRGB bytes.
const VIRIDIS: [[u8; 3]; RAMP_STOPS] = [
    [68, 1, 84],
    [72, 26, 108],
    [71, 47, 125],
    [65, 68, 135],
    [57, 86, 140],
    [49, 104, 142],
    [42, 120, 142],
    [35, 136, 142],
    [31, 152, 139],
    [34, 168, 132],
    [53, 183, 121],
    [84, 197, 104],
    [122, 209, 81],
    [165, 219, 54],
    [210, 226, 27],
    [253, 231, 37],
];

/// Start of the part of viridis that is used: darker lines would not show on a dark background.
const DARKEST: f32 = 0.22;

/// Position on the ramp of a single depth, which stands out from background and surfaces.
const SINGLE: f32 = 0.72;

/// The legend of the colour scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Legend {
    /// The quantity that colours encode.
    pub title: &'static str,
    /// Positions along the ramp, 0 to 1 and ascending, with their labels.
    pub stops: Vec<(f32, String)>,
}

impl Legend {
    /// The colour of the lines at `position`, clamped to 0..1, as sRGB bytes.
    pub fn color(&self, position: f32) -> [u8; 3] {
        ramp(position)
    }
}

/// The colour at `position` between 0 and 1: the bright part of viridis, as sRGB bytes.
pub fn ramp(position: f32) -> [u8; 3] {
    let place = (DARKEST + (1.0 - DARKEST) * position.clamp(0.0, 1.0)) * (RAMP_STOPS - 1) as f32;
    let stop = (place as usize).min(RAMP_STOPS - 2);
    let blend = place - stop as f32;
    std::array::from_fn(|channel| {
        let [a, b] = [stop, stop + 1].map(|stop| f32::from(VIRIDIS[stop][channel]));
        (a + (b - a) * blend).round() as u8
    })
}

/// The ramp's colours for the shader, sRGB RGBA, 0 to 1.
#[cfg(feature = "gui")]
pub fn shader_ramp() -> [[f32; 4]; RAMP_STOPS] {
    std::array::from_fn(|stop| {
        let [r, g, b] = ramp(stop as f32 / (RAMP_STOPS - 1) as f32).map(|channel| f32::from(channel) / 255.0);
        [r, g, b, 1.0]
    })
}

/// Smallest and largest value of the scale in the shader's unit: depth, log2 of the relative area, overlap as a fraction, log2
/// of the primitive count. The second is always larger.
pub fn scale(settings: &OverlaySettings, table: &NodeTable) -> [f32; 2] {
    match settings.color_by {
        ColorBy::Depth => {
            let [first, last] = depths(settings, table).map(|depth| depth as f32);
            if first < last { [first, last] } else { [first - SINGLE, first - SINGLE + 1.0] }
        }
        ColorBy::Size => [-20.0, 0.0],
        ColorBy::Overlap => [0.0, 1.0],
        ColorBy::Primitives => {
            let all = if table.is_empty() { 1 } else { table.primitives(0) };
            [0.0, (all as f32).log2().max(1.0)]
        }
    }
}

/// First and last depth that is drawn.
fn depths(settings: &OverlaySettings, table: &NodeTable) -> [u32; 2] {
    let [a, b] = settings.depth.map(|depth| depth.min(table.max_depth()));
    [if settings.parents { 0 } else { a.min(b) }, a.max(b)]
}

/// The legend of `table` drawn with `settings`.
pub fn legend(settings: &OverlaySettings, table: &NodeTable) -> Legend {
    let [low, high] = scale(settings, table);
    let at = |value: f32| (value - low) / (high - low);
    match settings.color_by {
        ColorBy::Depth => {
            let [first, last] = depths(settings, table);
            // At most six evenly spaced numbers.
            let step = (last - first).div_ceil(5).max(1) as usize;
            let mut stops: Vec<_> =
                (first..=last).step_by(step).map(|depth| (at(depth as f32), depth.to_string())).collect();
            if let Some((place, _)) = stops.last()
                && at(last as f32) - place > 0.08
            {
                stops.push((at(last as f32), last.to_string()));
            }
            Legend { title: "Depth", stops }
        }
        ColorBy::Size => {
            let shares = [(1e-6, "≤ 0.0001 %"), (1e-4, "0.01 %"), (1e-2, "1 %"), (1.0, "100 %")];
            let stops = shares.map(|(share, label): (f32, _)| (at(share.log2()).max(0.0), label.to_owned()));
            Legend { title: "Area over the root's", stops: stops.to_vec() }
        }
        ColorBy::Overlap => {
            let stops = [0, 25, 50, 75, 100].map(|percent| (percent as f32 / 100.0, format!("{percent} %")));
            Legend { title: "Overlap with the sibling", stops: stops.to_vec() }
        }
        ColorBy::Primitives => {
            let decades = (0..10).map(|exponent| 10_u32.pow(exponent));
            let stops = decades
                .map(|count| (at((count as f32).log2()), count))
                .filter(|(place, _)| *place <= 1.0)
                .map(|(place, count)| (place, short(count)))
                .collect();
            Legend { title: "Triangles below", stops }
        }
    }
}

/// A power of ten as 1, 10, 100, 1k, 10k, 100k, 1M.
fn short(count: u32) -> String {
    match count {
        1_000_000.. => format!("{}M", count / 1_000_000),
        1_000.. => format!("{}k", count / 1_000),
        _ => count.to_string(),
    }
}
