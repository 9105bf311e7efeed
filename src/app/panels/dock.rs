//! The dock above the depth bar: a strip of tabs and the open view.

use egui::{
    self, Align, Button, Layout, Margin, Panel, Rect, Role, ScrollArea, Sense, Ui, UiBuilder, Vec2, WidgetInfo, vec2,
};

use crate::app::commands::{Action, CompareStep, Entry, entries};
use crate::app::state::AppState;
use crate::app::theme;
use crate::app::views::{Tab, VIEWS, open_view};
use crate::app::widgets::{Icon, Tip as _, icon_button, note_place, panel_frame};

/// Smallest height in points.
const MIN_HEIGHT: f32 = 96.0;
/// Width beside a view in which outlines of its widgets are drawn, in points.
const ROOM_FOR_FOCUS: f32 = 4.0;
/// Share of the remaining height that the dock may take from the viewport.
const MAX_SHARE: f32 = 0.66;

/// Shows the dock if it is open.
pub(super) fn show(ui: &mut Ui, state: &mut AppState) {
    let Some(view) = open_view(state) else { return };
    let most = (ui.available_height() * MAX_SHARE).max(MIN_HEIGHT);
    let height = state.preferences.dock.height.clamp(MIN_HEIGHT, most);
    let panel = Panel::bottom("dock").resizable(true).default_size(height).size_range(MIN_HEIGHT..=most);
    let margin = Margin { left: 12, right: 12, top: 4, bottom: 4 };
    let place = panel.frame(panel_frame(margin)).show(ui, |ui| {
        tabs(ui, state, view);
        ui.add_space(2.0);
        within(ui, view.name, |ui| show_view(ui, state, view));
    });
    keep_height(ui, state, place.response.rect);
    note_place(ui.ctx(), "Dock", place.response.rect);
}

/// Shows `content` in the rest of the dock, which keeps its height, however little there is; what is higher is scrolled.
fn within(ui: &mut Ui, name: &str, content: impl FnOnce(&mut Ui)) {
    let id = ui.scope_id().with(name);
    let room = ui.available_rect_before_wrap();
    // As high as it was in the last frame. Most content takes the height that it gets.
    let height = ui.data(|data| data.get_temp(id)).unwrap_or(0.0_f32);
    let shown = |ui: &mut Ui, size: Vec2| {
        let place = Rect::from_min_size(ui.cursor().min, size);
        let mut child = ui.new_child(UiBuilder::new().max_rect(place));
        child.set_clip_rect(child.clip_rect().intersect(room.expand2(vec2(ROOM_FOR_FOCUS, 0.0))));
        content(&mut child);
        let height = child.min_rect().height().max(size.y);
        ui.allocate_exact_size(vec2(size.x, height), Sense::hover());
        height
    };
    let is_higher = height > room.height() + 1.0;
    let taken = if is_higher {
        let area = ScrollArea::vertical().id_salt(name).auto_shrink(false);
        area.show(ui, |ui| shown(ui, vec2(ui.available_width(), height))).inner
    } else {
        shown(&mut ui.new_child(UiBuilder::new().max_rect(room)), room.size())
    };
    ui.allocate_rect(room, Sense::hover());
    if taken != height {
        ui.data_mut(|data| data.insert_temp(id, taken));
        ui.ctx().request_repaint();
    }
}

/// Shows the view. While it is of an earlier frame of a model that plays, nodes of that tree cannot be selected or pointed at.
fn show_view(ui: &mut Ui, state: &mut AppState, view: &Tab) {
    let selection = state.model.is_view_behind().then(|| {
        let nodes = &state.selection.nodes;
        (nodes.selected, nodes.hovered, state.selection.side, state.selection.picked.clone())
    });
    (view.ui)(ui, state);
    if let Some((selected, hovered, side, picked)) = selection {
        (state.selection.nodes.selected, state.selection.nodes.hovered) = (selected, hovered);
        (state.selection.side, state.selection.picked) = (side, picked);
    }
}

/// Keeps a height that was dragged, for the next start. One that the window forces on the dock is not kept.
fn keep_height(ui: &Ui, state: &mut AppState, rect: Rect) {
    if ui.input(|input| input.pointer.any_down()) {
        state.preferences.dock.height = rect.height().round();
    }
}

/// The strip of tabs, with the button that closes the dock at its end.
fn tabs(ui: &mut Ui, state: &mut AppState, open: &Tab) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        for view in &VIEWS {
            let on = view.name == open.name;
            let action = Action::ToggleDock(view.name);
            let response = ui.add(Button::new(view.name).selected(on).frame_when_inactive(on));
            response.widget_info(|| WidgetInfo::selected(Role::Tab, true, on, view.name));
            if response.tip(format!("{} ({})", view.purpose, key_of(action))).clicked() {
                state.preferences.dock.show(view.name);
            }
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let (rect, _) = ui.allocate_exact_size(vec2(theme::ROW_HEIGHT, theme::ROW_HEIGHT), Sense::hover());
            let tip = format!("Close the dock; what was measured stays ({})", key_of(Action::ToggleDock(open.name)));
            if icon_button(ui, rect, Icon::Close, "Close dock").tip(tip).clicked() {
                state.preferences.dock.open = None;
            }
            if let Some(moment) = state.model.in_views().and_then(|shown| shown.accel.scene.moment)
                && state.model.is_view_behind()
            {
                let start = state.clip().map_or(0.0, |(_, clip)| clip.start);
                let tip = "The view is of the tree of this frame of the clip: what it shows takes longer than a frame";
                ui.weak(format!("at {:.2} s", moment.seconds - start)).tip(tip);
            }
            // The views are of the first tree, whichever is edited.
            let name = state.model.in_views().map_or_else(String::new, |shown| format!(", {}", shown.name()));
            let tip =
                format!("The views show tree A{name}. A click exchanges the two trees, so that they show the other");
            if state.model.second.is_some() && ui.button("Tree A").tip(tip).clicked() {
                Action::Compare(CompareStep::Swap).perform(state);
            }
        });
    });
}

/// The first key of an action as text.
fn key_of(action: Action) -> String {
    entries().iter().find(|entry| entry.action == action).map_or_else(String::new, Entry::first_key)
}
