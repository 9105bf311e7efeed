//! The view "Icicle": the tree from the root downwards, each node as wide as its share.

mod image;
mod legend;
mod plot;
mod studies;

use egui::{self, Align, Key, Layout, RichText, Ui};

use crate::app::state::lab::IcicleState;
use crate::app::state::{AppState, Presented, Severity};
use crate::app::studies::Studies;
use crate::app::views::controls;
use crate::app::views::view::View;
use crate::app::widgets::{Tip as _, empty_view};
use crate::app::{format, theme};
use crate::catalog::metrics::METRICS;
use crate::lab::icicle::IcicleWidth;
/// Most nodes that the line of nodes above the topmost one names.
const NAMED: usize = 5;

/// The tree from the root downwards.
pub(super) struct IcicleView;

impl View for IcicleView {
    fn name(&self) -> &'static str {
        IcicleState::VIEW
    }

    fn purpose(&self) -> &'static str {
        "The whole tree at a glance: each node below its parent, as wide as its share of cost, visits or triangles"
    }

    fn key(&self) -> Key {
        Key::F7
    }

    fn ui(&self, ui: &mut Ui, state: &mut AppState) {
        show(ui, state);
    }

    fn add_studies(&self, studies: &mut Studies) -> std::io::Result<()> {
        studies::add(studies)
    }

    fn needs_visits(&self, state: &AppState) -> bool {
        let IcicleState { width, color, .. } = state.lab.icicle;
        width == IcicleWidth::Visits || color.needs_visits
    }
}

fn show(ui: &mut Ui, state: &mut AppState) {
    let Some(shown) = state.model.presented.clone().filter(|shown| !shown.table.is_empty()) else {
        empty_view(ui, "Open a model to see its tree as an icicle");
        return;
    };
    state.lab.icicle.follow(&shown.accel);
    ui.horizontal(|ui| {
        let view = &mut state.lab.icicle;
        let choices = IcicleWidth::ALL.map(|width| (width, width.label(), width.meaning()));
        controls::drop_down(ui, "Width", "What the width of a node stands for", &mut view.width, &choices);
        let choices = METRICS.map(|metric| (metric, metric.label, metric.meaning));
        controls::drop_down(ui, "Colour", "What the colour of a node stands for", &mut view.color, &choices);
        legend::show(ui, state, &shown);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            copy(ui, state, &shown);
            breadcrumb(ui, state, &shown);
        });
    });
    let view = &state.lab.icicle;
    if view.width == IcicleWidth::Visits || view.color.needs_visits {
        ui.horizontal(|ui| {
            controls::rays(ui, state, &shown);
            if let Some(reason) = controls::no_rays(state, &shown) {
                ui.weak(reason);
            }
        });
    }
    plot::show(ui, state, &shown);
}

/// The button that copies the icicle as an image.
fn copy(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    let layout = state.lab.icicle.last_layout(&shown.accel).cloned();
    let response = ui.add_enabled(layout.is_some(), egui::Button::new("Copy")).tip("Copy the icicle as an image");
    let Some(layout) = layout.filter(|_| response.clicked()) else { return };
    if let Some(reason) = &state.layout.clipboard_fault {
        let text = format!("Nothing was copied, because there is no clipboard to copy to: {reason}");
        state.messages.notify(Severity::Warning, text);
        return;
    }
    let columns = layout.icicle.cells.first().map_or(0, |cell| cell.right_px);
    let (background, none) = (ui.visuals().panel_fill, theme::palette(ui).rail);
    ui.ctx().copy_image(image::image(&layout, columns, background, none));
    state.messages.notify(Severity::Info, "The icicle was copied as an image");
}

/// The nodes from the root to the topmost one, to which a click zooms out.
fn breadcrumb(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    let mut path = vec![state.lab.icicle.top()];
    while let Some(parent) = path.last().and_then(|&node| shown.table.parent(node)) {
        path.push(parent);
    }
    if path.len() < 2 {
        ui.weak("Double click a node to zoom in");
        return;
    }
    let root = path.pop();
    let hidden = path.len().saturating_sub(NAMED);
    path.truncate(NAMED);
    let dim = theme::palette(ui).dim;
    // From right to left: the topmost node first.
    let mut chosen = None;
    for (index, &node) in path.iter().enumerate() {
        let name = format::count(u64::from(node));
        let button = egui::Button::new(&name).selected(index == 0).frame(index == 0);
        let tip = if index == 0 { "The topmost node (Backspace zooms out)" } else { "Zoom out to this node" };
        if ui.add(button).tip(tip).clicked() {
            chosen = Some(node);
        }
        ui.label(RichText::new("›").color(dim));
    }
    if hidden > 0 {
        ui.label(RichText::new("…").color(dim)).tip(format!("{} between", format::counted(hidden as u64, "node")));
        ui.label(RichText::new("›").color(dim));
    }
    if ui.add(egui::Button::new("Root").frame(false)).tip("Zoom out to the whole tree").clicked() {
        chosen = root;
    }
    if let Some(node) = chosen {
        state.lab.icicle.zoom_to(node);
    }
}
