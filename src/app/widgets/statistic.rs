//! A row of statistics: name, value and unit, copied by a click and explained from its context menu.

use egui::{self, Align2, Color32, CornerRadius, Rect, Response, Role, Sense, TextStyle, Ui, WidgetInfo, pos2, vec2};

use super::difference;
use super::difference::{verdict_color, verdict_text};
use super::tip::Tip as _;
use crate::app::state::AppState;
use crate::app::state::comparison::{Comparison, Verdict};
use crate::app::{format, theme};
use crate::catalog::terms::Term;

/// A named value in a list of statistics.
#[derive(Debug, Clone)]
pub(crate) struct Statistic<'a> {
    name: &'a str,
    value: String,
    unit: &'a str,
    tip: String,
    term: Option<&'static Term>,
    change: Option<Change>,
    /// The value of the second tree, and how it compares.
    beside: Option<(String, Comparison)>,
}

/// Difference from the value of the tree before.
#[derive(Debug, Clone)]
struct Change {
    before: String,
    difference: String,
    verdict: Verdict,
}

impl<'a> Statistic<'a> {
    /// A value without unit and tooltip.
    pub(crate) fn new(name: &'a str, value: String) -> Self {
        Self { name, value, unit: "", tip: String::new(), term: None, change: None, beside: None }
    }

    /// Sets the unit, which is shown but not copied.
    pub(crate) fn unit(self, unit: &'a str) -> Self {
        Self { unit, ..self }
    }

    /// Sets the tooltip.
    pub(crate) fn tip(self, tip: impl Into<String>) -> Self {
        Self { tip: tip.into(), ..self }
    }

    /// Sets the glossary's term for the value.
    pub(crate) fn term(self, term: &'static Term) -> Self {
        Self { term: Some(term), ..self }
    }

    /// Adds the value before, as text and as a number beside the present one.
    pub(crate) fn change(self, before: String, numbers: (f64, f64), verdict: Verdict) -> Self {
        let difference = verdict_text(numbers.0, numbers.1, verdict);
        Self { change: Some(Change { before, difference, verdict }), ..self }
    }
}

impl Statistic<'_> {
    /// Adds the value of the second tree, and how it compares with that of the first.
    pub(crate) fn beside(self, second: String, comparison: Comparison) -> Self {
        Self { beside: Some((second, comparison)), ..self }
    }
}

/// Shows a row with the name on the left and the value on the right. A click copies the value.
pub(crate) fn statistic(ui: &mut Ui, state: &mut AppState, row: &Statistic<'_>) {
    let palette = theme::palette(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 16.0), Sense::click());
    let mut value = row.value.clone();
    if let Some((second, _)) = &row.beside {
        value = format!("A {value}  B {second}");
    }
    if !row.unit.is_empty() {
        value = format!("{value} {}", row.unit);
    }
    let line = row.beside.as_ref().and_then(|(_, comparison)| difference::line(*comparison, true, &palette));
    let spoken = line.as_ref().map_or_else(String::new, |(line, _)| format!(", {line}"));
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, format!("{} {value}{spoken}", row.name)));
    if response.hovered() {
        let background = rect.expand2(vec2(4.0, 0.0));
        ui.painter().rect_filled(background, CornerRadius::same(4), ui.visuals().faint_bg_color);
    }
    match &row.change {
        Some(change) => changed_value(ui, rect, row.name, &value, change),
        None => match (&row.beside, line) {
            (Some((_, comparison)), Some(line)) => pair_of_values(ui, rect, row.name, &value, (*comparison, line)),
            _ => value_text(ui, rect, &value),
        },
    }
    let font = TextStyle::Body.resolve(ui.style());
    ui.painter().text(pos2(rect.left(), rect.center().y), Align2::LEFT_CENTER, row.name, font, palette.dim);
    copies(state, &response, row.name, (&row.value, &value), row.term);
    let sentence = row.beside.as_ref().and_then(|(_, comparison)| {
        let number = |value: f64| if value.fract() == 0.0 { format!("{value}") } else { format::significant(value) };
        difference::sentence(*comparison, true, number)
    });
    let tip = sentence.map_or_else(|| row.tip.clone(), |sentence| format!("{}\n{sentence}", row.tip));
    response.tip(tip_with_hint(&tip));
}

