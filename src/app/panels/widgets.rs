//! The pieces that panels are made of: sections, labelled rows, sliders that reset, values that can be copied.

use std::ops::RangeInclusive;

use eframe::egui::{
    self, Align, Align2, CornerRadius, Rect, Response, Role, Sense, Stroke, TextStyle, Ui, WidgetInfo, pos2, vec2,
};

use crate::app::panels::icons::Icon;
use crate::app::state::{AppState, Request, Severity};
use crate::app::theme;
use crate::app::theme::ROW_HEIGHT;

/// Width of the labels on the left of controls in points.
const LABEL_WIDTH: f32 = 84.0;
/// Width of the number beside a slider in points.
const NUMBER_WIDTH: f32 = 52.0;

/// Digits that a typed number may have beyond those that a handle sets.
const TYPED_DECIMALS: usize = 1;

/// What a section's header holds beside its title.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Header<'a> {
    /// What accessibility calls the section; its title where empty.
    pub(crate) name: &'a str,
    /// A value at the right end.
    pub(crate) summary: &'a str,
    /// A button that brings the section's settings back to their defaults; its tooltip.
    pub(crate) reset: Option<&'a str>,
}

/// A part of a panel under a heading that opens and closes it. Returns whether its reset button was pressed.
pub(crate) fn section(ui: &mut Ui, title: &str, header: Header<'_>, body: impl FnOnce(&mut Ui)) -> bool {
    let palette = theme::palette(ui);
    let id = ui.make_persistent_id(("section", title));
    let mut state = egui::collapsing_header::CollapsingState::load_with_default_open(ui.ctx(), id, true);
    ui.add_space(4.0);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW_HEIGHT), Sense::click());
    let response = response.on_hover_text(if state.is_open() { "Fold this part away" } else { "Open this part" });
    if response.clicked() {
        state.toggle(ui);
    }
    let open = state.is_open();
    let name = if header.name.is_empty() { sentence_case(title) } else { header.name.to_owned() };
    response.widget_info(|| WidgetInfo::selected(Role::DisclosureTriangle, true, open, format!("{name} section")));
    let color = if response.hovered() { ui.visuals().strong_text_color() } else { palette.dim };
    let icon = response
        .clone()
        .with_new_rect(Rect::from_center_size(pos2(rect.left() + 4.0, rect.center().y), vec2(8.0, 8.0)));
    egui::collapsing_header::paint_default_icon(ui, state.openness(ui.ctx()), &icon);
    let font = TextStyle::Heading.resolve(ui.style());
    ui.painter().text(pos2(rect.left() + 16.0, rect.center().y), Align2::LEFT_CENTER, title, font, color);
    let mut right = rect.right();
    let mut reset_pressed = false;
    if let Some(tip) = header.reset {
        let button = Rect::from_min_max(pos2(right - ROW_HEIGHT, rect.top()), rect.max);
        let name = format!("Reset {}", name.to_lowercase());
        reset_pressed = icon_button(ui, button, Icon::Reset, &name).on_hover_text(tip).clicked();
        right -= ROW_HEIGHT + 4.0;
    }
    if !header.summary.is_empty() {
        let font = TextStyle::Body.resolve(ui.style());
        ui.painter().text(pos2(right, rect.center().y), Align2::RIGHT_CENTER, header.summary, font, palette.text);
    }
    state.show_body_unindented(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 4.0;
        body(ui);
    });
    ui.add_space(4.0);
    let (line, _) = ui.allocate_exact_size(vec2(ui.available_width(), 1.0), Sense::hover());
    ui.painter().hline(line.x_range(), line.center().y, Stroke::new(1.0, palette.line));
    reset_pressed
}

fn sentence_case(title: &str) -> String {
    let mut chars = title.chars();
    chars
        .next()
        .map_or_else(String::new, |first| first.to_uppercase().chain(chars.flat_map(char::to_lowercase)).collect())
}

/// A button that is only an icon, without a frame until the pointer is over it.
pub(crate) fn icon_button(ui: &mut Ui, rect: Rect, icon: Icon, name: &str) -> Response {
    let palette = theme::palette(ui);
    let response = ui.interact(rect, ui.scope_id().with(("icon", name)), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, ui.is_enabled(), name));
    let hot = response.hovered() || response.has_focus();
    let behind = if hot { ui.visuals().widgets.hovered.weak_bg_fill } else { ui.visuals().panel_fill };
    if hot {
        ui.painter().rect_filled(rect.shrink(2.0), CornerRadius::same(4), behind);
    }
    let color = if hot { ui.visuals().strong_text_color() } else { palette.dim };
    icon.paint(ui.painter(), rect.center(), color, behind);
    response
}

