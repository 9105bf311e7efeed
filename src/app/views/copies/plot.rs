//! A curve over how far the tree over the copies is opened, with a line for the flat scene.

use egui::{self, Align2, FontId, Rect, Sense, Shape, Stroke, Ui, Vec2, vec2};

use crate::app::theme;
use crate::app::views::axes::Axes;
use crate::lab::plot::{Chart, Look};
use crate::lab::report_table::number;

/// Size of what the pointer hits around a dot in points.
const TARGET: f32 = 12.0;

/// Shows the chart. Pointing at a dot names its values.
pub(super) fn show(ui: &mut Ui, chart: &Chart) {
    let palette = theme::palette(ui);
    let [_, up] = &chart.labels;
    let (axes, response) = Axes::of_chart(ui, chart);
    let painter = axes.painter(ui);
    for curve in &chart.curves {
        let line: Vec<_> = curve.points.iter().map(|point| axes.at([point.x, point.y])).collect();
        if curve.look == Look::Reference {
            if let Some(&end) = line.last() {
                let font = FontId::proportional(theme::HEADING_SIZE);
                painter.text(end - vec2(2.0, 1.0), Align2::RIGHT_BOTTOM, &curve.name, font, palette.dim);
            }
            painter.add(Shape::line(line, Stroke::new(1.5, palette.dim)));
            continue;
        }
        for (index, (&at, point)) in line.iter().zip(&curve.points).enumerate() {
            let target = Rect::from_center_size(at, Vec2::splat(TARGET));
            let dot = ui.interact(target, response.id.with(index), Sense::hover());
            let radius = if dot.hovered() { 5.0 } else { 3.5 };
            painter.circle_filled(at, radius, palette.accent);
            dot.on_hover_text_at_pointer(format!("Opened to {}: {} {up}", point.x, number(point.y)));
        }
        painter.add(Shape::line(line, Stroke::new(1.5, palette.accent)));
    }
}
