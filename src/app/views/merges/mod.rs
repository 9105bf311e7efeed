//! The view "Merges": the construction of the tree merge by merge or split by split, and why each was made.

mod plot;
mod studies;
mod toolbar;

mod price;
mod reduction;
mod split;
mod why;

use std::sync::Arc;

use egui::{self, Button, Key, RichText, ScrollArea, Ui, vec2};

use crate::accel::Accel;
use crate::app::state::picture_cut::{MergePage, MergeStudy, PictureCut};
use crate::app::state::{AppState, Presented, ViewState};
use crate::app::studies::Studies;
use crate::app::theme;
use crate::app::views::{View, parts};
use crate::app::widgets::{chip, empty_view};
use bvhscope_engine::construction::MergeOrder;

/// Share of the width that the part beside the plot takes, and its limits in points.
const PAGE_SHARE: f32 = 0.36;
const PAGE_WIDTH: [f32; 2] = [240.0, 460.0];
/// Longest time in seconds by which playing advances at once.
const LONGEST_FRAME: f32 = 0.1;

/// The construction of the tree, merge by merge. Its state is that of the clusters over the picture.
#[derive(Debug, Default)]
pub(crate) struct MergesView;

impl ViewState for MergesView {
    const NAME: &'static str = PictureCut::VIEW;
    type Shared = ();

    fn shared(&self, _: Option<&Arc<Accel>>) {}

    fn show_shared(&mut self, (): ()) {}

    #[cfg(test)]
    fn changed() -> Self {
        Self
    }
}

impl View for MergesView {
    const PURPOSE: &'static str =
        "How the tree was built, merge by merge or split by split: scrub, play, and see why two clusters were merged";
    const KEY: Key = Key::F6;

    fn ui(&mut self, ui: &mut Ui, state: &mut AppState) {
        let hint = "Open a model to see how its tree is built, merge by merge";
        let Some(shown) = parts::presented(ui, state, hint) else { return };
        let Some(known) = state.model.cut.known(&shown.accel) else {
            waiting(ui, state, &shown);
            return;
        };
        match known.as_ref() {
            Err(reason) => empty_view(ui, &format!("The construction of this tree cannot be shown: {reason}")),
            Ok(study) if study.merges.timeline.steps() == 0 => {
                empty_view(
                    ui,
                    "This tree is a single leaf: nothing was merged or split. Another builder, or more triangles, make a tree",
                );
            }
            Ok(study) => view(ui, state, &shown, study),
        }
    }

    fn play(ui: &Ui, state: &mut AppState) {
        play(ui, state);
    }

    fn add_studies(studies: &mut Studies) -> std::io::Result<()> {
        studies::add(studies)
    }
}

/// Goes on playing.
fn play(ui: &Ui, state: &mut AppState) {
    let playing = state.model.cut.playing.is_some();
    let Some(shown) = state.model.presented.as_ref().filter(|_| playing) else { return };
    let Some(known) = state.model.cut.known(&shown.accel) else { return };
    let Ok(study) = known.as_ref() else { return };
    let seconds = ui.input(|input| input.stable_dt).min(LONGEST_FRAME);
    state.model.cut.advance(&study.merges, f64::from(seconds));
    let last = state.layout.graphics.standing.take();
    state.layout.graphics.standing = last.and_then(|last| state.model.cut.standing(&shown.accel, last.count));
    ui.ctx().request_repaint();
}

/// The view until the merges are known.
fn waiting(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    let study = &mut state.model.cut.study;
    let cancelled = MergeOrder::ALL.iter().any(|order| study.is_cancelled(&shown.accel, order));
    if !cancelled {
        empty_view(ui, "Building the tree once more to record its construction …");
        return;
    }
    ui.vertical_centered(|ui| {
        ui.add_space((ui.available_height() * 0.5 - 32.0).max(0.0));
        ui.label(RichText::new("Recording the construction was cancelled").color(theme::palette(ui).dim));
        if ui.add(Button::new("Record the construction")).clicked() {
            study.resume();
        }
    });
}

fn view(ui: &mut Ui, state: &mut AppState, shown: &Presented, study: &MergeStudy) {
    follow_selection(state, study);
    toolbar::show(ui, state, shown, study);
    let page = (ui.available_width() * PAGE_SHARE).clamp(PAGE_WIDTH[0], PAGE_WIDTH[1]);
    let size = vec2((ui.available_width() - page - 16.0).max(160.0), ui.available_height());
    ui.horizontal_top(|ui| {
        ui.allocate_ui(size, |ui| {
            ui.vertical(|ui| {
                let height = (ui.available_height() - toolbar::HEIGHT - ui.spacing().item_spacing.y).max(48.0);
                plot::show(ui, state, study, vec2(size.x, height));
                toolbar::status(ui, state, study);
            });
        });
        ui.add_space(8.0);
        ui.vertical(|ui| pages(ui, state, shown, study));
    });
}

/// The part beside the plot.
fn pages(ui: &mut Ui, state: &mut AppState, shown: &Presented, study: &MergeStudy) {
    let page = &mut state.model.cut.page;
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let choices = [
            (
                MergePage::Why,
                if study.merges.are_splits() { "This split" } else { "Why these two?" },
                if study.merges.are_splits() {
                    "Sides of this split: triangles, areas, and what the surface area heuristic makes of them"
                } else {
                    "The list that this merge chose from, with the distances that were compared"
                },
            ),
            (
                MergePage::Reduction,
                "Reduction f(x)",
                "How many clusters ranges of x primitives leave, and what the build really had",
            ),
            (MergePage::Price, "Price", "What the approximation costs: the selected subtree beside the exact one"),
        ];
        for (choice, label, tip) in choices {
            if chip(ui, label, *page == choice, tip) {
                *page = choice;
            }
        }
    });
    let page = *page;
    ScrollArea::vertical().id_salt("merges page").auto_shrink(false).show(ui, |ui| match page {
        MergePage::Why => match study.merges.history.splits() {
            Some(splits) => split::show(ui, state, shown, study, splits),
            None => why::show(ui, state, shown, study),
        },
        MergePage::Reduction => reduction::show(ui, state, study),
        MergePage::Price => price::show(ui, state, shown),
    });
}

/// Shows the merge that made a node, or its split, when it is selected, wherever that was done.
fn follow_selection(state: &mut AppState, study: &MergeStudy) {
    let selected = state.selection.nodes.selected;
    let changed = std::mem::replace(&mut state.model.cut.followed, selected) != selected;
    // Nodes of a tree before its passes are others.
    if let Some(node) = selected.filter(|_| changed && study.table.is_none()) {
        let timeline = &study.merges.timeline;
        let exists = node <= 2 * timeline.steps();
        if let Some(step) = timeline.step_of(node).filter(|_| exists) {
            state.model.cut.playing = None;
            state.model.cut.set_step(&study.merges, step);
        }
    }
}
