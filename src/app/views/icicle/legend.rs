//! The colours of the icicle: a gradient with its ends.

use egui::{Align2, Color32, CornerRadius, Mesh, Rect, Role, Sense, TextStyle, Ui, WidgetInfo, pos2, vec2};

use crate::app::state::{AppState, Presented};
use crate::app::widgets::Tip as _;
use crate::app::{format, theme};
use crate::catalog::metrics::Metric;
use crate::overlay;

/// Width of the gradient in points.
const WIDTH: f32 = 72.0;
/// Steps of the gradient.
const STEPS: usize = 24;

/// Shows it for the icicle that was laid out last.
pub(super) fn show(ui: &mut Ui, state: &AppState, shown: &Presented) {
    let metric = state.lab.icicle.color;
    let Some(layout) = state.lab.icicle.last_layout(&shown.accel) else { return };
    let [low, high] = layout.scale.ends.map(|value| text(metric, value));
    let palette = theme::palette(ui);
    let font = TextStyle::Small.resolve(ui.style());
    let galleys =
        [&low, &high].map(|text| ui.painter().layout_no_wrap(text.clone(), font.clone(), palette.dim).size().x);
    let size = vec2(galleys[0] + WIDTH + galleys[1] + 12.0, theme::ROW_HEIGHT);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    let name = format!("Colours: {} from {low} to {high}", metric.label);
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &name));
    ui.painter().text(rect.left_center(), Align2::LEFT_CENTER, &low, font.clone(), palette.dim);
    ui.painter().text(rect.right_center(), Align2::RIGHT_CENTER, &high, font, palette.dim);
    let left = rect.left() + galleys[0] + 6.0;
    let bar = Rect::from_min_size(pos2(left, rect.center().y - 4.0), vec2(WIDTH, 8.0));
    let mut mesh = Mesh::default();
    for step in 0..STEPS {
        let at = |step: usize| bar.left() + bar.width() * step as f32 / STEPS as f32;
        let place = Rect::from_x_y_ranges(at(step)..=at(step + 1), bar.y_range());
        mesh.add_colored_rect(place, color(Some((step as f32 + 0.5) / STEPS as f32), palette.rail));
    }
    ui.painter().add(mesh);
    ui.painter().rect_stroke(
        bar,
        CornerRadius::ZERO,
        ui.visuals().widgets.noninteractive.bg_stroke,
        egui::StrokeKind::Outside,
    );
    response.tip(format!("{}. Grey: none", metric.meaning));
}

/// The colour at a position on the scale, 0 to 1; `none` for a node without a value.
pub(super) fn color(position: Option<f32>, none: Color32) -> Color32 {
    position.map_or(none, |position| {
        let [r, g, b] = overlay::ramp(position);
        Color32::from_rgb(r, g, b)
    })
}

/// A value of a metric as text.
pub(super) fn text(metric: &'static Metric, value: f32) -> String {
    format::of_metric(metric, value)
}
