//! The viewport widget.

use std::sync::Arc;

use egui::{Color32, Label, Rect, Response, RichText, Role, Sense, Ui, WidgetInfo, pos2};
use egui_wgpu::Callback;

use super::choice::{self, Choice};
use super::draw::OverlayCallback;
use super::fallback::FallbackTexture;
use super::pixel::{pixel_at, rect_px};
use super::tint::{Tint, Tinted};
use super::{input, picking};
use crate::app::state::{AppState, HoveredPixel, Preferences, Presented};
use crate::app::theme;
use crate::overlay::Shown;

/// Text shown after loading or building was cancelled or failed and there is nothing to show.
const NOTHING_TO_SHOW: &str =
    "Nothing to show. F5 tries again, Ctrl+N shows samples and recent files, Ctrl+O opens a file";

/// The viewport, with what it caches between UI frames.
#[derive(Default)]
pub struct Viewport {
    fallback: FallbackTexture,
    choice: Choice,
    tint: Tint,
    /// The keyboard focus has been requested, once at start.
    focus_requested: bool,
}

impl Viewport {
    /// Shows picture and containers in the remaining area of the window and handles mouse and keys. Returns the viewport's
    /// rectangle. Without the overlay's pipeline (`has_pipeline` is false, or it failed) only the picture is shown.
    pub fn show(&mut self, ui: &mut Ui, has_pipeline: bool, state: &mut AppState) -> Rect {
        let rect = ui.max_rect();
        let response = ui.allocate_rect(rect, Sense::click_and_drag());
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Viewport"));
        if !self.focus_requested {
            self.focus_requested = true;
            response.request_focus();
        }

        let scale = ui.ctx().pixels_per_point();
        let screen = ui.ctx().viewport_rect().size() * scale;
        let [_, _, width, height] = rect_px(rect, scale, [screen.x.round() as u32, screen.y.round() as u32]);
        (state.layout.viewport_px, state.layout.pixels_per_point) = ([width, height], scale);

        input::handle(ui, &response, state);
        update_hover(&response, scale, state);
        self.choose_containers(ui, state);

        match &state.model.presented {
            Some(presented) if has_pipeline && !state.graphics.failed => {
                let tinted = self.tint.update(state, presented);
                let callback = overlay_callback(state, presented, tinted, rect);
                ui.painter().add(Callback::new_paint_callback(rect, callback));
            }
            Some(presented) => {
                let texture = self.fallback.id(ui.ctx(), presented.frame_id, &presented.frame);
                let uv = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
                ui.painter().image(texture, rect, uv, Color32::WHITE);
            }
            None => show_placeholder(ui, rect, state),
        }
        rect
    }
}

impl Viewport {
    /// Stores which containers are drawn.
    fn choose_containers(&mut self, ui: &Ui, state: &mut AppState) {
        state.graphics.shown = None;
        if let Some(presented) = state.model.presented.as_ref().filter(|_| state.preferences.show_containers) {
            let (shown, again) = self.choice.update(state, presented);
            state.graphics.shown = Some(shown);
            if let Some(delay) = again {
                ui.ctx().request_repaint_after(delay);
            }
        }
        let shown = state.graphics.shown.as_deref();
        state.graphics.overlay_counts = shown.map_or((0, 0), |shown| (shown.nodes.len(), shown.wanted));
    }
}

/// The draw of the presented picture with the containers.
fn overlay_callback(state: &AppState, presented: &Presented, tinted: Option<Tinted>, rect: Rect) -> OverlayCallback {
    let Preferences { show_geometry, show_containers, .. } = state.preferences;
    OverlayCallback {
        frame: Arc::clone(&presented.frame),
        frame_id: presented.frame_id,
        tinted,
        table: show_containers.then(|| Arc::clone(&presented.table)),
        shown: state.graphics.shown.clone().unwrap_or_else(|| Arc::new(Shown::NOTHING)),
        settings: choice::drawable(state, presented),
        selection: state.selection.nodes.clone(),
        rect,
        show_picture: show_geometry,
    }
}

/// Before the first picture: the progress of the running job, or what to do.
fn show_placeholder(ui: &mut Ui, rect: Rect, state: &AppState) {
    let text = match state.activity.load.as_ref().or(state.activity.build.as_ref()) {
        Some(job) => format!("{} {:.0} %", job.label, job.progress.clamp(0.0, 1.0) * 100.0),
        None if state.activity.render.is_some() => "Tracing".to_owned(),
        // A cancelled or failed job leaves a message; without one, nothing was requested yet.
        None if state.messages.history.is_empty() => String::new(),
        None => NOTHING_TO_SHOW.to_owned(),
    };
    let text = RichText::new(text).size(16.0).color(theme::palette(ui).dim);
    ui.put(rect.shrink(24.0), Label::new(text).wrap().selectable(false));
}

/// Stores the pixel and the node under the pointer. During a drag the hovered node stays the same.
fn update_hover(response: &Response, scale: f32, state: &mut AppState) {
    state.selection.hover = None;
    let hovered = state.selection.nodes.hovered.take();
    let (Some(pointer), Some(presented)) = (response.hover_pos(), &state.model.presented) else { return };
    if response.dragged() {
        state.selection.nodes.hovered = hovered;
        return;
    }
    let [x_px, y_px] = pixel_at(pointer, response.rect, scale, state.layout.viewport_px);
    let frame = &presented.frame;
    let index = frame.index_of(x_px, y_px);
    let primitive = picking::primitive_at(frame, x_px, y_px);
    state.selection.hover = Some(HoveredPixel {
        x_px,
        y_px,
        primitive,
        distance: frame.distance.get(index).copied().unwrap_or(f32::INFINITY),
        value: frame.values.get(index).copied(),
    });
    state.selection.nodes.hovered = primitive.and_then(|primitive| picking::drawn_node_of(state, primitive));
}
