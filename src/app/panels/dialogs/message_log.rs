//! Dialog "Messages": all messages since the program started, newest first.

use crate::app::state::{AppState, Message, Severity};
use crate::app::{format, theme};
use egui::{self, Align, Button, Label, Layout, RichText, ScrollArea, Ui, vec2};

/// Shows the dialog while it is open.
pub(crate) fn show(ctx: &egui::Context, state: &mut AppState) {
    if !state.layout.messages_open {
        return;
    }
    state.messages.folded = [0; 2];
    let mut copied = None;
    super::dialog(ctx, "Messages", [560.0, 400.0], &mut state.layout.messages_open, |ui| {
        if state.messages.history.is_empty() {
            ui.label(RichText::new("No messages yet").color(theme::palette(ui).dim));
            return;
        }
        let all = || state.messages.history.iter().map(line).collect::<Vec<_>>().join("\n");
        let tip = "Copy all of them as text, oldest first";
        if ui.add(Button::new("Copy all")).on_hover_text(tip).clicked() {
            copied = Some(all());
        }
        ui.separator();
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            for message in state.messages.history.iter().rev() {
                row(ui, message);
            }
        });
    });
    if let Some(text) = copied {
        state.copy(text, "");
    }
    // Keep the ages current.
    ctx.request_repaint_after_secs(1.0);
}

/// A message as a line of text.
fn line(message: &Message) -> String {
    format!("{}: {}", message.severity.label(), message.text)
}

/// A message with its age and severity.
fn row(ui: &mut Ui, message: &Message) {
    let palette = theme::palette(ui);
    let color = match message.severity {
        Severity::Info => palette.dim,
        Severity::Warning => palette.warning,
        Severity::Error => palette.error,
    };
    ui.horizontal_top(|ui| {
        let ago = format!("{} ago", format::age(message.since.elapsed()));
        for (text, width, color) in [(ago.as_str(), 72.0, palette.dim), (message.severity.label(), 56.0, color)] {
            ui.allocate_ui_with_layout(vec2(width, theme::ROW_HEIGHT), Layout::left_to_right(Align::Min), |ui| {
                ui.set_min_width(width);
                ui.label(RichText::new(text).color(color));
            });
        }
        ui.add(Label::new(&message.text).wrap().selectable(true));
    });
}
