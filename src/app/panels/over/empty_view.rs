//! Says so where nothing of the model is in the picture.

use egui::{Align2, FontId, Rect, Ui, vec2};

use crate::app::state::{AppState, Presented};
use crate::app::theme;

/// Shows it within `rect`, the viewport's rectangle.
pub(crate) fn show(ui: &Ui, rect: Rect, state: &AppState) {
    let Some(shown) = &state.model.presented else { return };
    let Some(lines) = text(shown).filter(|_| state.preferences.show_geometry) else { return };
    for (index, line) in lines.into_iter().enumerate() {
        let at = rect.center() + vec2(0.0, 20.0 * index as f32 - 10.0);
        let palette = theme::palette(ui);
        let galley = ui.painter().layout_no_wrap(line.to_owned(), FontId::proportional(14.0), palette.text);
        let back = Align2::CENTER_CENTER.anchor_size(at, galley.size());
        ui.painter().rect_filled(back.expand2(vec2(8.0, 2.0)), 4.0, palette.veil);
        ui.painter().galley(back.min, galley, palette.text);
    }
}

/// Why the picture is empty and what to do; `None` where it is not, or is not sharp yet.
fn text(shown: &Presented) -> Option<[&'static str; 2]> {
    let frame = &shown.frame;
    if frame.coarseness > 1.0 || frame.stats.primary_rays == 0 || frame.stats.hits > 0 {
        return None;
    }
    let flat = shown.accel.scene.bounds.extent().to_array().iter().filter(|side| **side == 0.0).count();
    Some(if flat >= 2 {
        ["This model has no surface", "Its triangles are all points or lie on one line, so no ray can hit them"]
    } else {
        [
            "Nothing of the model is in view",
            "F frames it, R goes back to the default view; triangles without area are never seen",
        ]
    })
}
