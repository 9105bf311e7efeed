//! Tooltips: beside the panel, menu or list that a widget is in, so that they cover none of its rows, none over a dialog, message or
//! card, and none while a button is held.

use egui::containers::Tooltip;
use egui::{Context, Id, Label, Order, Rect, RectAlign, Response, WidgetText, pos2, vec2};

use crate::app::state::Side;

/// Width beside the items of a menu, with its scroll bar, in points.
const MENU_MARGIN: f32 = 18.0;

/// Adds tooltips to a widget.
pub(crate) trait Tip {
    /// A tooltip while the widget is enabled.
    fn tip(self, text: impl Into<WidgetText>) -> Self;
    /// A tooltip while the widget is disabled.
    fn disabled_tip(self, text: impl Into<WidgetText>) -> Self;
}

impl Tip for Response {
    fn tip(self, text: impl Into<WidgetText>) -> Self {
        show(Tooltip::for_enabled(&self), &self, text.into());
        self
    }

    fn disabled_tip(self, text: impl Into<WidgetText>) -> Self {
        show(Tooltip::for_disabled(&self), &self, text.into());
        self
    }
}

fn show(mut tooltip: Tooltip<'_>, response: &Response, text: WidgetText) {
    let hushed = response.ctx.data(|data| data.get_temp(Id::unique("hushed"))).flatten();
    let is_hushed = hushed.is_some_and(|place: Rect| place.intersects(response.rect));
    if text.is_empty() || is_hushed || response.ctx.input(|input| input.pointer.any_down()) {
        return;
    }
    let reach = vec2(response.ctx.global_style().spacing.tooltip_width + MENU_MARGIN, REACH);
    if let Some((panel, side)) = panel_of(response) {
        let rows = response.rect.y_range();
        let anchor = Rect::from_min_max(pos2(panel.left(), rows.min), pos2(panel.right(), rows.max));
        let align = if side == Side::Left { RectAlign::RIGHT_START } else { RectAlign::LEFT_START };
        if is_covered(response, anchor.expand2(reach)) {
            return;
        }
        tooltip.popup = tooltip.popup.anchor(anchor).align(align);
    } else if is_covered(response, response.rect.expand2(reach)) {
        return;
    } else if response.layer_id.order == Order::Foreground {
        let anchor = response.rect.expand2(vec2(MENU_MARGIN, 0.0));
        tooltip.popup = tooltip.popup.anchor(anchor).align(RectAlign::RIGHT_START);
    }
    tooltip.show(|ui| {
        ui.set_max_width(ui.spacing().tooltip_width);
        ui.add(Label::new(text).wrap());
    });
}

/// Height in points above and below a widget within which its tooltip is.
const REACH: f32 = 120.0;

/// Places of dialogs, messages and cards, by the number of the UI frame that shows them.
#[derive(Clone, Default)]
struct Fronts(Vec<(u64, Rect)>);

/// Notes the place of a dialog, message or card, over which no tooltip of what lies behind is shown from the next UI frame on.
pub(crate) fn note_front(ctx: &Context, rect: Rect) {
    let now = ctx.cumulative_frame_nr();
    ctx.data_mut(|data| {
        let Fronts(places) = data.get_temp_mut_or_default(Id::unique("fronts"));
        places.retain(|(frame, _)| frame + 1 >= now);
        places.push((now, rect));
    });
}

/// True if a tooltip of the widget somewhere in `reach` could lie over a dialog, message or card that the widget is not in.
fn is_covered(response: &Response, reach: Rect) -> bool {
    let now = response.ctx.cumulative_frame_nr();
    let Fronts(places) = response.ctx.data(|data| data.get_temp(Id::unique("fronts"))).unwrap_or_default();
    let mut places = places.iter().filter(|(frame, _)| frame + 1 >= now);
    places.any(|(_, place)| place.intersects(reach) && !place.contains(response.rect.center()))
}

/// Shows no tooltips within a place from the next UI frame on, because a card explains it; `None` shows all again.
pub(crate) fn hush(ctx: &Context, place: Option<Rect>) {
    ctx.data_mut(|data| data.insert_temp(Id::unique("hushed"), place));
}

/// Notes where a side panel is; its widgets' tooltips are shown beside it from the next UI frame on.
pub(crate) fn note_panel(ctx: &Context, side: Side, rect: Option<Rect>) {
    ctx.data_mut(|data| data.insert_temp(id(side), rect));
}

/// The side panel that a widget is in. Drop-down lists and menus are in none, though they may lie over one.
fn panel_of(response: &Response) -> Option<(Rect, Side)> {
    if response.layer_id.order != Order::Background {
        return None;
    }
    [Side::Left, Side::Right].into_iter().find_map(|side| {
        let panel: Option<Rect> = response.ctx.data(|data| data.get_temp(id(side))).flatten();
        panel.filter(|panel| panel.contains(response.rect.center())).map(|panel| (panel, side))
    })
}

fn id(side: Side) -> Id {
    Id::unique(if side == Side::Left { "left panel's place" } else { "right panel's place" })
}
