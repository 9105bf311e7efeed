//! Messages over the viewport: notes that fade, warnings and errors that fold into the status bar. Also the help at first start.

use egui::{self, Align, Align2, Area, CornerRadius, Frame, Layout, Margin, Order, Rect, Stroke, Ui, vec2};

use crate::app::state::{AppState, Message, Navigation, Severity};
use crate::app::theme;
use crate::app::widgets::{Icon, Tip as _, icon_button, note_front};

/// Duration of the fade at its end in seconds.
const FADE_SECS: f32 = 0.4;
/// Height of the viewport in points below which the greeting would cover the model.
const GREETING_ROOM: f32 = 240.0;
/// Maximum number of messages shown at once: the newest.
const MAX_SHOWN: usize = 4;

const HELP: &str = "Drag to orbit, wheel to zoom. Drag the threshold on the right to rebuild the tree, the bar below to choose depths. F1 lists all keys.";

/// Shows it within `rect`, the viewport's rectangle.
pub(crate) fn show(ui: &Ui, rect: Rect, state: &mut AppState) {
    state.messages.fold();
    let flying = state.preferences.navigation == Navigation::Fly;
    let touring = state.layout.tour.is_some() || !state.preferences.toured;
    if !state.preferences.greeted
        && !touring
        && !flying
        && state.model.presented.is_some()
        && !state.layout.start_page_open
        && rect.height() >= GREETING_ROOM
    {
        greeting(ui, rect, state);
    }
    if state.messages.open.is_empty() {
        return;
    }
    let mut closed = None;
    let mut copied = None;
    // Leaves the corner to the axes gizmo.
    let corner = rect.right_bottom() - vec2(12.0, 108.0);
    let shown = Area::new(egui::Id::unique("messages"))
        // Below menus, which are read at the same time, and below dialogs that open later.
        .order(Order::Middle)
        .pivot(Align2::RIGHT_BOTTOM)
        .fixed_pos(corner)
        .constrain_to(rect)
        .accessible_name("Messages")
        .show(ui.ctx(), |ui| {
            ui.set_width(320.0_f32.min(rect.width() - 24.0));
            let skipped = state.messages.open.len().saturating_sub(MAX_SHOWN);
            for (index, message) in state.messages.open.iter().enumerate().skip(skipped) {
                match toast(ui, index, message) {
                    Some(Pressed::Close) => closed = Some(index),
                    Some(Pressed::Copy) => copied = Some(message.text.clone()),
                    None => {}
                }
            }
        });
    note_front(ui.ctx(), shown.response.rect);
    if let Some(text) = copied {
        state.copy(text, "");
    }
    if let Some(index) = closed {
        state.messages.open.remove(index);
    }
}

/// Button of a message that was clicked.
enum Pressed {
    Close,
    Copy,
}

/// One message. Returns the button that was clicked.
fn toast(ui: &mut Ui, index: usize, message: &Message) -> Option<Pressed> {
    let palette = theme::palette(ui);
    let mark = message.severity.label();
    let color = match message.severity {
        Severity::Info => palette.accent,
        Severity::Warning => palette.warning,
        Severity::Error => palette.error,
    };
    let left = message.left().as_secs_f32();
    ui.set_opacity((left / FADE_SECS).clamp(0.0, 1.0));
    ui.ctx().request_repaint_after_secs(if left > FADE_SECS { left - FADE_SECS } else { 0.03 });
    let frame = Frame::new()
        .fill(ui.visuals().window_fill)
        .stroke(Stroke::new(1.0, ui.visuals().window_stroke.color))
        .corner_radius(CornerRadius::same(6))
        .inner_margin(Margin { left: 12, right: 8, top: 6, bottom: 6 });
    let mut pressed = None;
    let shown = frame.show(ui, |ui| {
        ui.with_layout(Layout::right_to_left(Align::Min), |ui| {
            for (icon, name, tip, what) in [
                (Icon::Close, "Close message", "Close", Pressed::Close),
                (Icon::Copy, "Copy message", "Copy this text", Pressed::Copy),
            ] {
                let (rect, _) = ui.allocate_exact_size(vec2(20.0, 20.0), egui::Sense::hover());
                let response = ui.push_id(index, |ui| icon_button(ui, rect, icon, name)).inner;
                if response.tip(tip).clicked() {
                    pressed = Some(what);
                }
            }
            ui.with_layout(Layout::top_down(Align::Min), |ui| {
                if message.severity != Severity::Info {
                    ui.label(egui::RichText::new(mark).color(color).small());
                }
                ui.add(egui::Label::new(&message.text).wrap().selectable(true));
            });
        });
    });
    let stripe =
        Rect::from_min_size(shown.response.rect.min + vec2(0.0, 4.0), vec2(3.0, shown.response.rect.height() - 8.0));
    ui.painter().rect_filled(stripe, CornerRadius::same(1), color);
    ui.add_space(4.0);
    pressed
}

/// Help over the first scene, shown until it is dismissed.
fn greeting(ui: &Ui, rect: Rect, state: &mut AppState) {
    let width = 600.0_f32.min(rect.width() - 48.0).max(0.0);
    Area::new(egui::Id::unique("greeting"))
        .order(Order::Middle)
        .pivot(Align2::CENTER_TOP)
        .fixed_pos(rect.center_top() + vec2(0.0, 44.0))
        .constrain_to(rect)
        .accessible_name("First steps")
        .show(ui.ctx(), |ui| {
            let palette = theme::palette(ui);
            let frame = Frame::new()
                .fill(palette.veil)
                .corner_radius(CornerRadius::same(6))
                .inner_margin(Margin::symmetric(12, 8));
            frame.show(ui, |ui| {
                ui.set_width(width);
                let text = |ui: &mut Ui| {
                    ui.with_layout(Layout::top_down(Align::Min), |ui| ui.add(egui::Label::new(HELP).wrap()));
                };
                if width < 440.0 {
                    text(ui);
                    ui.horizontal(|ui| greeting_buttons(ui, state));
                } else {
                    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                        greeting_buttons(ui, state);
                        text(ui);
                    });
                }
            });
        });
}

fn greeting_buttons(ui: &mut Ui, state: &mut AppState) {
    let text = egui::RichText::new("Got it").color(ui.visuals().selection.stroke.color);
    let button = egui::Button::new(text).fill(ui.visuals().selection.bg_fill);
    if ui.add(button).tip("Do not show this line again").clicked() {
        state.preferences.greeted = true;
    }
    let tip = "Built-in scenes, recent files and the file dialog (Ctrl+N)";
    if ui.button("Open a model…").tip(tip).clicked() {
        state.layout.start_page_open = true;
    }
}
