//! Axes gizmo in the lower right corner of the viewport. A click on an end views the scene from there.

use egui::{Align2, Color32, FontId, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};
use glam::Vec3;

use crate::app::state::AppState;
use crate::app::theme;
use crate::app::viewport::orbit;

/// Length of the axes in points, in a viewport that is large enough.
const REACH: f32 = 30.0;
/// Radius of the knobs at their ends in points, likewise.
const KNOB: f32 = 9.0;
/// Smaller side in points of a viewport that is large enough for the whole size.
const FULL_SIZE_FROM: f32 = 480.0;

/// Name and colour of each axis; muted, so that they do not distract from the picture.
const AXES: [(&str, [u8; 3]); 3] = [("x", [0xd0, 0x6a, 0x6a]), ("y", [0x7f, 0xb0, 0x62]), ("z", [0x6a, 0x93, 0xd4])];

/// Shows it within `rect`, the viewport's rectangle.
pub(crate) fn show(ui: &mut Ui, rect: Rect, state: &mut AppState) {
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
        response.on_hover_text(title);
    }
}
