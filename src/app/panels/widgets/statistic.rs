//! A row of statistics: name, value and unit, copied by a click.

use egui::{self, Align2, CornerRadius, Rect, Role, Sense, TextStyle, Ui, WidgetInfo, pos2, vec2};

use crate::app::state::{AppState, Request, Severity};
use crate::app::theme;

/// A named value in a list of statistics.
#[derive(Debug, Clone)]
pub(crate) struct Statistic<'a> {
    name: &'a str,
    value: String,
    unit: &'a str,
    tip: String,
    /// Previous value, and the relative change as a percentage.
    change: Option<(String, String)>,
}

impl<'a> Statistic<'a> {
    /// A value without unit and tooltip.
    pub(crate) fn new(name: &'a str, value: String) -> Self {
        Self { name, value, unit: "", tip: String::new(), change: None }
    }

    /// Sets the unit, which is shown but not copied.
    pub(crate) fn unit(self, unit: &'a str) -> Self {
        Self { unit, ..self }
    }

    /// Sets the tooltip.
    pub(crate) fn tip(self, tip: impl Into<String>) -> Self {
        Self { tip: tip.into(), ..self }
    }

    /// Adds the previous value and the relative change.
    pub(crate) fn change(self, before: String, percent: String) -> Self {
        Self { change: Some((before, percent)), ..self }
    }
}

/// Shows a row with the name on the left and the value on the right. A click copies the value.
pub(crate) fn statistic(ui: &mut Ui, state: &mut AppState, row: &Statistic<'_>) {
    let palette = theme::palette(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 16.0), Sense::click());
    let value = if row.unit.is_empty() { row.value.clone() } else { format!("{} {}", row.value, row.unit) };
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, format!("{} {value}", row.name)));
    if response.hovered() {
        let background = rect.expand2(vec2(4.0, 0.0));
        ui.painter().rect_filled(background, CornerRadius::same(4), ui.visuals().faint_bg_color);
    }
    let font = TextStyle::Body.resolve(ui.style());
    let mut value_rect = rect;
    let changed = row.change.as_ref().map(|(before, percent)| {
        value_text_in(ui, rect, &value, palette.accent);
        let width = text_width(ui, &value);
        value_rect.max.x -= width + 4.0;
        let available = value_rect.width() - text_width(ui, row.name) - 8.0;
        let with_percent = format!("was {before} · {percent}");
        let text = if text_width(ui, &with_percent) <= available { with_percent } else { percent.clone() };
        value_text_in(ui, value_rect, &text, palette.dim);
    });
    if changed.is_none() {
        value_text(ui, rect, &value);
    }
    ui.painter().text(pos2(rect.left(), rect.center().y), Align2::LEFT_CENTER, row.name, font, palette.dim);
    if response.clicked() {
        state.requests.push(Request::Copy(row.value.clone()));
        state.messages.notify(Severity::Info, format!("{} copied: {value}", row.name));
    }
    let hint = "Click to copy";
    let tip = if row.tip.is_empty() { hint.to_owned() } else { format!("{}\n{hint}", row.tip) };
    response.on_hover_text(tip);
}

/// Width of a body text in points.
fn text_width(ui: &Ui, text: &str) -> f32 {
    let font = TextStyle::Body.resolve(ui.style());
    ui.painter().layout_no_wrap(text.to_owned(), font, egui::Color32::WHITE).size().x
}

/// Paints a value at the right end of `rect`, with its unit (a word after the last space) dimmed.
pub(crate) fn value_text(ui: &Ui, rect: Rect, value: &str) {
    let palette = theme::palette(ui);
    let split = value.rfind(' ').filter(|&at| value[at + 1..].starts_with(|c: char| c.is_alphabetic() || c == '%'));
    let Some(at) = split else {
        value_text_in(ui, rect, value, palette.text);
        return;
    };
    let unit_width = text_width(ui, &value[at..]);
    value_text_in(ui, rect, &value[at + 1..], palette.dim);
    value_text_in(
        ui,
        Rect::from_min_max(rect.min, pos2(rect.right() - unit_width, rect.bottom())),
        &value[..at],
        palette.text,
    );
}

fn value_text_in(ui: &Ui, rect: Rect, value: &str, color: egui::Color32) {
    let font = TextStyle::Body.resolve(ui.style());
    ui.painter().text(pos2(rect.right(), rect.center().y), Align2::RIGHT_CENTER, value, font, color);
}
