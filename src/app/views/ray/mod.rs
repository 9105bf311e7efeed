//! The view "Ray": one ray through the tree, step by step.

mod events;
mod hits;
mod strip;
mod toolbar;
mod transport;

use std::sync::Arc;

use egui::{Key, Layout, Rect, RichText, Ui, UiBuilder, vec2};

use crate::accel::Accel;
use crate::app::state::{AppState, PictureRay, Presented, RayOutcome, ViewState};
use crate::app::studies::{Studies, StudyPlan};
use crate::app::theme;
use crate::app::views::View;
use crate::app::widgets::empty_view;
use crate::lab::ray::{RayRecord, Step, record};

/// Width of the list of steps in points.
const EVENTS_WIDTH: f32 = 330.0;
/// Width of the stack and the list of hits in points.
const STACK_WIDTH: f32 = 180.0;
/// Least width of the strip: below it the stack is left out, then the steps.
const MIN_STRIP: f32 = 260.0;
/// Gap between two columns in points.
const GAP: f32 = 12.0;
/// Largest number of waiting containers that are lit in the picture.
const MOST_WAITING: usize = 64;

/// One ray through the tree, step by step. Its state is that of the ray over the picture.
#[derive(Debug, Default)]
pub(crate) struct RayView;

impl ViewState for RayView {
    const NAME: &'static str = PictureRay::VIEW;
    type Shared = ();

    fn shared(&self, _: Option<&Arc<Accel>>) {}

    fn show_shared(&mut self, (): ()) {}

    #[cfg(test)]
    fn changed() -> Self {
        Self
    }
}

impl View for RayView {
    const PURPOSE: &'static str = "One ray through the tree, step by step: the nodes it enters and skips, the triangles it tests, and its wasted steps";
    const KEY: Key = Key::F8;

    fn ui(&mut self, ui: &mut Ui, state: &mut AppState) {
        show(ui, state);
    }

    fn add_studies(studies: &mut Studies) -> std::io::Result<()> {
        add_record(studies)
    }
}

fn show(ui: &mut Ui, state: &mut AppState) {
    // A ray takes no time, so that it is of the tree on the screen even while the model plays.
    let Some(shown) = state.model.presented.clone() else {
        empty_view(ui, "Open a model to trace a ray through its tree");
        return;
    };
    toolbar::show(ui, state, &shown);
    let outcome = state.model.ray.follow(&shown.accel);
    remark(ui, state);
    let Some((outcome, is_of_tree)) = outcome else {
        let text = if state.model.ray.source.is_some() {
            "Tracing the ray…"
        } else {
            "Click the picture: the ray of that pixel is recorded step by step. Or type an origin and a direction above"
        };
        empty_view(ui, text);
        return;
    };
    match &*outcome {
        Err(reason) => empty_view(ui, &format!("There is no such ray: {reason}")),
        Ok(record) if record.steps.is_empty() => {
            empty_view(ui, "This ray tests nothing: nothing of it is left by the section plane, or there is no tree");
        }
        Ok(record) => {
            replay(ui, state, record);
            transport::show(ui, state, &shown, record);
            transport::totals(ui, state, &shown, record);
            let second = second_record(state);
            let second = second.as_deref().and_then(|second| second.as_ref().ok());
            ui.add_enabled_ui(is_of_tree, |ui| columns(ui, state, &shown, (record, second)));
            if is_of_tree {
                light_up(state, record);
            }
        }
    }
}

/// The fault of a typed ray, or an event of the record.
fn remark(ui: &mut Ui, state: &AppState) {
    let palette = theme::palette(ui);
    let ray = &state.model.ray;
    if let Some(fault) = &ray.fault {
        ui.label(RichText::new(format!("{fault}. The ray before stays")).color(palette.warning));
    } else if let Some(remark) = ray.remark {
        ui.label(RichText::new(remark).color(palette.dim));
    }
}

