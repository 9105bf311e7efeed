//! Two trees in the viewport: the switch between their views, the letters that say which picture is whose, and the seam
//! between two pictures side by side.

use egui::{
    Align2, Area, Button, CornerRadius, CursorIcon, EventFilter, FontId, Frame, Id, Key, Margin, Order, Painter, Pos2,
    Rect, Sense, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2,
};

use crate::app::commands::{Action, CompareStep, compare_description};
use crate::app::state::{AppState, CompareView};
use crate::app::theme;
use crate::app::theme::Palette;
use crate::app::widgets::Tip as _;

/// Distance of the switch and the letters from the viewport's upper edge in points.
const TOP: f32 = 10.0;
/// Distance of a letter from the seam in points.
const BESIDE: f32 = 20.0;

/// Shows it within `rect`, the viewport's rectangle.
pub(crate) fn show(ui: &mut Ui, rect: Rect, state: &mut AppState) {
    if state.wanted.second.is_none() || state.model.presented.is_none() {
        return;
    }
    let view = state.shown_view();
    if view == CompareView::Split {
        let x = seam(ui, rect, state);
        let (painter, palette) = (ui.painter(), theme::palette(ui));
        // Below the switch, which lies over the middle.
        let y = rect.top() + TOP + 46.0;
        letter(painter, pos2(x - BESIDE, y), "A", &palette);
        letter(painter, pos2(x + BESIDE, y), "B", &palette);
    }
    switch(ui, rect, state);
}

/// The switch between the views, in the middle of the upper edge.
fn switch(ui: &Ui, rect: Rect, state: &mut AppState) {
    let palette = theme::palette(ui);
    let wanted = state.wanted.second.map(|second| second.view);
    // Until its first picture there is nothing to switch to.
    let waits = state.model.second.is_none();
    let area = Area::new(Id::unique("views of two trees")).order(Order::Middle).pivot(Align2::CENTER_TOP);
    area.constrain_to(rect).fixed_pos(rect.center_top() + vec2(0.0, TOP)).show(ui.ctx(), |ui| {
        Frame::new().fill(palette.veil).corner_radius(6).inner_margin(Margin::symmetric(6, 4)).show(ui, |ui| {
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing.x = 4.0;
                for view in CompareView::ALL {
                    let button = ui.add(Button::new(view.label()).selected(wanted == Some(view)));
                    if button.tip(format!("{} (2)", compare_description(view))).clicked() {
                        Action::Compare(CompareStep::View(view)).perform(state);
                    }
                }
                if waits {
                    ui.label(egui::RichText::new("building B …").small().color(palette.dim));
                }
            });
        });
    });
}

/// A letter on a translucent ground around `center`.
fn letter(painter: &Painter, center: Pos2, text: &str, palette: &Palette) {
    painter.circle_filled(center, 11.0, palette.veil);
    painter.text(center, Align2::CENTER_CENTER, text, FontId::proportional(14.0), palette.text);
}

/// Width of the strip along the seam that can be dragged, in points.
const GRIP: f32 = 12.0;
/// Size of the handle in points.
const HANDLE: egui::Vec2 = vec2(10.0, 36.0);
/// The part of the viewport's width by which an arrow key moves the seam.
const STEP: f32 = 0.02;

/// Shows the seam within `rect`, the viewport's rectangle. Returns its x coordinate in points.
pub(super) fn seam(ui: &Ui, rect: Rect, state: &mut AppState) -> f32 {
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
