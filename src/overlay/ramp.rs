//! The colour scale of containers: its range, its ramp and its legend, shared by shader and window.

use crate::overlay::node_table::{NodeTable, Shown};
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
/// End of the part that is used: pure yellow would outshine the selection.
const BRIGHTEST: f32 = 0.86;

/// The legend of the colour scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Legend {
    /// The quantity that colours encode.
    pub title: &'static str,
    /// Positions along the ramp, 0 to 1 and ascending, with their labels.
    pub stops: Vec<(f32, String)>,
    /// The part of the ramp that the drawn containers have colours of, for depths.
    pub drawn: Option<[f32; 2]>,
}

impl Legend {
    /// The colour of the lines at `position`, clamped to 0..1, as sRGB bytes.
    pub fn color(&self, position: f32) -> [u8; 3] {
        ramp(position)
    }
}

/// The colour at `position` between 0 and 1: the middle part of viridis, as sRGB bytes.
pub fn ramp(position: f32) -> [u8; 3] {
    let place = (DARKEST + (BRIGHTEST - DARKEST) * position.clamp(0.0, 1.0)) * (RAMP_STOPS - 1) as f32;
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

/// The legend of the containers `shown` of `table` with `settings`.
pub fn legend(settings: &OverlaySettings, table: &NodeTable, shown: &Shown) -> Legend {
    let [low, high] = shown.scale;
    let at = |value: f32| shown.place(value);
    match settings.color_by {
        ColorBy::Depth => {
            let last = table.max_depth();
            let at = |depth: u32| at((depth as f32).sqrt());
            let [first_drawn, last_drawn] = table.drawn_depths(settings);
            let drawn = Some([at(if settings.parents { 0 } else { first_drawn }), at(last_drawn)]);
            // Evenly spaced on the ramp, which runs with the square root of the depth.
            let mut depths: Vec<u32> = (0..=4).map(|step| (last * step * step + 8) / 16).collect();
            depths.dedup();
            let stops = depths.into_iter().map(|depth| (at(depth), depth.to_string())).collect();
            Legend { title: "Depth", stops, drawn }
        }
        ColorBy::Size | ColorBy::Regret => {
            let percent = |value: f32| value.exp2() * 100.0;
            let powers = (-10..=2).map(|exponent| 10_f32.powi(exponent));
            let stops = powers.map(|percent| ((percent / 100.0).log2(), percent_text(percent)));
            let ends = [low, high].map(|value| (value, percent_text(percent(value))));
            let title = if settings.color_by == ColorBy::Size { "Area over the root's" } else { "Regret" };
            Legend { title, stops: thinned(stops, ends, [low, high]), drawn: None }
        }
        ColorBy::Growth => {
            let powers = (-8..=16).map(|exponent| exponent as f32);
            let text = |value: f32| format!("{} ×", short_ratio(value.exp2()));
            let ends = [low, high].map(|value| (value, text(value)));
            let stops = powers.map(|value| (value, text(value)));
            Legend { title: "Area over that when built", stops: thinned(stops, ends, [low, high]), drawn: None }
        }
        ColorBy::Overlap => {
            let stops = [0, 25, 50, 75, 100].map(|percent| (percent as f32 / 100.0, format!("{percent} %")));
            Legend { title: "Overlap of the children", stops: stops.to_vec(), drawn: None }
        }
        ColorBy::Survival => {
            let stops = vec![(0.0, "in both trees".to_owned()), (1.0, "in this one only".to_owned())];
            Legend { title: "Nodes of both trees", stops, drawn: None }
        }
        ColorBy::Planes => {
            let stops = vec![(0.0, "plain".to_owned()), (0.5, "fitted".to_owned()), (1.0, "skewed".to_owned())];
            Legend { title: "Planes of the box", stops, drawn: None }
        }
        ColorBy::Primitives => {
            let powers = (0..10).map(|exponent| 10_u32.pow(exponent));
            let stops = powers.map(|count| ((count as f32).log2(), short(count)));
            let ends = [low, high].map(|value| (value, short(value.exp2().round() as u32)));
            Legend { title: "Triangles below", stops: thinned(stops, ends, [low, high]), drawn: None }
        }
    }
}

/// The `stops` within the range with their places on the ramp, or its `ends` where fewer than two lie within; at most six.
fn thinned(
    stops: impl Iterator<Item = (f32, String)>,
    ends: [(f32, String); 2],
    [low, high]: [f32; 2],
) -> Vec<(f32, String)> {
    let mut within: Vec<_> = stops.filter(|(value, _)| (low..=high).contains(value)).collect();
    if within.len() < 2 {
        within = ends.into();
    }
    let step = within.len().div_ceil(6);
    within
        .into_iter()
        .step_by(step)
        .map(|(value, text)| (((value - low) / (high - low)).clamp(0.0, 1.0), text))
        .collect()
}

/// A percentage with up to two significant digits.
fn percent_text(percent: f32) -> String {
    let digits = (1 - percent.max(1e-12).log10().floor() as i32).clamp(0, 12) as usize;
    let text = format!("{percent:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    format!("{text} %")
}

/// A ratio with up to two decimals.
fn short_ratio(ratio: f32) -> String {
    let text = format!("{ratio:.2}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// A count in few characters: 1, 10, 100, 1k, 10k, 100k, 1M.
fn short(count: u32) -> String {
    match count {
        1_000_000.. => format!("{}M", count / 1_000_000),
        1_000.. => format!("{}k", count / 1_000),
        _ => count.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ramp_ends_before_yellow() {
        for step in 0..=20 {
            let [r, g, _] = ramp(step as f32 / 20.0);
            assert!(r < 190 && g < 225, "{r} {g}");
        }
    }

    #[test]
    fn percentages_are_short() {
        let texts = [100.0, 12.3, 1.0, 0.25, 0.001].map(percent_text);
        assert_eq!(texts, ["100 %", "12 %", "1 %", "0.25 %", "0.001 %"]);
    }
}
