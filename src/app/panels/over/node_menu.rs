//! The menu of a node: opened by a click with the second button on the model.

use egui::{self, Button, Id, Popup, PopupAnchor, Rect, Ui, pos2};

use crate::app::commands::{Action, entries};
use crate::app::state::AppState;

/// What the menu offers, in groups.
const GROUPS: [&[(Action, &str)]; 3] = [
    &[
        (Action::SelectParent, "Select parent"),
        (Action::SelectChild, "Select child"),
        (Action::FrameSelection, "Frame"),
    ],
    &[(Action::HideSelected, "Hide"), (Action::IsolateSelected, "Isolate"), (Action::ShowAll, "Show all")],
    &[(Action::CopyNode, "Copy as text")],
];

/// Shows it while it is open, within `rect`, the viewport's rectangle.
pub(crate) fn show(ui: &mut Ui, rect: Rect, state: &mut AppState) {
    let Some([x, y]) = state.layout.node_menu else { return };
    let at = PopupAnchor::Position(rect.clamp(pos2(x, y)));
    let mut open = true;
    Popup::new(Id::unique("node menu"), ui.ctx().clone(), at, ui.layer_id()).open_bool(&mut open).show(|ui| {
        ui.set_min_width(160.0);
        if let Some(node) = state.selection.nodes.selected {
            ui.label(egui::RichText::new(format!("Node {node}")).color(crate::app::theme::palette(ui).dim));
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
    let response = ui.add_enabled(action.is_enabled(state), button).on_hover_text(&entry.description);
    if response.clicked() {
        action.perform(state);
        state.layout.node_menu = None;
    }
}
