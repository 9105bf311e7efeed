//! Drop-down lists of values.

use egui::text::LayoutJob;
use egui::{self, ComboBox, PopupCloseBehavior, Response, Role, TextFormat, TextStyle, Ui, WidgetInfo, WidgetText};

use super::row::row;
use super::tip::Tip as _;
use crate::app::theme;

/// Largest height of an open list in points.
const MAX_HEIGHT: f32 = 360.0;

/// A drop-down list of values, each with its name and meaning.
pub(crate) struct DropDown<'a, T> {
    name: &'a str,
    choices: &'a [(T, &'a str, &'a str)],
    width: Option<f32>,
    is_truncated: bool,
    is_explained: bool,
    refusal: &'a dyn Fn(T) -> Option<String>,
}

impl<'a, T: Copy + PartialEq> DropDown<'a, T> {
    /// A list of `choices`, named `name` for screen readers, and its label in a row.
    pub(crate) fn new(name: &'a str, choices: &'a [(T, &'a str, &'a str)]) -> Self {
        Self { name, choices, width: None, is_truncated: false, is_explained: false, refusal: &|_| None }
    }

    /// At least `width` points wide.
    pub(crate) fn width(self, width: f32) -> Self {
        Self { width: Some(width), ..self }
    }

    /// Exactly `width` points wide: longer names are cut.
    pub(crate) fn exact_width(self, width: f32) -> Self {
        Self { width: Some(width), is_truncated: true, ..self }
    }

    /// The meaning of each value is below its name.
    pub(crate) fn explained(self) -> Self {
        Self { is_explained: true, ..self }
    }

    /// Values for which `refusal` returns a reason cannot be chosen.
    pub(crate) fn refusing(self, refusal: &'a dyn Fn(T) -> Option<String>) -> Self {
        Self { refusal, ..self }
    }

    /// Shows the list in a row of a panel. Returns whether the value changed.
    pub(crate) fn row(self, ui: &mut Ui, tip: &str, value: &mut T) -> bool {
        let before = *value;
        row(ui, self.name, tip, |ui| {
            let width = ui.available_width();
            self.exact_width(width).show(ui, value)
        });
        *value != before
    }

    /// Shows the list beside a label.
    pub(crate) fn beside(self, ui: &mut Ui, label: &str, tip: &str, value: &mut T) {
        ui.weak(label).tip(tip);
        self.show(ui, value).tip(tip);
    }

    /// Shows the list. A key or a press outside closes it, too.
    pub(crate) fn show(self, ui: &mut Ui, value: &mut T) -> Response {
        let chosen = self.choices.iter().find(|(choice, ..)| choice == value).map_or("", |(_, name, _)| name);
        let mut list = ComboBox::from_id_salt(("drop-down", self.name));
        if let Some(width) = self.width {
            list = list.width(width);
        }
        if self.is_truncated {
            list = list.truncate();
        }
        let items = |ui: &mut Ui| {
            for choice in self.choices {
                self.item(ui, value, choice);
            }
        };
        show_list(ui, list, (self.name, chosen), items)
    }

    /// A value in the list.
    fn item(&self, ui: &mut Ui, value: &mut T, &(choice, name, meaning): &(T, &str, &str)) {
        let refused = (self.refusal)(choice);
        let on = *value == choice;
        let text = if self.is_explained { explained(ui, name, meaning) } else { name.into() };
        let response = ui.add_enabled(refused.is_none() || on, egui::Button::selectable(on, text)).tip(meaning);
        response.widget_info(|| WidgetInfo::selected(Role::Button, ui.is_enabled(), on, name));
        let response = match refused {
            Some(reason) => response.disabled_tip(reason),
            None => response,
        };
        if response.clicked() {
            *value = choice;
            // A key closes no list by itself.
            ui.close();
        }
    }
}

/// A list of check boxes, which stays open while they are clicked, in the rest of a row. `chosen` says which are on.
pub(crate) fn several(ui: &mut Ui, name: &str, chosen: &str, items: impl FnOnce(&mut Ui)) -> Response {
    let list = ComboBox::from_id_salt(("several", name)).width(ui.available_width()).truncate();
    show_list(ui, list.close_behavior(PopupCloseBehavior::CloseOnClickOutside), (name, chosen), items)
}

/// Shows a list, closed with what is `chosen`, open with its `items`.
fn show_list(ui: &mut Ui, list: ComboBox, (name, chosen): (&str, &str), items: impl FnOnce(&mut Ui)) -> Response {
    let mut area = None;
    let items = |ui: &mut Ui| {
        area = ui.memory(|memory| memory.area_rect(ui.layer_id().id));
        items(ui);
    };
    let response = list.height(MAX_HEIGHT).selected_text(chosen).show_ui(ui, items).response;
    // Egui closes it after a click only, not where a drag begins.
    let pressed = ui.input(|input| input.pointer.press_origin().filter(|_| input.pointer.any_pressed()));
    if let (Some(area), Some(at)) = (area, pressed)
        && !area.contains(at)
        && !response.rect.contains(at)
    {
        egui::Popup::close_all(ui.ctx());
    }
    response.widget_info(|| {
        let mut info = WidgetInfo::labeled(Role::ComboBox, ui.is_enabled(), name);
        info.current_text_value = Some(chosen.to_owned());
        info
    });
    response
}

/// A name with a sentence below it.
pub(crate) fn explained(ui: &Ui, name: &str, sentence: &str) -> WidgetText {
    let [large, small] = [TextStyle::Button, TextStyle::Small].map(|style| style.resolve(ui.style()));
    let mut job = LayoutJob::single_section(format!("{name}\n"), TextFormat::simple(large, ui.visuals().text_color()));
    job.append(sentence, 0.0, TextFormat::simple(small, theme::palette(ui).dim));
    job.into()
}
