//! The curve through the primitives' centres, and the cells at which the recursion splits them.

use egui::{Color32, Rect, Shape, Stroke, Ui, lerp};
use glam::Vec3;

use super::projection::View;
use crate::app::state::AppState;
use crate::app::theme;

/// The edges of a box, by the bits of its corners.
const EDGES: [[usize; 2]; 12] =
    [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

/// Paints it within `rect`, the viewport's rectangle.
pub(crate) fn show(ui: &Ui, rect: Rect, state: &AppState) {
    let curve = &state.lab.curve;
    let Some(shown) = state.model.presented.as_ref().filter(|_| curve.shown) else { return };
    let Some(Ok(scaffold)) = curve.scaffold.of_tree(&shown.accel).map(|known| (**known).as_ref()) else { return };
    let view = View::new(shown.frame.camera, rect);
    let palette = theme::palette(ui);
    let painter = ui.painter().with_clip_rect(rect);
    let mut shapes = Vec::new();
    let stroke = Stroke::new(1.0, palette.text.gamma_multiply(0.35));
    for cell in &scaffold.cells {
        let corners: [Vec3; 8] = std::array::from_fn(|corner| {
            let side = |bit: usize, low: f32, high: f32| if corner >> bit & 1 == 0 { low } else { high };
            let [low, high] = [cell.bounds.min, cell.bounds.max];
            Vec3::new(side(0, low.x, high.x), side(1, low.y, high.y), side(2, low.z, high.z))
        });
        let placed = corners.map(|corner| view.place(corner));
        for [from, to] in EDGES {
            if let (Some(from), Some(to)) = (placed[from], placed[to]) {
                shapes.push(Shape::line_segment([from, to], stroke));
            }
        }
    }
    let last = scaffold.points.len().saturating_sub(1).max(1) as f32;
    for (index, ends) in scaffold.points.windows(2).enumerate() {
        if let (Some(from), Some(to)) = (view.place(ends[0]), view.place(ends[1])) {
            let color = mix(palette.accent, palette.warm, index as f32 / last);
            shapes.push(Shape::line_segment([from, to], Stroke::new(1.5, color)));
        }
    }
    painter.extend(shapes);
}

/// A colour between two.
fn mix(from: Color32, to: Color32, share: f32) -> Color32 {
    let channel = |from: u8, to: u8| lerp(f32::from(from)..=f32::from(to), share).round() as u8;
    Color32::from_rgb(channel(from.r(), to.r()), channel(from.g(), to.g()), channel(from.b(), to.b()))
}
