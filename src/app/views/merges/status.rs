//! The line below the plot: the present merge in words.

use egui::{self, Label, RichText, Ui};

use crate::app::state::lab::merges::{CutKind, MergeStudy};
use crate::app::state::{AppState, Presented};
use crate::app::{format, theme};

/// Height of the line in points.
pub(super) const HEIGHT: f32 = theme::ROW_HEIGHT;

/// Shows the line.
pub(super) fn show(ui: &mut Ui, state: &AppState, shown: &Presented, study: &MergeStudy) {
    let palette = theme::palette(ui);
    let remark = study.merges.history.remark(&shown.accel);
    ui.horizontal(|ui| {
        ui.set_height(HEIGHT);
        let text = RichText::new(present(state, study)).color(palette.text);
        let text = match &remark {
            Some(_) => ui.add(Label::new(text)),
            None => ui.add(Label::new(text).truncate()),
        };
        text.on_hover_text(
            "The merge at the cursor: its number, what it makes, and the call of the recursion that did it",
        );
        if let Some(remark) = remark {
            ui.add(Label::new(RichText::new(&remark).color(palette.warning)).truncate());
        }
    });
}

/// The present merge: "Merge 1,234 of 69,450 · level 5 · 9 in its list · area 0.12 % · 68,217 left".
fn present(state: &AppState, study: &MergeStudy) -> String {
    let merges = &study.merges;
    let steps = format::count(u64::from(merges.timeline.steps()));
    if state.lab.merges.cut_kind != CutKind::Step {
        let all =
            state.layout.graphics.standing.as_ref().map_or_else(|| "…".to_owned(), |cut| format::count(cut.all as u64));
        return format!("Cut through the tree: {all} clusters");
    }
    let Some(step) = state.lab.merges.step(merges) else { return format!("{steps} merges; no step chosen") };
    let left = format::count(u64::from(merges.timeline.standing(step)));
    let Some(node) = merges.made_at(step) else {
        return format!("Nothing merged yet of {steps} merges · all {left} clusters stand");
    };
    let mut parts = vec![format!("Merge {} of {steps}", format::count(u64::from(step)))];
    if let Some(construction) = &merges.history.construction {
        let record = &construction.record;
        if let Some(level) = record.level_of(node) {
            parts.push(format!("level {level}"));
        }
        if let Some(length) = merges.merge_number(step).and_then(|merge| record.list_length(merge)) {
            parts.push(format!("{} in its list", format::count(u64::from(length))));
        }
    }
    if let Some(share) = merges.area_share(step) {
        parts.push(format!("area {}", format::percent(f64::from(share))));
    }
    parts.push(format!("{left} left"));
    parts.join(" · ")
}
