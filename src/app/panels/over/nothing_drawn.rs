//! A line in the viewport where the settings choose no container, with a way out.

use egui::{self, Align2, Area, Frame, Id, Margin, Rect, Ui, vec2};

use crate::app::state::AppState;
use crate::app::theme;

/// What can be done about it.
enum WayOut {
    /// Hidden nodes are all that the depths hold.
    ShowAll,
    /// The section plane cuts all of them away.
    Whole,
    /// Leaves are further down.
    Depths([u32; 2]),
}

/// Shows it within `rect`, the viewport's rectangle.
pub(crate) fn show(ui: &mut Ui, rect: Rect, state: &mut AppState) {
    let Some((text, button, way_out)) = message(state) else { return };
    let palette = theme::palette(ui);
    let at = rect.center_bottom() - vec2(0.0, 16.0);
    let area = Area::new(Id::unique("nothing drawn")).fixed_pos(at).pivot(Align2::CENTER_BOTTOM).constrain_to(rect);
    area.show(ui.ctx(), |ui| {
        Frame::new().fill(palette.veil).corner_radius(6).inner_margin(Margin::symmetric(10, 6)).show(ui, |ui| {
            ui.horizontal(|ui| {
                ui.label(text);
                let link = ui.link(button).on_hover_text("Change the settings so that containers are drawn");
                if link.clicked() {
                    match way_out {
                        WayOut::ShowAll => state.selection.show_all(),
                        WayOut::Whole => state.wanted.render.section = None,
                        WayOut::Depths(depths) => state.wanted.overlay.depth = Some(depths),
                    }
                }
            });
        });
    });
}

/// The message, the label of the link and what it does; `None` where containers are drawn or switched off.
fn message(state: &AppState) -> Option<(String, &'static str, WayOut)> {
    let shown = state.model.presented.as_ref()?;
    let nothing = state.layout.graphics.shown.as_ref().is_some_and(|shown| shown.wanted == 0);
    if !nothing || state.layout.graphics.standing.is_some() || state.drawn_kinds() == [false; 2] {
        return None;
    }
    if state.selection.nodes.hides_any() {
        return Some(("All containers at these depths are hidden.".to_owned(), "Show all", WayOut::ShowAll));
    }
    let section = shown.frame.settings.section;
    let drawn = shown.table.drawn_depths(&state.wanted.overlay);
    let [first, last] = shown.table.leaf_depths()?;
    let holds_leaves = drawn[0] <= last && first <= drawn[1];
    if section.is_some() && (holds_leaves || !state.wanted.overlay.leaves_only) {
        let text = "The section plane cuts all containers at these depths away.".to_owned();
        return Some((text, "Show the whole model", WayOut::Whole));
    }
    let text = if last < state.drawn_depths()[0] {
        format!("Leaves end at depth {last}.")
    } else {
        format!("Leaves start at depth {first}.")
    };
    Some((text, "Show them", WayOut::Depths([first, last])))
}
