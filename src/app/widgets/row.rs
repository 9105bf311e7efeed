//! Labelled rows, and small controls for them: check boxes, chips, drop-down lists.

use egui::text::LayoutJob;
use egui::{
    self, Align, ComboBox, Context, Id, Rect, Response, Role, Sense, TextFormat, TextStyle, Ui, WidgetInfo, WidgetText,
    vec2,
};

use super::tip::Tip as _;
use crate::app::theme;
use crate::app::theme::ROW_HEIGHT;

/// Width of the label column in points.
const LABEL_WIDTH: f32 = 84.0;

/// A label on the left and a control that fills the rest; both show `tip`.
pub(crate) fn row(ui: &mut Ui, label: &str, tip: &str, control: impl FnOnce(&mut Ui) -> Response) -> Response {
    let palette = theme::palette(ui);
    ui.horizontal(|ui| {
        ui.set_min_height(ROW_HEIGHT);
        let (rect, _) = ui.allocate_exact_size(vec2(LABEL_WIDTH, ROW_HEIGHT), Sense::hover());
        let mut child =
            ui.new_child(egui::UiBuilder::new().max_rect(rect).layout(egui::Layout::left_to_right(Align::Center)));
        let name = child.add(egui::Label::new(egui::RichText::new(label).color(palette.dim)).truncate());
        let response = control(ui);
        note_place(ui.ctx(), label, rect.union(response.rect).intersect(ui.clip_rect()));
        name.tip(tip);
        response.tip(tip)
    })
    .inner
}

/// Notes where a row is, for [`place_of`].
pub(crate) fn note_place(ctx: &Context, name: &str, rect: Rect) {
    ctx.data_mut(|data| data.insert_temp(Id::unique(("place", name)), rect));
}

/// Where the row of this label was when it was last shown, unless it was scrolled away.
pub(crate) fn place_of(ctx: &Context, name: &str) -> Option<Rect> {
    ctx.data(|data| data.get_temp(Id::unique(("place", name)))).filter(Rect::is_positive)
}

/// A check box with a tooltip. Returns whether it was toggled.
pub(crate) fn check(ui: &mut Ui, value: &mut bool, label: &str, tip: &str) -> bool {
    ui.checkbox(value, label).tip(tip).changed()
}

/// A button that is highlighted where `on` is set. Returns whether it was clicked.
pub(crate) fn chip(ui: &mut Ui, label: &str, on: bool, tip: &str) -> bool {
    ui.add(egui::Button::new(label).selected(on)).tip(tip).clicked()
}

/// A drop-down list of values, each with its name and tooltip. Returns whether the value changed.
pub(crate) fn combo<T: Copy + PartialEq>(
    ui: &mut Ui,
    label: &str,
    tip: &str,
    value: &mut T,
    choices: &[(T, &str, &str)],
) -> bool {
    labelled_drop_down(ui, label, tip, value, choices, |_| None, |_, name, _| name.into())
}

/// The same, with each value's sentence below its name. Values for which `refusal` returns a reason cannot be chosen.
pub(crate) fn explained_combo<T: Copy + PartialEq>(
    ui: &mut Ui,
    label: &str,
    tip: &str,
    value: &mut T,
    choices: &[(T, &str, &str)],
    refusal: impl Fn(T) -> Option<String>,
) -> bool {
    labelled_drop_down(ui, label, tip, value, choices, refusal, |ui, name, sentence| {
        let [large, small] = [TextStyle::Button, TextStyle::Small].map(|style| style.resolve(ui.style()));
        let mut job =
            LayoutJob::single_section(format!("{name}\n"), TextFormat::simple(large, ui.visuals().text_color()));
        job.append(sentence, 0.0, TextFormat::simple(small, theme::palette(ui).dim));
        job.into()
    })
}

fn labelled_drop_down<T: Copy + PartialEq>(
    ui: &mut Ui,
    label: &str,
    tip: &str,
    value: &mut T,
    choices: &[(T, &str, &str)],
    refusal: impl Fn(T) -> Option<String>,
    entry: impl Fn(&Ui, &str, &str) -> WidgetText,
) -> bool {
    let before = *value;
    row(ui, label, tip, |ui| {
        let list = ComboBox::from_id_salt(label).width(ui.available_width()).height(360.0).truncate();
        drop_down(ui, list, label, value, choices, refusal, entry)
    });
    *value != before
}

/// A drop-down `list` without refusals, named `name` for screen readers.
pub(crate) fn plain_drop_down<T: Copy + PartialEq>(
    ui: &mut Ui,
    list: ComboBox,
    name: &str,
    value: &mut T,
    choices: &[(T, &str, &str)],
) -> Response {
    drop_down(ui, list, name, value, choices, |_| None, |_, name, _| name.into())
}

/// The same, where values for which `refusal` returns a reason cannot be chosen.
pub(crate) fn refusable_drop_down<T: Copy + PartialEq>(
    ui: &mut Ui,
    list: ComboBox,
    name: &str,
    value: &mut T,
    choices: &[(T, &str, &str)],
    refusal: impl Fn(T) -> Option<String>,
) -> Response {
    drop_down(ui, list, name, value, choices, refusal, |_, name, _| name.into())
}

/// The list behind all of them: a key or a press outside closes it, too.
fn drop_down<T: Copy + PartialEq>(
    ui: &mut Ui,
    list: ComboBox,
    name: &str,
    value: &mut T,
    choices: &[(T, &str, &str)],
    refusal: impl Fn(T) -> Option<String>,
    entry: impl Fn(&Ui, &str, &str) -> WidgetText,
) -> Response {
    let selected = choices.iter().find(|(choice, ..)| choice == value).map_or("", |(_, name, _)| name);
    let mut area = None;
    let items = |ui: &mut Ui| {
        area = ui.memory(|memory| memory.area_rect(ui.layer_id().id));
        for &(choice, name, meaning) in choices {
            let refused = refusal(choice);
            let on = *value == choice;
            let button = egui::Button::selectable(on, entry(ui, name, meaning));
            let response = ui.add_enabled(refused.is_none() || on, button).tip(meaning);
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
    };
    let response = list.selected_text(selected).show_ui(ui, items).response;
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
        info.current_text_value = Some(selected.to_owned());
        info
    });
    response
}
