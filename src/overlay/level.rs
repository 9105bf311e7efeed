//! Levels drawn together are told apart by width and lightness: the first is wide and light, the last narrow and dark.

/// Width of the lines of the first and of the last level, relative to the chosen one.
pub(super) const WIDEST: f32 = 1.4;
pub(super) const NARROWEST: f32 = 0.6;
/// Share of white in the colour of the first level.
pub(super) const LIGHTEST: f32 = 0.4;
/// Share of black in the colour of the last level.
pub(super) const DARKEST: f32 = 0.3;
/// Opacity of the other lines while a node is selected.
const DIMMED: f32 = 0.45;
/// Opacity of white lines: they leave the colours below them visible, and their dark edges are seen on white.
const NEUTRAL: f32 = 0.75;
/// Opacity of silhouettes of spheres behind the surface, relative to other hidden lines.
pub(super) const HIDDEN_SILHOUETTE: f32 = 0.3;

/// Opacity of lines of no role: while a node is selected, and in white.
pub(super) const fn strength(has_selection: bool, is_neutral: bool) -> f32 {
    let dimmed = if has_selection { DIMMED } else { 1.0 };
    if is_neutral { dimmed * NEUTRAL } else { dimmed }
}

/// Place of a depth among the drawn `levels`: 0 for the first, 1 for the last, 0.5 where there is one level. The shaders compute
/// the same.
fn place(depth: u32, [first, last]: [u32; 2]) -> f32 {
    if last > first { ((depth as f32 - first as f32) / (last - first) as f32).clamp(0.0, 1.0) } else { 0.5 }
}

/// Width of the lines of a depth, relative to the chosen one.
pub fn level_width(depth: u32, levels: [u32; 2]) -> f32 {
    WIDEST + (NARROWEST - WIDEST) * place(depth, levels)
}

/// The sRGB colour of the lines of a depth, from the colour that the ramp has there.
pub fn level_color(color: [u8; 3], depth: u32, levels: [u32; 2]) -> [u8; 3] {
    let level = place(depth, levels) * 2.0 - 1.0;
    color.map(|channel| {
        let channel = f32::from(channel);
        let shown = if level > 0.0 {
            channel * (1.0 - level * DARKEST)
        } else {
            channel + (255.0 - channel) * -level * LIGHTEST
        };
        shown.round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_differ_in_width_and_lightness() {
        let levels = [4, 6];
        let widths = [4, 5, 6].map(|depth| level_width(depth, levels));
        assert!(widths[0] > widths[1] && widths[1] > widths[2], "{widths:?}");
        let green = [90, 180, 100];
        let lightness =
            [4, 5, 6].map(|depth| level_color(green, depth, levels).iter().map(|&c| u32::from(c)).sum::<u32>());
        assert!(lightness[0] > lightness[1] + 60 && lightness[1] > lightness[2] + 60, "{lightness:?}");
        assert!((level_width(5, [5, 5]) - 1.0).abs() < 1e-6);
        assert_eq!(level_color(green, 5, [5, 5]), green, "a single level has the colour of the legend");
    }
}
