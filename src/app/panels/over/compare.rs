//! Two trees in the viewport: the switch between their views, and the letters that say which picture is whose.

use egui::{Align2, Area, Button, FontId, Frame, Id, Margin, Order, Painter, Pos2, Rect, Ui, pos2, vec2};

use super::seam;
use crate::app::commands::{Action, CompareStep, compare_description};
use crate::app::state::{AppState, CompareView};
use crate::app::theme;
use crate::app::theme::Palette;
use crate::app::widgets::Tip as _;

/// Distance of the switch and the letters from the viewport's upper edge in points.
const TOP: f32 = 10.0;
/// Distance of a letter from the seam in points.
const BESIDE: f32 = 20.0;

/// Shows it within `rect`, the viewport's rectangle.
pub(crate) fn show(ui: &mut Ui, rect: Rect, state: &mut AppState) {
    if state.wanted.second.is_none() || state.model.presented.is_none() {
        return;
    }
    let view = state.shown_view();
    if view == CompareView::Split {
        let x = seam::show(ui, rect, state);
        let (painter, palette) = (ui.painter(), theme::palette(ui));
        // Below the switch, which lies over the middle.
        let y = rect.top() + TOP + 46.0;
        letter(painter, pos2(x - BESIDE, y), "A", &palette);
        letter(painter, pos2(x + BESIDE, y), "B", &palette);
    }
    switch(ui, rect, state);
}

/// The switch between the views, in the middle of the upper edge.
fn switch(ui: &Ui, rect: Rect, state: &mut AppState) {
    let palette = theme::palette(ui);
    let wanted = state.wanted.second.map(|second| second.view);
    // Until its first picture there is nothing to switch to.
    let waits = state.model.second.is_none();
    let area = Area::new(Id::unique("views of two trees")).order(Order::Middle).pivot(Align2::CENTER_TOP);
    area.constrain_to(rect).fixed_pos(rect.center_top() + vec2(0.0, TOP)).show(ui.ctx(), |ui| {
        Frame::new().fill(palette.veil).corner_radius(6).inner_margin(Margin::symmetric(6, 4)).show(ui, |ui| {
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing.x = 4.0;
                for view in CompareView::ALL {
                    let button = ui.add(Button::new(view.label()).selected(wanted == Some(view)));
                    if button.tip(format!("{} (2)", compare_description(view))).clicked() {
                        Action::Compare(CompareStep::View(view)).perform(state);
                    }
                }
                if waits {
                    ui.label(egui::RichText::new("building B …").small().color(palette.dim));
                }
            });
        });
    });
}

/// A letter on a translucent ground around `center`.
fn letter(painter: &Painter, center: Pos2, text: &str, palette: &Palette) {
    painter.circle_filled(center, 11.0, palette.veil);
    painter.text(center, Align2::CENTER_CENTER, text, FontId::proportional(14.0), palette.text);
}
