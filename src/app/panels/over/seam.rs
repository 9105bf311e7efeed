//! The seam between two pictures side by side, with the handle that moves it.

use egui::{CornerRadius, CursorIcon, EventFilter, Key, Rect, Sense, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2};

use crate::app::state::AppState;
use crate::app::theme;
use crate::app::widgets::Tip as _;

/// Width of the strip along the seam that can be dragged, in points.
const GRIP: f32 = 12.0;
/// Size of the handle in points.
const HANDLE: egui::Vec2 = vec2(10.0, 36.0);
/// The part of the viewport's width by which an arrow key moves the seam.
const STEP: f32 = 0.02;

/// Shows the seam within `rect`, the viewport's rectangle. Returns its x coordinate in points.
pub(super) fn show(ui: &Ui, rect: Rect, state: &mut AppState) -> f32 {
    let Some(second) = &mut state.wanted.second else { return rect.center().x };
    let place = |seam: f32| rect.left() + rect.width() * seam;
    let grip = Rect::from_center_size(pos2(place(second.seam), rect.center().y), vec2(GRIP, rect.height()));
    let response = ui.interact(grip, ui.scope_id().with("seam"), Sense::click_and_drag());
    if let Some(pointer) = response.interact_pointer_pos().filter(|_| response.dragged()) {
        second.move_seam((pointer.x - rect.left()) / rect.width().max(1.0));
    }
    if response.clicked() || response.drag_started() {
        response.request_focus();
    }
    if response.has_focus() {
        let filter = EventFilter { horizontal_arrows: true, ..EventFilter::default() };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
        let steps = ui.input(|input| {
            f32::from(i8::from(input.key_pressed(Key::ArrowRight)) - i8::from(input.key_pressed(Key::ArrowLeft)))
        });
        second.move_seam(second.seam + steps * STEP);
    }
    let (x, seam) = (place(second.seam), second.seam);
    response.widget_info(|| WidgetInfo::slider(true, f64::from(seam), "Seam between tree A and tree B"));
    let palette = theme::palette(ui);
    let is_active = response.hovered() || response.dragged() || response.has_focus();
    let color = if is_active { palette.accent } else { palette.text };
    let painter = ui.painter().with_clip_rect(rect);
    // The dark edge shows the line on a light picture.
    painter.vline(x, rect.y_range(), Stroke::new(3.0, palette.veil));
    painter.vline(x, rect.y_range(), Stroke::new(1.0, color));
    let handle = Rect::from_center_size(pos2(x, rect.center().y), HANDLE);
    painter.rect(handle, CornerRadius::same(5), palette.veil, Stroke::new(1.5, color), StrokeKind::Middle);
    for offset in [-1.5, 1.5] {
        painter.vline(x + offset, handle.shrink(10.0).y_range(), Stroke::new(1.0, color));
    }
    response
        .on_hover_and_drag_cursor(CursorIcon::ResizeHorizontal)
        .tip("Drag to see more of A or of B; with the focus, the arrow keys move it");
    x
}
