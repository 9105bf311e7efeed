//! Handles in the viewport: the section plane's outline and the handle that moves it, and the axes gizmo in the lower right
//! corner, on which a click on an end views the scene from there.

use egui::{Align2, Color32, CursorIcon, FontId, Pos2, Rect, Role, Sense, Stroke, Ui, Vec2, WidgetInfo, pos2, vec2};
use glam::Vec3;

use super::Projected;
use crate::app::commands::{Action, SectionStep};
use crate::app::state::AppState;
use crate::app::theme;
use crate::app::viewport::orbit;
use crate::app::widgets::Tip as _;

/// Radius of the handle in points.
const RADIUS: f32 = 8.0;
/// Length of the arrow on each side of the handle in points.
const ARROW: f32 = 22.0;

/// Shows the section plane within `rect`, the viewport's rectangle.
pub(crate) fn section(ui: &mut Ui, rect: Rect, state: &mut AppState) {
    let (Some(plane), Some(bounds)) = (state.wanted.render.section, state.model.bounds()) else { return };
    let Some(shown) = state.model.presented.as_ref().filter(|_| state.preferences.show_geometry) else { return };
    let view = Projected::new(shown.frame.camera, rect);
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
    let place = plane.in_file(state.wanted.offset);
    let tip = format!("Section plane {place}. Drag to move it, double click to keep the other half");
    response.on_hover_cursor(CursorIcon::Grab).tip(tip);
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

/// Length of the axes in points, in a viewport that is large enough.
const REACH: f32 = 30.0;
/// Radius of the knobs at their ends in points, likewise.
const KNOB: f32 = 9.0;
/// Smaller side in points of a viewport that is large enough for the whole size.
const FULL_SIZE_FROM: f32 = 480.0;

/// Name and colour of each axis; muted, so that they do not distract from the picture.
const AXES: [(&str, [u8; 3]); 3] = [("x", [0xd0, 0x6a, 0x6a]), ("y", [0x7f, 0xb0, 0x62]), ("z", [0x6a, 0x93, 0xd4])];

/// Shows the axes gizmo within `rect`, the viewport's rectangle.
pub(crate) fn gizmo(ui: &mut Ui, rect: Rect, state: &mut AppState) {
    if rect.width() < 320.0 || rect.height() < 160.0 {
        return;
    }
    let palette = theme::palette(ui);
    let scale = (rect.width().min(rect.height()) / FULL_SIZE_FROM).clamp(0.6, 1.0);
    let (reach, radius) = (REACH * scale, KNOB * scale);
    let center = rect.right_bottom() - vec2(52.0, 52.0) * scale;
    let (right, up, forward) = state.wanted.camera.for_size(1, 1).axes();
    let mut ends: Vec<(Vec3, &str, [u8; 3], bool)> = Vec::new();
    for ((name, color), axis) in AXES.into_iter().zip([Vec3::X, Vec3::Y, Vec3::Z]) {
        ends.push((axis, name, color, true));
        ends.push((-axis, name, color, false));
    }
    // Back to front, so that near ends are painted over far ones.
    ends.sort_by(|(a, ..), (b, ..)| b.dot(forward).total_cmp(&a.dot(forward)));
    ui.painter().circle_filled(center, reach + radius + 3.0, palette.veil.gamma_multiply(0.7));
    for (axis, name, [r, g, b], positive) in ends {
        let end = center + vec2(axis.dot(right), -axis.dot(up)) * reach;
        let knob = Rect::from_center_size(end, vec2(radius * 2.0, radius * 2.0));
        let sign = if positive { "+" } else { "-" };
        let title = format!("View from {sign}{name}");
        let response = ui.interact(knob, ui.scope_id().with(("gizmo", &title)), Sense::click());
        response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &title));
        if response.clicked() {
            let world_up = state.model.up();
            orbit::view_along(&mut state.wanted.camera, axis, world_up);
        }
        // Ends that point away are fainter.
        let strength = 0.75 - 0.25 * axis.dot(forward);
        let color = Color32::from_rgb(r, g, b).gamma_multiply(strength);
        let hot = response.hovered() || response.has_focus();
        if positive {
            ui.painter().line_segment([center, end], Stroke::new(2.0, color));
            ui.painter().circle_filled(end, radius, color);
            ui.painter().text(
                pos2(end.x, end.y - 0.5),
                Align2::CENTER_CENTER,
                name,
                FontId::proportional(12.0 * scale),
                Color32::from_gray(0x16),
            );
        } else {
            ui.painter().circle_filled(end, radius * 0.62, color.gamma_multiply(0.45));
        }
        if hot {
            ui.painter().circle_stroke(end, radius + 1.0, Stroke::new(1.5, palette.text));
        }
        response.tip(title);
    }
}
