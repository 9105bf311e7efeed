//! The window's layout: panels at the edges, the viewport in the centre, overlays and dialogs on top of it.

use egui::{self, Margin, Panel, Rect, Ui};

use super::{depth_bar, dialogs, dock, job_strip, lesson, menu, over, side, time_strip};
use crate::app::state::{AppState, Side};
use crate::app::widgets::{note_panel, note_place, panel_frame, restore_sections, scroll, sections};
use crate::app::{commands, theme, views};

/// Default width of the left panel in points.
const LEFT_WIDTH: f32 = 248.0;
/// Default width of the right panel in points: its widest row fits, because a panel that is narrower than its content grows.
const RIGHT_WIDTH: f32 = 288.0;
/// Default height of the selection in points: all rows of a node and the buttons.
const SELECTION_HEIGHT: f32 = 280.0;
/// Smallest height in points below the headline in which statistics and selection both have room.
const MIN_BELOW_HEADLINE: f32 = 160.0;
/// Width of the window in points below which only one side panel is shown at a time.
const NARROW_WIDTH: f32 = 840.0;

/// Shows all panels around `viewport`, which draws the central area and returns its rectangle.
pub fn around(ui: &mut Ui, state: &mut AppState, viewport: impl FnOnce(&mut Ui, &mut AppState) -> Rect) {
    let ctx = ui.ctx().clone();
    theme::apply(&ctx, &state.preferences);
    restore_sections(&ctx, &state.preferences.sections);
    commands::handle_shortcuts(&ctx, state);
    state.model.follow_layout();
    views::play(ui, state);
    time_strip::play(ui, state);
    top(ui, state);
    bottom(ui, state);
    // In a low window the side panels need more height than the dock leaves them.
    let clip = ui.clip_rect();
    ui.set_clip_rect(clip.intersect(ui.available_rect_before_wrap()));
    left(ui, state);
    right(ui, state);
    ui.set_clip_rect(clip);
    egui::CentralPanel::no_frame().show(ui, |ui| {
        let rect = viewport(ui, state);
        over_viewport(ui, rect, state);
    });
    if state.selection.pointed != state.selection.pointed_before {
        // Views that were shown before the one with the pointer light up, or no longer, in the next frame.
        ctx.request_repaint();
    }
    open_dialogs(&ctx, state);
    state.follow_heat_range();
    state.follow_shared_nodes();
    // Sections of a closed panel keep what was known of them.
    state.preferences.sections.extend(sections(&ctx));
}

/// The menu bar.
fn top(ui: &mut Ui, state: &mut AppState) {
    state.layout.narrow = ui.available_width() < NARROW_WIDTH;
    let frame = panel_frame(Margin::symmetric(8, 4));
    Panel::top("menu bar").frame(frame).show(ui, |ui| menu::show(ui, state));
}

/// Left panel: headline at the top, selection at the bottom, statistics in between, so that neither of the two ever moves.
fn left(ui: &mut Ui, state: &mut AppState) {
    let shown = state.shows_panel(Side::Left);
    let mut open = shown;
    let panel = Panel::left("left panel").default_size(LEFT_WIDTH).size_range(200.0..=400.0);
    let panel = panel.frame(panel_frame(Margin::ZERO));
    let place = panel.show_collapsible(ui, &mut open, |ui| {
        let frame = panel_frame(Margin { left: 12, right: 12, top: 4, bottom: 8 });
        Panel::top("headline").resizable(false).frame(frame).show(ui, |ui| side::headline::show(ui, state));
        selection_dock(ui, state);
        scroll(ui, "left scroll", |ui| side::statistics::show(ui, state));
    });
    note_panel(ui.ctx(), Side::Left, place.map(|place| place.response.rect));
    if open != shown {
        state.toggle_panel(Side::Left);
    }
}

/// The selection has a place of its own, of the same height whatever is selected. In a low window the statistics take all of it.
fn selection_dock(ui: &mut Ui, state: &mut AppState) {
    if ui.available_height() < MIN_BELOW_HEADLINE {
        return;
    }
    let most = (ui.available_height() * 0.5).max(48.0);
    let height = SELECTION_HEIGHT.min(most);
    let panel = Panel::bottom("selection").resizable(true).default_size(height).size_range(48.0_f32.min(most)..=most);
    panel.frame(panel_frame(Margin { top: 4, ..Margin::ZERO })).show(ui, |ui| {
        scroll(ui, "selection scroll", |ui| side::selection::show(ui, state));
    });
}

/// Right panel: settings of tree, containers and picture.
fn right(ui: &mut Ui, state: &mut AppState) {
    let shown = state.shows_panel(Side::Right);
    let mut open = shown;
    let panel = Panel::right("right panel").default_size(RIGHT_WIDTH).size_range(240.0..=420.0);
    let place = panel.frame(panel_frame(Margin::ZERO)).show_collapsible(ui, &mut open, |ui| {
        scroll(ui, "right scroll", |ui| {
            side::tree::show(ui, state);
            side::containers::show(ui, state);
            side::picture::show(ui, state);
            side::picture::section_plane(ui, state);
        });
    });
    note_panel(ui.ctx(), Side::Right, place.map(|place| place.response.rect));
    if open != shown {
        state.toggle_panel(Side::Right);
    }
}

/// From the bottom upwards: job strip, depth bar, time strip of a model that moves, dock, lesson.
fn bottom(ui: &mut Ui, state: &mut AppState) {
    let frame = panel_frame(Margin::symmetric(12, 4));
    Panel::bottom("job strip").frame(frame).show(ui, |ui| job_strip::show(ui, state));
    let frame = panel_frame(Margin::symmetric(12, 4));
    let bar = Panel::bottom("depth bar").frame(frame).show(ui, |ui| depth_bar::show(ui, state));
    note_place(ui.ctx(), "Depth bar", bar.response.rect);
    if let Some(motion) = state.motion().cloned() {
        let strip = Panel::bottom("time strip").frame(frame).show(ui, |ui| time_strip::show(ui, state, &motion));
        note_place(ui.ctx(), "Time strip", strip.response.rect);
    }
    dock::show(ui, state);
    lesson::show(ui, state);
}

/// Paints over the viewport's rectangle: legends, axes gizmo, facts of the hovered pixel, messages.
fn over_viewport(ui: &mut Ui, rect: Rect, state: &mut AppState) {
    over::lines::scaffold(ui, rect, state);
    over::lines::rays_of_file(ui, rect, state);
    over::lines::ray(ui, rect, state);
    over::handles::section(ui, rect, state);
    over::compare::show(ui, rect, state);
    over::hints::nothing_in_view(ui, rect, state);
    over::legend::show(ui, rect, state);
    over::hints::nothing_drawn(ui, rect, state);
    over::handles::gizmo(ui, rect, state);
    over::pointer::facts(ui, rect, state);
    over::messages::show(ui, rect, state);
    over::pointer::node_menu(ui, rect, state);
    over::guides::tour(ui, rect, state);
    over::hints::drop_hint(ui, rect);
}

/// The open dialogs; the command palette last, on top of the others.
fn open_dialogs(ctx: &egui::Context, state: &mut AppState) {
    dialogs::start_page::show(ctx, state);
    dialogs::help::show(ctx, state);
    dialogs::help::about(ctx, state);
    dialogs::help::messages(ctx, state);
    dialogs::palette::show(ctx, state);
    dialogs::palette::show_go_to(ctx, state);
}
