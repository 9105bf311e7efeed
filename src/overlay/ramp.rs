//! The colour scale of containers: its ramp and its meaning, shared by shader and window.

use crate::catalog::metric_scale::MetricScale;
use crate::catalog::metrics;
use crate::colors::ColorMap;

/// Number of colours of the ramp between which the shader interpolates.
#[cfg(feature = "gui")]
pub const RAMP_STOPS: usize = 16;

/// Start of the part of viridis that is used: darker lines would not show on a dark background.
const DARKEST: f32 = 0.22;
/// End of the part that is used: pure yellow would outshine the selection.
const BRIGHTEST: f32 = 0.86;
/// The meaning of the places of nodes on the ramp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ColorScale {
    /// Values of a metric.
    Metric(MetricScale),
    /// 0 for nodes that another tree has too, 1 for the others.
    Survival,
    /// 0 for plain, 0.5 for fitted and 1 for skewed boxes.
    Planes,
}

impl ColorScale {
    /// Places stand for depths, whose levels are told apart by lightness too.
    pub fn is_by_depth(&self) -> bool {
        matches!(self, Self::Metric(scale) if scale.metric == metrics::DEPTH)
    }
}

/// The colour at `position` between 0 and 1, clamped: the middle part of viridis, as sRGB bytes.
pub fn ramp(position: f32) -> [u8; 3] {
    ColorMap::Viridis.srgb(DARKEST + (BRIGHTEST - DARKEST) * position.clamp(0.0, 1.0))
}

/// The ramp's colours for the shader, sRGB RGBA, 0 to 1.
#[cfg(feature = "gui")]
pub fn shader_ramp() -> [[f32; 4]; RAMP_STOPS] {
    std::array::from_fn(|stop| {
        let [r, g, b] = ramp(stop as f32 / (RAMP_STOPS - 1) as f32).map(|channel| f32::from(channel) / 255.0);
        [r, g, b, 1.0]
    })
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
}
