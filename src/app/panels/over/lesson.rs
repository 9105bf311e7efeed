//! The card of the lesson that is being read: caption, question, and the way through its steps.

use egui::{self, Align2, Area, CornerRadius, Frame, Id, Label, Margin, Order, Rect, RichText, Stroke, Ui, pos2};

use crate::app::commands::Action;
use crate::app::state::AppState;
use crate::app::state::lesson::Reading;
use crate::app::theme;
use crate::app::widgets::Tip as _;

/// Largest width of the card in points.
const WIDTH: f32 = 400.0;
/// Widths at the lower left and right of the viewport in points, where legend and axes are.
const SIDES: [f32; 2] = [232.0, 108.0];

/// Shows the card within `rect`, the viewport's rectangle.
pub(crate) fn show(ui: &Ui, rect: Rect, state: &mut AppState) {
    let Some(mut reading) = state.layout.lesson.take() else { return };
    if let Some(shown) = &state.model.presented {
        reading.measure(shown, &state.wanted.camera);
    }
    let beside = rect.width() - SIDES[0] - SIDES[1];
    let (left, width) = if beside > 260.0 { (SIDES[0], beside) } else { (12.0, rect.width() - 24.0) };
    let card = Area::new(Id::unique("lesson"))
        .order(Order::Foreground)
        .pivot(Align2::LEFT_BOTTOM)
        .fixed_pos(pos2(rect.left() + left, rect.bottom() - 12.0))
        .constrain_to(rect.shrink(4.0))
        .accessible_name("Lesson");
    let mut next = None;
    card.show(ui.ctx(), |ui| next = content(ui, &reading, WIDTH.min(width)));
    state.layout.lesson = Some(reading);
    if let Some(action) = next {
        action.perform(state);
    }
}

/// Title, caption, question and buttons. Returns what was chosen.
fn content(ui: &mut Ui, reading: &Reading, width: f32) -> Option<Action> {
    let palette = theme::palette(ui);
    let frame = Frame::new()
        .fill(ui.visuals().window_fill)
        .stroke(Stroke::new(1.0, palette.line))
        .corner_radius(CornerRadius::same(6))
        .inner_margin(Margin::symmetric(12, 10));
    let mut chosen = None;
    frame.show(ui, |ui| {
        ui.set_width((width - 24.0).max(160.0));
        ui.horizontal(|ui| {
            ui.label(RichText::new(&reading.lesson.title).strong().color(palette.text));
            let count = format!("{} of {}", reading.step + 1, reading.lesson.steps.len());
            ui.label(RichText::new(count).small().color(palette.dim));
        });
        ui.add(Label::new(reading.caption()).wrap());
        let question = &reading.current().question;
        if !question.is_empty() {
            ui.add(Label::new(RichText::new(question).color(palette.warm)).wrap());
        }
        ui.add_space(4.0);
        ui.horizontal(|ui| chosen = buttons(ui, reading));
    });
    chosen
}

fn buttons(ui: &mut Ui, reading: &Reading) -> Option<Action> {
    let last = reading.step + 1 == reading.lesson.steps.len();
    let mut chosen = None;
    let back = ui.add_enabled(reading.step > 0, egui::Button::new("Back"));
    if back.tip("Go to the step before (Page Up)").clicked() {
        chosen = Some(Action::LessonBack);
    }
    let (label, tip) = if last {
        ("Done", "End the lesson; your own settings come back (Page Down)")
    } else {
        ("Next", "Go to the next step (Page Down)")
    };
    let text = RichText::new(label).color(ui.visuals().selection.stroke.color);
    if ui.add(egui::Button::new(text).fill(ui.visuals().selection.bg_fill)).tip(tip).clicked() {
        chosen = Some(Action::LessonNext);
    }
    if !last && ui.button("Leave").tip("End the lesson; your own settings come back").clicked() {
        chosen = Some(Action::LeaveLesson);
    }
    chosen
}