/// A label on the left and a control that fills the rest. The control's accessible name is the label.
pub(crate) fn row(ui: &mut Ui, label: &str, tip: &str, control: impl FnOnce(&mut Ui) -> Response) -> Response {
    let palette = theme::palette(ui);
    ui.horizontal(|ui| {
        ui.set_min_height(ROW_HEIGHT);
        let (rect, _) = ui.allocate_exact_size(vec2(LABEL_WIDTH, ROW_HEIGHT), Sense::hover());
        let mut child =
            ui.new_child(egui::UiBuilder::new().max_rect(rect).layout(egui::Layout::left_to_right(Align::Center)));
        let name = child.add(egui::Label::new(egui::RichText::new(label).color(palette.dim)).truncate());
        let response = control(ui);
        name.on_hover_text(tip);
        response.on_hover_text(tip)
    })
    .inner
}

/// What a slider sets.
pub(crate) struct SliderSpec<'a> {
    /// Its name, also for accessibility.
    pub(crate) label: &'a str,
    /// What it does, what to expect, and its shortcut.
    pub(crate) tip: &'a str,
    /// Smallest and largest value.
    pub(crate) range: RangeInclusive<f64>,
    /// Where a double click brings it; marked with a tick.
    pub(crate) default: f64,
    /// Equal steps multiply rather than add.
    pub(crate) logarithmic: bool,
    /// Digits after the point; 0 for whole numbers.
    pub(crate) decimals: usize,
    /// A word for 0; empty where 0 is just a number.
    pub(crate) zero: &'a str,
}

/// A labelled slider with its number. Double click resets it. Returns whether the user changed the value; one that the
/// command line or an earlier run chose stays as it is, also where no handle reaches it.
pub(crate) fn slider(ui: &mut Ui, value: &mut f64, spec: &SliderSpec<'_>) -> bool {
    let before = *value;
    let mut touched = false;
    row(ui, spec.label, spec.tip, |ui| {
        let width = (ui.available_width() - NUMBER_WIDTH - ui.spacing().item_spacing.x).max(40.0);
        ui.spacing_mut().slider_width = width;
        let step = if spec.decimals == 0 { 1.0 } else { 0.1f64.powi(spec.decimals as i32) };
        // Over many orders of magnitude a key moves the handle by a point, else the value by its last digit.
        let wide = spec.logarithmic && spec.range.end() - spec.range.start() > 1000.0;
        let rail = ui.add(
            egui::Slider::new(value, spec.range.clone())
                .logarithmic(spec.logarithmic)
                .show_value(false)
                .clamping(egui::SliderClamping::Edits)
                .step_by(if wide { 0.0 } else { step }),
        );
        let current = *value;
        rail.widget_info(|| WidgetInfo::slider(ui.is_enabled(), current, spec.label));
        paint_tick(ui, rail.rect, spec);
        if rail.contains_pointer()
            && ui.input(|input| input.pointer.button_double_clicked(egui::PointerButton::Primary))
        {
            *value = spec.default;
            touched = true;
        }
        // As many digits as a value has that was typed.
        let most = if spec.decimals == 0 { 0 } else { spec.decimals + TYPED_DECIMALS };
        let shown = if is_round(*value, spec.decimals) { spec.decimals } else { most };
        let mut drag = egui::DragValue::new(value)
            .range(spec.range.clone())
            .clamp_existing_to_range(false)
            .speed(step * 0.25)
            .fixed_decimals(shown);
        if !spec.zero.is_empty() {
            drag = drag
                .custom_formatter(|number, _| if number == 0.0 { spec.zero.to_owned() } else { format!("{number:.0}") })
                .custom_parser(|text| if text.trim() == spec.zero { Some(0.0) } else { text.trim().parse().ok() });
        }
        let number = ui.add_sized(vec2(NUMBER_WIDTH, ROW_HEIGHT), drag);
        number.widget_info(|| {
            let mut info = WidgetInfo::drag_value(ui.is_enabled(), current);
            info.label = Some(format!("{} value", spec.label));
            info
        });
        let decimals = if number.changed() && !number.dragged() { most } else { spec.decimals };
        if rail.changed() || number.changed() {
            touched = true;
            let scale = 10f64.powi(decimals as i32);
            *value = (*value * scale).round() / scale;
        }
        rail | number
    });
    if !touched {
        *value = before;
    }
    *value != before
}

/// Whether `value` has no more digits after the point than these; single precision leaves dust behind them.
fn is_round(value: f64, decimals: usize) -> bool {
    let scaled = value * 10f64.powi(decimals as i32);
    (scaled - scaled.round()).abs() < 1e-3
}

