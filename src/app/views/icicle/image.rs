//! The icicle as an image for other programs.

use egui::{Color32, ColorImage};

use super::legend;
use crate::app::state::IcicleLayout;

/// Height of a level in pixels, the line below it included.
const LEVEL_PX: usize = 12;

/// The icicle with one pixel for each of its columns, on `background`; nodes without a value are `none`.
pub(super) fn image(layout: &IcicleLayout, columns: u32, background: Color32, none: Color32) -> ColorImage {
    let size = [columns as usize, layout.icicle.level_count() * LEVEL_PX];
    let mut image = ColorImage::filled(size, background);
    for (cell, position) in layout.icicle.cells.iter().zip(&layout.positions) {
        let color = legend::color(*position, none);
        let (left, right) = (cell.left_px as usize, (cell.right_px as usize).min(size[0]));
        // A line of the background between cells that are wide enough.
        let right = if right - left > 3 { right - 1 } else { right };
        let top = cell.level as usize * LEVEL_PX;
        for row in top..top + LEVEL_PX - 1 {
            image.pixels[row * size[0] + left..row * size[0] + right].fill(color);
        }
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::metrics;
    use crate::lab::icicle::Icicle;
    use crate::lab::node_values::MetricScale;

    #[test]
    fn cells_are_where_the_layout_has_them() {
        let children = |node: u32| if node == 0 { 1..3 } else { 0..0 };
        let icicle = Icicle::new(children, &[4.0, 1.0, 2.0], 0, 16, 9);
        let scale = MetricScale::fitting(metrics::OVERLAP, std::iter::empty());
        let layout = IcicleLayout { icicle, positions: vec![Some(0.0), Some(1.0), None], scale };
        let image = image(&layout, 16, Color32::BLACK, Color32::RED);
        assert_eq!(image.size, [16, 2 * LEVEL_PX]);
        let at = |x: usize, y: usize| image.pixels[y * 16 + x];
        assert_eq!([at(0, 0), at(14, 0)], [legend::color(Some(0.0), Color32::RED); 2]);
        assert_eq!(at(0, LEVEL_PX - 1), Color32::BLACK, "a line between levels");
        let of_children = [at(2, LEVEL_PX), at(4, LEVEL_PX), at(12, LEVEL_PX)];
        assert_eq!(of_children, [legend::color(Some(1.0), Color32::RED), Color32::RED, Color32::BLACK]);
    }
}
