//! Tests of a ray over the bytes that it reads, a dot for each layout.

use egui::{self, Color32, Role, Sense, Shape, Stroke, TextStyle, Ui, Vec2, WidgetInfo, vec2};

use crate::app::state::AppState;
use crate::app::theme;
use crate::app::views::axes::Axes;
use crate::lab::layouts::LaidOut;
use crate::lab::plot::{COLORS, Look, layout_chart};
use crate::lab::report_table::number;

/// Size of what the pointer hits around a dot in points.
const TARGET: f32 = 12.0;
/// Gap between a dot of the legend and its name in points.
const ENTRY_GAP: f32 = 4.0;

/// Shows the plot with its legend. Pointing at a dot names the layout.
pub(super) fn show(ui: &mut Ui, state: &mut AppState, rows: &[LaidOut]) {
    let chart = layout_chart("", &rows.iter().collect::<Vec<_>>());
    let palette = theme::palette(ui);
    let color = |index: usize| match COLORS[index % COLORS.len()] {
        [0, 0, 0] => palette.text,
        [r, g, b] => Color32::from_rgb(r, g, b),
    };
    // Before the plot, which takes the rest of the height.
    ui.horizontal_wrapped(|ui| {
        for curve in chart.curves.iter().filter(|curve| curve.look == Look::Dots) {
            entry(ui, &curve.name, color(curve.color));
        }
    });
    let (axes, response) = Axes::of_chart(ui, &chart);
    let painter = axes.painter(ui);
    for curve in chart.curves.iter().filter(|curve| curve.look == Look::Reference) {
        let line = curve.points.iter().map(|point| axes.at([point.x, point.y])).collect();
        painter.add(Shape::line(line, Stroke::new(1.5, palette.dim)));
    }
    for (index, row) in rows.iter().enumerate() {
        let group = row.layout.group();
        let Some(curve) = chart.curves.iter().find(|curve| curve.name == group) else { continue };
        let at = axes.at([row.rays.bytes_per_ray, row.rays.tests_per_ray]);
        let radius = if row.layout.is_own() { 5.0 } else { 3.5 };
        painter.circle(at, radius, color(curve.color), Stroke::new(1.0, Color32::from_black_alpha(90)));
        let target = egui::Rect::from_center_size(at, Vec2::splat(TARGET));
        let dot = ui.interact(target, response.id.with(index), Sense::click());
        dot.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("Show {}", row.layout.name())));
        let is_on_show = state.model.layout.chosen == Some(row.layout.choice);
        if dot.clicked() {
            state.model.layout.toggle(row.layout.choice);
        }
        if dot.hovered() || is_on_show {
            painter.circle_stroke(at, 6.5, Stroke::new(1.5, palette.text));
        }
        let numbers = [row.rays.tests_per_ray, row.rays.bytes_per_ray].map(number);
        let [tests, bytes] = numbers;
        let click = if is_on_show { "A click shows the binary tree again" } else { "A click shows its nodes" };
        let name = row.layout.name();
        dot.on_hover_text_at_pointer(format!("{name}: {tests} tests and {bytes} bytes a ray\n{click}"));
    }
}

/// A dot with its meaning, which stay together where a line ends.
fn entry(ui: &mut Ui, name: &str, color: Color32) {
    let font = TextStyle::Body.resolve(ui.style());
    let text = ui.painter().layout_no_wrap(name.to_owned(), font, theme::palette(ui).text);
    let size = vec2(TARGET + ENTRY_GAP + text.size().x, text.size().y.max(TARGET));
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, name));
    ui.painter().circle_filled(rect.left_center() + vec2(TARGET * 0.5, 0.0), 3.5, color);
    let place = rect.right_center() - vec2(text.size().x, text.size().y * 0.5);
    ui.painter().galley(place, text, theme::palette(ui).text);
}
