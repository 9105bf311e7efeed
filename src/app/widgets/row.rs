//! Labelled rows, and small controls for them: check boxes, chips.

use egui::{self, Align, Context, Id, Rect, Response, Sense, Ui, vec2};

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
