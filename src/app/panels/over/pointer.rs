//! Facts about the pixel under the pointer, and the keys of fly mode. The menu of a node, opened by a click with the
//! second button on the model.

use egui::{self, Button, CornerRadius, FontId, Id, Popup, PopupAnchor, Pos2, Rect, Ui, pos2, vec2};

use crate::app::commands::{Action, entries};
use crate::app::state::{AppState, CompareView, Navigation, Presented};
use crate::app::widgets::Tip as _;
use crate::app::{format, theme};
use crate::render::{Frame, Shading};

/// Shows the facts within `rect`, the viewport's rectangle.
pub(crate) fn facts(ui: &Ui, rect: Rect, state: &AppState) {
    if state.preferences.navigation == Navigation::Fly {
        // Below the facts about the pixel.
        note(ui, rect, rect.min + vec2(12.0, 40.0), "flying: W A S D, Q E, drag to look · Shift faster · V ends");
    }
    let Some(hover) = state.selection.hover else { return };
    let shading = state.model.presented.as_ref().map(|shown| shown.frame.settings.shading);
    let mut facts = Vec::new();
    let pointer = ui.ctx().pointer_latest_pos().filter(|pointer| rect.contains(*pointer));
    if let Some(text) = difference_at(state, hover.x_px, hover.y_px) {
        match pointer {
            Some(pointer) => note(ui, rect, pointer + vec2(16.0, 16.0), &text),
            None => facts.push(text),
        }
    } else if let (Some(value), Some(Shading::Heat(kind))) = (hover.value, shading) {
        let count = value.max(0.0).round() as u64;
        let text = if count == 1 {
            crate::text::counted(1, kind.counted())
        } else {
            format!("{} {}", format::count(count), kind.counted())
        };
        match pointer {
            Some(pointer) => note(ui, rect, pointer + vec2(16.0, 16.0), &text),
            None => facts.push(text),
        }
    }
    if let (Some(value), Some(shading @ (Shading::Thickness | Shading::Distance))) = (hover.value, shading)
        && value < Frame::NO_HIT
    {
        let value = format::significant(f64::from(value));
        let text = match shading {
            Shading::Thickness => format!("{value} thick"),
            _ => format!("{value} from the surface"),
        };
        facts.push(text);
    }
    match hover.primitive {
        Some(primitive) => {
            let copy = |shown: &Presented| {
                let (copy, triangle) = shown.accel.scene.copy_of(primitive)?;
                let triangle = triangle.map(|triangle| format!(" / triangle {}", format::count(u64::from(triangle))));
                Some(shown.copy_name(copy) + &triangle.unwrap_or_default())
            };
            let copy = state.model.presented.as_ref().and_then(copy);
            facts.push(copy.unwrap_or_else(|| format!("triangle {}", format::count(u64::from(primitive)))));
            facts.push(format!("distance {}", format::significant(f64::from(hover.distance))));
        }
        None => facts.push("background".to_owned()),
    }
    facts.push(format!("pixel {}, {}", hover.x_px, hover.y_px));
    note(ui, rect, rect.min + vec2(12.0, 12.0), &facts.join(" · "));
}

/// The tests of both trees at a pixel, while their difference is shown.
fn difference_at(state: &AppState, x_px: u32, y_px: u32) -> Option<String> {
    let difference = state.model.difference.as_ref().filter(|_| state.shown_view() == CompareView::Difference)?;
    let [a, b, difference] = difference.map.at(x_px, y_px)?;
    let count = |value: f32| format::count(value.max(0.0).round() as u64);
    let sign = if difference > 0.0 {
        "+"
    } else if difference < 0.0 {
        "−"
    } else {
        ""
    };
    Some(format!("A {} · B {} · B − A {sign}{}", count(a), count(b), count(difference.abs())))
}

/// A line of text on a translucent background, shifted to lie inside `rect`.
fn note(ui: &Ui, rect: Rect, at: Pos2, text: &str) {
    let palette = theme::palette(ui);
    let galley = ui.painter().layout_no_wrap(text.to_owned(), FontId::proportional(theme::HEADING_SIZE), palette.text);
    let size = galley.size() + vec2(16.0, 8.0);
    let left = at.x.min(rect.right() - size.x - 4.0).max(rect.left() + 4.0);
    let top = at.y.min(rect.bottom() - size.y - 4.0).max(rect.top() + 4.0);
    let back = Rect::from_min_size(pos2(left, top), size);
    ui.painter().rect_filled(back, CornerRadius::same(6), palette.veil);
    ui.painter().galley(back.min + vec2(8.0, 4.0), galley, palette.text);
}

/// Entries of the menu, in groups.
const GROUPS: [&[(Action, &str)]; 3] = [
    &[
        (Action::SelectParent, "Select parent"),
        (Action::SelectChild, "Select child"),
        (Action::FrameSelection, "Frame"),
    ],
    &[(Action::HideSelected, "Hide"), (Action::IsolateSelected, "Isolate"), (Action::ShowAll, "Show all")],
    &[(Action::ToggleUnfolded, "Unfold or fold copies"), (Action::CopyNode, "Copy as text")],
];

/// Shows the menu of a node while it is open, within `rect`, the viewport's rectangle.
pub(crate) fn node_menu(ui: &mut Ui, rect: Rect, state: &mut AppState) {
    let Some([x, y]) = state.layout.node_menu else { return };
    let at = PopupAnchor::Position(rect.clamp(pos2(x, y)));
    let mut open = true;
    Popup::new(Id::unique("node menu"), ui.ctx().clone(), at, ui.layer_id()).open_bool(&mut open).show(|ui| {
        ui.set_min_width(160.0);
        if let Some(node) = state.selection.nodes.selected {
            let shown = state.model.presented.as_ref();
            let place = shown.and_then(|shown| shown.place_in_mesh(node)).map(|place| format::capital(&place));
            let name = place.unwrap_or_else(|| format!("Node {}", format::count(node.into())));
            ui.label(egui::RichText::new(name).color(crate::app::theme::palette(ui).dim));
        }
        for (index, group) in GROUPS.into_iter().enumerate() {
            if index > 0 {
                ui.separator();
            }
            for &(action, label) in group {
                item(ui, state, action, label);
            }
        }
    });
    if !open {
        state.layout.node_menu = None;
    }
}

fn item(ui: &mut Ui, state: &mut AppState, action: Action, label: &str) {
    let Some(entry) = entries().iter().find(|entry| entry.action == action) else { return };
    let button = Button::selectable(false, label).shortcut_text(entry.first_key());
    let response = ui.add_enabled(action.is_enabled(state), button).tip(&entry.description);
    if response.clicked() {
        action.perform(state);
        state.layout.node_menu = None;
    }
}