/// Marks a slider's default on its rail.
fn paint_tick(ui: &Ui, rail: Rect, spec: &SliderSpec<'_>) {
    let (low, high) = (*spec.range.start(), *spec.range.end());
    let share = if spec.logarithmic {
        (spec.default.ln() - low.ln()) / (high.ln() - low.ln())
    } else {
        (spec.default - low) / (high - low)
    };
    let positions = rail.x_range().shrink(rail.height() / 2.5);
    let x = egui::lerp(positions.min..=positions.max, share as f32);
    let color = theme::palette(ui).dim;
    ui.painter().vline(x, rail.bottom() - 3.0..=rail.bottom(), Stroke::new(1.0, color));
}

/// A drop-down list of values, each with its name and what to expect of it.
pub(crate) fn combo<T: Copy + PartialEq>(
    ui: &mut Ui,
    label: &str,
    tip: &str,
    value: &mut T,
    choices: &[(T, &str, &str)],
    refusal: impl Fn(T) -> Option<String>,
) -> bool {
    let before = *value;
    row(ui, label, tip, |ui| {
        let selected = choices.iter().find(|(choice, ..)| choice == value).map_or("", |(_, name, _)| name);
        let response = egui::ComboBox::from_id_salt(label)
            .width(ui.available_width())
            .selected_text(selected)
            .truncate()
            .show_ui(ui, |ui| {
                for &(choice, name, meaning) in choices {
                    let refused = refusal(choice);
                    let button = egui::Button::selectable(*value == choice, name);
                    let response = ui.add_enabled(refused.is_none() || *value == choice, button).on_hover_text(meaning);
                    let response = match refused {
                        Some(reason) => response.on_disabled_hover_text(reason),
                        None => response,
                    };
                    if response.clicked() {
                        *value = choice;
                    }
                }
            })
            .response;
        response.widget_info(|| {
            let mut info = WidgetInfo::labeled(Role::ComboBox, ui.is_enabled(), label);
            info.current_text_value = Some(selected.to_owned());
            info
        });
        response
    });
    *value != before
}

/// A check box with a tooltip.
pub(crate) fn check(ui: &mut Ui, value: &mut bool, label: &str, tip: &str) -> bool {
    ui.checkbox(value, label).on_hover_text(tip).changed()
}

/// A small button; `on` highlights it.
pub(crate) fn chip(ui: &mut Ui, label: &str, on: bool, tip: &str) -> bool {
    ui.add(egui::Button::new(label).selected(on)).on_hover_text(tip).clicked()
}

/// A name with its value, as statistics list them.
#[derive(Debug, Clone)]
pub(crate) struct Statistic<'a> {
    name: &'a str,
    value: String,
    unit: &'a str,
    tip: String,
    /// The value before, and the change in percent.
    change: Option<(String, String)>,
}

impl<'a> Statistic<'a> {
    pub(crate) fn new(name: &'a str, value: String) -> Self {
        Self { name, value, unit: "", tip: String::new(), change: None }
    }

    pub(crate) fn unit(self, unit: &'a str) -> Self {
        Self { unit, ..self }
    }

    pub(crate) fn tip(self, tip: impl Into<String>) -> Self {
        Self { tip: tip.into(), ..self }
    }

    /// Shows for a while where the value came from.
    pub(crate) fn change(self, before: String, percent: String) -> Self {
        Self { change: Some((before, percent)), ..self }
    }
}

/// A row of statistics: name on the left, value on the right. A click copies the value.
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
        let room = value_rect.width() - text_width(ui, row.name) - 8.0;
        let with_percent = format!("was {before} · {percent}");
        let text = if text_width(ui, &with_percent) <= room { with_percent } else { percent.clone() };
        value_text_in(ui, value_rect, &text, palette.dim);
    });
    if changed.is_none() {
        value_text(ui, rect, &value);
    }
    ui.painter().text(pos2(rect.left(), rect.center().y), Align2::LEFT_CENTER, row.name, font, palette.dim);
    if response.clicked() {
        state.requests.push(Request::Copy(row.value.clone()));
        state.notify(Severity::Info, format!("{} copied: {value}", row.name));
    }
    let hint = "Click to copy";
    let tip = if row.tip.is_empty() { hint.to_owned() } else { format!("{}\n{hint}", row.tip) };
    response.on_hover_text(tip);
}

fn text_width(ui: &Ui, text: &str) -> f32 {
    let font = TextStyle::Body.resolve(ui.style());
    ui.painter().layout_no_wrap(text.to_owned(), font, egui::Color32::WHITE).size().x
}

/// A value at the right end of `rect`, its unit (what follows the first blank after a digit) dimmed.
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