/// Goes on with the replay.
fn replay(ui: &Ui, state: &mut AppState, record: &RayRecord) {
    if state.model.ray.playing {
        let seconds = ui.input(|input| input.stable_dt);
        state.model.ray.advance(f64::from(seconds), record.steps.len());
        ui.ctx().request_repaint();
    }
}

/// The record of the same ray in the second tree.
fn second_record(state: &AppState) -> Option<Arc<RayOutcome>> {
    let (accel, request) = state.wanted_second_ray()?;
    state.model.ray.second.get(&accel, &request).cloned()
}

/// The strip, or those of both trees, the steps, and the stack over all hits side by side.
fn columns(ui: &mut Ui, state: &mut AppState, shown: &Presented, (record, second): (&RayRecord, Option<&RayRecord>)) {
    let all = ui.available_rect_before_wrap();
    let with_events = all.width() >= MIN_STRIP + EVENTS_WIDTH + GAP;
    let with_stack = all.width() >= MIN_STRIP + EVENTS_WIDTH + STACK_WIDTH + 2.0 * GAP;
    let mut right = all.right();
    let mut column = |width: f32| {
        let rect = Rect::from_min_max(egui::pos2(right - width, all.top()), egui::pos2(right, all.bottom()));
        right = rect.left() - GAP;
        rect
    };
    let stack_rect = with_stack.then(|| column(STACK_WIDTH));
    let events_rect = with_events.then(|| column(EVENTS_WIDTH));
    let strip_rect = Rect::from_min_max(all.min, egui::pos2(right, all.bottom()));
    within(ui, strip_rect, "ray strip", |ui| match second {
        Some(second) => strip::show_both(ui, state, [record, second]),
        None => strip::show(ui, state, record, ui.available_size()),
    });
    if let Some(rect) = events_rect {
        within(ui, rect, "ray steps", |ui| events::show(ui, state, record));
    }
    if let Some(rect) = stack_rect {
        let (stack, hits) = rect.split_top_bottom_at_fraction(0.5);
        within(ui, stack, "ray stack", |ui| events::stack(ui, state, record));
        within(ui, hits, "ray hits", |ui| hits::show(ui, state, shown, record));
    }
    ui.allocate_rect(all.intersect(ui.max_rect()), egui::Sense::hover());
}

fn within(ui: &mut Ui, rect: Rect, name: &str, show: impl FnOnce(&mut Ui)) {
    let layout = Layout::top_down(egui::Align::Min);
    let mut child = ui.new_child(UiBuilder::new().max_rect(rect).layout(layout).id_salt(name));
    child.set_clip_rect(rect.expand2(vec2(2.0, 0.0)).intersect(ui.clip_rect()));
    child.spacing_mut().item_spacing.y = 0.0;
    show(&mut child);
}

/// Lights up the container of the present step and those on the stack.
fn light_up(state: &mut AppState, record: &RayRecord) {
    let cursor = state.model.ray.cursor;
    let nodes = &mut state.selection.nodes;
    nodes.traced =
        record.steps.get(cursor).filter(|step| !matches!(step.what, Step::Again { .. })).map(|step| step.tree_node);
    let waiting = record.stack_after(cursor).into_iter().filter_map(|span| record.spans.get(span as usize));
    nodes.waiting = waiting.map(|span| span.tree_node).take(MOST_WAITING).collect();
}

/// Adds the studies: the record of the ray in each tree.
fn add_record(studies: &mut Studies) -> std::io::Result<()> {
    let plan = StudyPlan {
        // A single ray takes no time from the picture, and does not wait until all of its samples are traced.
        at_once: true,
        ..StudyPlan::new("ray", "Recording the ray", |state| &mut state.model.ray.record, |state, _| state.wanted_ray())
    };
    studies.add(plan, record)?;
    let plan = StudyPlan {
        at_once: true,
        ..StudyPlan::new(
            "second ray",
            "Recording the ray in B",
            |state| &mut state.model.ray.second,
            |state, _| state.wanted_second_ray(),
        )
    };
    studies.add(plan, record)
}
