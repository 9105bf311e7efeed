//! Strip of the lesson that is being read: caption, question, and the way through its steps. It stands below the viewport, so that
//! it covers neither model nor legends.

use egui::{self, Align, Button, Label, Layout, Margin, Panel, RichText, TextStyle, Ui};

use crate::app::commands::Action;
use crate::app::state::AppState;
use crate::app::state::lesson::{LessonStep, Reading};
use crate::app::theme;
use crate::app::widgets::{Tip as _, panel_frame};

/// Width in points of the column with the buttons and the number of the step.
const BUTTONS: f32 = 190.0;

/// Shows the lesson that is being read, if there is one, above what is at the bottom so far.
pub(super) fn show(ui: &mut Ui, state: &mut AppState) {
    let Some(mut reading) = state.layout.lesson.take() else { return };
    if let Some(shown) = &state.model.presented {
        reading.measure(shown, &state.wanted.camera);
    }
    let strip =
        Panel::bottom("lesson").frame(panel_frame(Margin::symmetric(12, 8))).show(ui, |ui| content(ui, &reading));
    state.layout.lesson = Some(reading);
    if let Some(action) = strip.inner {
        action.perform(state);
    }
}

/// Title, caption and question beside the buttons. Returns the action that was chosen.
fn content(ui: &mut Ui, reading: &Reading) -> Option<Action> {
    let width = (ui.available_width() - BUTTONS).max(160.0);
    let palette = theme::palette(ui);
    ui.horizontal_top(|ui| {
        ui.vertical(|ui| {
            ui.set_width(width);
            // The same height at each step, so that the picture keeps its size.
            let height = reading.lesson.steps.iter().map(|step| height(ui, step, width)).fold(0.0, f32::max);
            ui.set_min_height(height);
            ui.label(RichText::new(&reading.lesson.title).strong().color(palette.text));
            ui.add(Label::new(reading.caption()).wrap());
            let question = &reading.current().question;
            if !question.is_empty() {
                ui.add(Label::new(RichText::new(question).color(palette.warm)).wrap());
            }
        });
        ui.with_layout(Layout::top_down(Align::Max), |ui| {
            let count = format!("{} of {}", reading.step + 1, reading.lesson.steps.len());
            ui.label(RichText::new(count).small().color(palette.dim));
            ui.with_layout(Layout::right_to_left(Align::Min), |ui| buttons(ui, reading)).inner
        })
        .inner
    })
    .inner
}

/// Height of title, caption and question of a step in points.
fn height(ui: &Ui, step: &LessonStep, width: f32) -> f32 {
    let font = TextStyle::Body.resolve(ui.style());
    let text = |text: &str| ui.painter().layout(text.to_owned(), font.clone(), theme::palette(ui).text, width).size().y;
    let parts = ["", &step.caption[..], &step.question[..]];
    let shown = parts.iter().enumerate().filter(|(index, part)| *index == 0 || !part.is_empty());
    shown.map(|(_, part)| text(part) + ui.spacing().item_spacing.y).sum()
}

/// The buttons from the right to the left.
fn buttons(ui: &mut Ui, reading: &Reading) -> Option<Action> {
    let last = reading.step + 1 == reading.lesson.steps.len();
    let mut chosen = None;
    let (label, tip) = if last {
        ("Done", "End the lesson; your own settings come back (Page Down)")
    } else {
        ("Next", "Go to the next step (Page Down)")
    };
    let text = RichText::new(label).color(ui.visuals().selection.stroke.color);
    if ui.add(Button::new(text).fill(ui.visuals().selection.bg_fill)).tip(tip).clicked() {
        chosen = Some(Action::LessonNext);
    }
    let back = ui.add_enabled(reading.step > 0, Button::new("Back"));
    if back.tip("Go to the step before (Page Up)").clicked() {
        chosen = Some(Action::LessonBack);
    }
    if !last && ui.button("Leave").tip("End the lesson; your own settings come back").clicked() {
        chosen = Some(Action::LeaveLesson);
    }
    chosen
}
