//! The section plane in the viewport: its outline, and the handle that moves it.

use egui::{Color32, CursorIcon, Pos2, Rect, Role, Sense, Stroke, Ui, Vec2, WidgetInfo, pos2, vec2};
use glam::Vec3;

use super::View;
use crate::app::commands::{Action, SectionStep};
use crate::app::state::AppState;
use crate::app::theme;

/// Radius of the handle in points.
const RADIUS: f32 = 8.0;
/// Length of the arrow on each side of the handle in points.
const ARROW: f32 = 22.0;

/// Shows it within `rect`, the viewport's rectangle.
pub(crate) fn show(ui: &mut Ui, rect: Rect, state: &mut AppState) {
    let (Some(plane), Some(bounds)) = (state.wanted.render.section, state.model.bounds()) else { return };
    let Some(shown) = state.model.presented.as_ref().filter(|_| state.preferences.show_geometry) else { return };
    let view = View::new(shown.frame.camera, rect);
    let outline = plane.outline(&bounds);
    let color = theme::palette(ui).accent;
    let painter = ui.painter().with_clip_rect(rect);
    for (index, corner) in outline.iter().enumerate() {
        let next = outline[(index + 1) % outline.len()];
        if let (Some(from), Some(to)) = (view.place(*corner), view.place(next)) {
            painter.line_segment([from, to], Stroke::new(1.25, color.gamma_multiply(0.8)));
        }
    }
    // Where the plane misses the model the handle stays at the model, so that it can be brought back.
    let middle = if outline.is_empty() {
        bounds.center() + plane.normal * (plane.offset - plane.normal.dot(bounds.center()))
    } else {
        outline.iter().sum::<Vec3>() / outline.len() as f32
    };
    let Some(center) = view.place(middle) else { return };
    let center = rect.shrink(ARROW).clamp(center);
    // How far the handle moves on screen when the plane moves by a hundredth of the model.
    let step = bounds.extent().length() * 0.01;
    let along =
        view.place(middle + plane.normal * step).map_or(Vec2::ZERO, |end| end - view.place(middle).unwrap_or(end));
    // Seen along the normal the handle moves up and down instead.
    let faces = along.length() < 0.15 * step / (2.0 * view.pixel_size(middle)).max(f32::MIN_POSITIVE);
    let along = if faces { vec2(0.0, -step / view.pixel_size(middle)) } else { along };
    let response = ui.interact(
        Rect::from_center_size(center, Vec2::splat(RADIUS * 2.5)),
        ui.scope_id().with("section handle"),
        Sense::click_and_drag(),
    );
    response.widget_info(|| WidgetInfo::labeled(Role::Slider, true, "Section plane"));
    if response.dragged() && along.length_sq() > 0.0 {
        let moved = response.drag_delta().dot(along) / along.length_sq() * step;
        let [low, high] = plane.reach(&bounds);
        if let Some(plane) = &mut state.wanted.render.section {
            plane.offset = (plane.offset + moved).clamp(low, high);
        }
    }
    if response.double_clicked() {
        Action::Section(SectionStep::Flip).perform(state);
    }
    let hot = response.hovered() || response.dragged();
    paint(ui, center, along.normalized(), if hot { Color32::WHITE } else { color });
    let tip = format!("Section plane {plane}. Drag to move it, double click to keep the other half");
    response.on_hover_cursor(CursorIcon::Grab).on_hover_text(tip);
}

/// A knob with an arrow to both sides.
fn paint(ui: &Ui, center: Pos2, along: Vec2, color: Color32) {
    let painter = ui.painter();
    let across = vec2(-along.y, along.x);
    for side in [-1.0, 1.0] {
        let tip = center + along * (ARROW * side);
        let stroke = Stroke::new(2.0, color);
        painter.line_segment([center + along * (RADIUS * side), tip], stroke);
        for wing in [-1.0, 1.0] {
            painter.line_segment([tip, tip - along * (6.0 * side) + across * (5.0 * wing)], stroke);
        }
    }
    painter.circle(pos2(center.x, center.y), RADIUS, Color32::from_black_alpha(150), Stroke::new(2.0, color));
}
