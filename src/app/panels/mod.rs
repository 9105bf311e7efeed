//! What stands around the viewport and over it. Panels read and edit [`AppState`] and never start work.

mod containers;
mod depth_bar;
mod dialog;
mod effects;
mod gizmo;
mod histogram;
mod icons;
mod job_strip;
mod legend;
mod menu;
mod message_log;
mod messages;
pub mod palette;
mod paper;
mod picture;
mod pointer;
mod selection;
mod shortcuts;
mod start_page;
mod statistics;
mod tree;
mod widgets;

use eframe::egui::{self, Frame, Margin, Panel, ScrollArea, Ui};

use crate::app::commands;
use crate::app::state::{AppState, Side};
use crate::app::theme;

/// Width of the side panels at first start in points.
const SIDE_WIDTH: f32 = 260.0;
/// In a window with less width than this in points both side panels would leave too little for the picture.
const NARROW: f32 = 840.0;

/// Everything in the order in which it takes its room, with `viewport` in the middle, which says where it is.
pub fn around(ui: &mut Ui, state: &mut AppState, viewport: impl FnOnce(&mut Ui, &mut AppState) -> egui::Rect) {
    let ctx = ui.ctx().clone();
    theme::apply(&ctx, &state.preferences);
    commands::handle_shortcuts(&ctx, state);
    top(ui, state);
    bottom(ui, state);
    left(ui, state);
    right(ui, state);
    egui::CentralPanel::no_frame().show(ui, |ui| {
        let rect = viewport(ui, state);
        over_viewport(ui, rect, state);
    });
    windows(&ctx, state);
}

/// The menu bar.
pub fn top(ui: &mut Ui, state: &mut AppState) {
    state.narrow = ui.available_width() < NARROW;
    let frame = panel_frame(Margin::symmetric(8, 4));
    Panel::top("menu bar").frame(frame).show(ui, |ui| menu::show(ui, state));
}

/// Scene, statistics, selection.
pub fn left(ui: &mut Ui, state: &mut AppState) {
    let shown = state.shows_panel(Side::Left);
    let mut open = shown;
    let panel = Panel::left("left panel").default_size(SIDE_WIDTH - 12.0).size_range(200.0..=400.0);
    panel.frame(panel_frame(Margin::ZERO)).show_collapsible(ui, &mut open, |ui| {
        scroll(ui, "left scroll", |ui| {
            statistics::show(ui, state);
            selection::show(ui, state);
        });
    });
    if open != shown {
        state.toggle_panel(Side::Left);
    }
}

/// Tree, containers, picture.
pub fn right(ui: &mut Ui, state: &mut AppState) {
    let shown = state.shows_panel(Side::Right);
    let mut open = shown;
    let panel = Panel::right("right panel").default_size(SIDE_WIDTH + 16.0).size_range(240.0..=420.0);
    panel.frame(panel_frame(Margin::ZERO)).show_collapsible(ui, &mut open, |ui| {
        scroll(ui, "right scroll", |ui| {
            tree::show(ui, state);
            containers::show(ui, state);
            picture::show(ui, state);
        });
    });
    if open != shown {
        state.toggle_panel(Side::Right);
    }
}

/// Job strip, depth bar, and the paper panel above them.
pub fn bottom(ui: &mut Ui, state: &mut AppState) {
    let frame = panel_frame(Margin::symmetric(12, 4));
    Panel::bottom("job strip").frame(frame).show(ui, |ui| job_strip::show(ui, state));
    let frame = panel_frame(Margin::symmetric(12, 4));
    Panel::bottom("depth bar").frame(frame).show(ui, |ui| depth_bar::show(ui, state));
    paper::show(ui, state);
}

/// Legend, gizmo, messages, help and the hovered value, over the viewport's rectangle.
pub fn over_viewport(ui: &mut Ui, rect: egui::Rect, state: &mut AppState) {
    legend::show(ui, rect, state);
    gizmo::show(ui, rect, state);
    pointer::show(ui, rect, state);
    messages::show(ui, rect, state);
}

/// Command palette, shortcuts, start page, what was said.
pub fn windows(ctx: &egui::Context, state: &mut AppState) {
    start_page::show(ctx, state);
    shortcuts::show(ctx, state);
    message_log::show(ctx, state);
    palette::show(ctx, state);
}

/// Without a fill: the window is cleared with the panels' colour.
fn panel_frame(margin: Margin) -> Frame {
    Frame::new().inner_margin(margin)
}

/// A side panel's content: scrolls where the window is too low.
fn scroll(ui: &mut Ui, id: &str, content: impl FnOnce(&mut Ui)) {
    ScrollArea::vertical()
        .id_salt(id)
        .auto_shrink(false)
        .content_margin(Margin { left: 12, right: 12, top: 0, bottom: 8 })
        .show(ui, content);
}