/// A tooltip with what a click does below.
pub(crate) fn tip_with_hint(tip: &str) -> String {
    let hint = "Click to copy, right click for more";
    if tip.is_empty() { hint.to_owned() } else { format!("{tip}\n{hint}") }
}

/// Lets a click copy a value, and gives it a context menu that explains it. `value` is what is copied, and its text with unit.
pub(crate) fn copies(
    state: &mut AppState,
    response: &Response,
    name: &str,
    (value, text): (&str, &str),
    term: Option<&'static Term>,
) {
    let mut copy = response.clicked();
    response.context_menu(|ui| {
        copy |= ui.button("Copy value").clicked();
        if ui.button("Copy name and value").clicked() {
            state.copy(format!("{name}\t{text}"), &format!("{name} copied: {text}"));
        }
        if let Some(term) = term
            && ui.button(format!("What is “{}”?", term.name)).clicked()
        {
            state.layout.explain(term);
        }
    });
    if copy {
        state.copy(value.to_owned(), &format!("{name} copied: {text}"));
    }
}

/// Paints a value that has changed, and as much of the difference as fits beside it.
fn changed_value(ui: &Ui, rect: Rect, name: &str, value: &str, change: &Change) {
    let palette = theme::palette(ui);
    let color = verdict_color(change.verdict, &palette);
    value_text_in(ui, rect, value, if change.verdict == Verdict::Different { palette.accent } else { color });
    let mut left = rect;
    left.max.x -= text_width(ui, value) + 6.0;
    let available = left.width() - text_width(ui, name) - 8.0;
    let percent = change.difference.rsplit_once(' ').map_or("", |(percent, _)| percent);
    let texts =
        [format!("was {} · {}", change.before, change.difference), change.difference.clone(), percent.to_owned()];
    if let Some(text) = texts.iter().find(|text| text_width(ui, text) <= available) {
        value_text_in(ui, left, text, color);
    }
}

/// Paints the values of two trees, and as much of their difference as fits in front of them.
fn pair_of_values(ui: &Ui, rect: Rect, name: &str, value: &str, change: (Comparison, (String, Color32))) {
    let palette = theme::palette(ui);
    let (comparison, (line, color)) = change;
    let room = rect.width() - text_width(ui, name) - 8.0 - text_width(ui, value) - 24.0;
    let Some(text) = difference_within(&line, comparison, |text| text_width(ui, text) <= room) else {
        return value_text_in(ui, rect, value, color);
    };
    value_text_in(ui, rect, text, color);
    let mut left = rect;
    left.max.x -= text_width(ui, text) + 8.0;
    difference::paint_arrow(ui.painter(), left.right_center(), comparison, &palette);
    left.max.x -= 10.0;
    value_text_in(ui, left, value, palette.text);
}

/// The difference as far as it fits: without room for its word, sign and percentage remain of a change.
fn difference_within(line: &str, comparison: Comparison, fits: impl Fn(&str) -> bool) -> Option<&str> {
    let line = line.trim_start_matches("B ");
    let number = line.rsplit_once(' ').filter(|_| matches!(comparison, Comparison::Change { .. }));
    [Some(line), number.map(|(number, _)| number)].into_iter().flatten().find(|text| fits(text))
}

/// Width of a body text in points.
fn text_width(ui: &Ui, text: &str) -> f32 {
    let font = TextStyle::Body.resolve(ui.style());
    ui.painter().layout_no_wrap(text.to_owned(), font, Color32::WHITE).size().x
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

fn value_text_in(ui: &Ui, rect: Rect, value: &str, color: Color32) {
    let font = TextStyle::Body.resolve(ui.style());
    ui.painter().text(pos2(rect.right(), rect.center().y), Align2::RIGHT_CENTER, value, font, color);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_is_cut_where_a_sense_remains() {
        let change = Comparison::Change { before: 2.0, now: 3.0, verdict: Verdict::Worse, factor: None };
        let within = |line: &'static str, comparison, most: usize| {
            difference_within(line, comparison, |text| text.chars().count() <= most)
        };
        assert_eq!(
            [12, 8, 3].map(|most| within("B +50 % worse", change, most)),
            [Some("+50 % worse"), Some("+50 %"), None]
        );
        let none = |most| within("not comparable", Comparison::OtherContainer, most);
        assert_eq!([14, 8].map(none), [Some("not comparable"), None]);
    }
}
