//! The viewport widget.

use std::sync::Arc;

use egui::{Color32, Context, Id, Label, Rect, RichText, Role, Sense, Ui, WidgetInfo, pos2};
use egui_wgpu::Callback;

use super::choice::{self, Choice, CommonNodes};
use super::counterparts::{Counterparts, counterpart};
use super::draw::{FallbackTexture, Tint};
use super::picking::{pixel_at, rect_px};
use super::sides::side_at;
use super::{input, picking, sides};
use crate::app::state::PictureCut;
use crate::app::state::{AppState, HoveredPixel, Standing, TreeSide};
use crate::app::theme;

/// Text shown after loading or building was cancelled or failed and there is nothing to show.
const NOTHING_TO_SHOW: &str =
    "Nothing to show. F5 tries again, Ctrl+N shows samples and recent files, Ctrl+O opens a file";

/// The viewport, with what it caches between UI frames.
#[derive(Default)]
pub struct Viewport {
    fallback: FallbackTexture,
    choice: Choice,
    second_choice: Choice,
    /// For the first and for the second tree.
    common: [CommonNodes; 2],
    tint: Tint,
    counterparts: Counterparts,
    /// Identifies the widget, once it has been shown.
    id: Option<Id>,
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
        self.counterparts.follow(state);
        self.id = Some(response.id);
        self.choose_containers(ui, state);

        match &state.model.presented {
            Some(presented) if has_pipeline && !state.layout.graphics.failed => {
                let mut tinted = None;
                if state.layout.graphics.standing.is_none() {
                    tinted = self.tint.update(state, presented);
                    if self.tint.is_collecting() {
                        ui.ctx().request_repaint();
                    }
                }
                for (clip, callback) in sides::callbacks(state, presented, tinted, rect) {
                    let painter = ui.painter().with_clip_rect(clip.intersect(ui.clip_rect()));
                    painter.add(Callback::new_paint_callback(rect, callback));
                }
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
    /// Stores the pixel and the node under the pointer; outside of the picture, the node that another view has lit up in the last
    /// frame. Called before everything else in a UI frame, so that all views light up the same node. During a drag the hovered node
    /// stays the same.
    pub fn update_hover(&self, ctx: &Context, state: &mut AppState) {
        state.selection.hover = None;
        // Set again by the view that shows a ray.
        state.selection.nodes.traced = None;
        state.selection.nodes.waiting.clear();
        let pointed = state.selection.pointed.take();
        state.selection.pointed_before = pointed;
        let hovered = std::mem::replace(&mut state.selection.nodes.hovered, pointed);
        let hovered_second = state.selection.second.hovered.take();
        let Some(response) = self.id.and_then(|id| ctx.read_response(id)) else { return };
        let Some(pointer) = response.hover_pos() else { return };
        let side = side_at(state, pointer, response.rect);
        let Some(presented) = state.shown_tree(side) else { return };
        if response.dragged() {
            state.selection.second.hovered = hovered_second;
            state.selection.nodes.hovered = hovered;
            return;
        }
        let [x_px, y_px] = pixel_at(pointer, response.rect, ctx.pixels_per_point(), state.layout.viewport_px);
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
        match side {
            TreeSide::A => {
                state.selection.nodes.hovered =
                    primitive.and_then(|primitive| picking::drawn_node_of(state, primitive));
            }
            TreeSide::B => {
                let node = primitive.and_then(|primitive| picking::drawn_node_of_second(state, primitive));
                state.selection.second.hovered = node;
                state.selection.nodes.hovered = node.and_then(|node| counterpart(state, TreeSide::B, node));
            }
        }
    }

    /// Stores which containers are drawn.
    fn choose_containers(&mut self, ui: &Ui, state: &mut AppState) {
        (state.layout.graphics.shown, state.layout.graphics.second_shown) = (None, None);
        state.layout.graphics.standing = standing(state);
        if let Some(presented) = state.model.presented.as_ref().filter(|_| state.shows_containers()) {
            let standing = state.layout.graphics.standing.as_ref();
            let (shown, again) = self.choice.update(state, presented, standing, &choice::drawn_selection(state));
            let second = state.model.second.as_ref().filter(|_| state.shown_view().shows(TreeSide::B)).map(|second| {
                let (shown, again) =
                    self.second_choice.update(state, second, None, &sides::hidden_in_second(state, second));
                (self.common[1].update(state, TreeSide::B, shown, false), again)
            });
            // Merges on show may be those of another tree.
            let all = state.layout.graphics.standing.is_some();
            let is_before = standing.is_some_and(|standing| standing.table().is_some());
            let side = if is_before { TreeSide::B } else { TreeSide::A };
            let shown = if is_before && state.wanted.second.is_some() {
                shown
            } else {
                self.common[0].update(state, side, shown, all)
            };
            state.layout.graphics.shown = Some(shown);
            let mut delay = again;
            if let Some((shown, again)) = second {
                state.layout.graphics.second_shown = Some(shown);
                delay = delay.into_iter().chain(again).min();
            }
            if let Some(delay) = delay {
                ui.ctx().request_repaint_after(delay);
            }
        }
    }
}

/// The clusters that are drawn in place of the chosen depths: those of the step that the open view "Merges" shows.
fn standing(state: &mut AppState) -> Option<Arc<Standing>> {
    let wanted = state.shows_containers() && state.preferences.dock.shows(PictureCut::VIEW);
    let budget = choice::budget(state) as usize;
    let presented = state.model.presented.as_ref().filter(|_| wanted)?;
    state.model.cut.standing(&presented.accel, budget)
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
