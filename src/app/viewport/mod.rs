//! The viewport: the traced picture with the containers over it, drawn by our own pipeline inside egui's pass.

pub(crate) mod fly;
pub(crate) mod input;
pub mod orbit;
pub mod picking;
pub(crate) mod screenshot;

use std::sync::Arc;

use eframe::egui_wgpu::{Callback, CallbackResources, CallbackTrait, ScreenDescriptor};
use eframe::{egui, wgpu};
use egui::{PaintCallbackInfo, Rect, Role, Sense, WidgetInfo};

use crate::app::state::{AppState, HoveredPixel, Preferences};
use crate::app::theme;
use crate::camera::Camera;
use crate::overlay::{
    DrawInput, NodeTable, OverlayPipeline, OverlaySettings, PictureInput, Selection, step_within, thinned,
};
use crate::render::Frame;

/// Everything that one draw needs; owned, because egui paints after the UI has been made.
struct Draw {
    frame: Arc<Frame>,
    frame_id: u64,
    table: Option<Arc<NodeTable>>,
    settings: OverlaySettings,
    selection: Selection,
    rect: Rect,
    show_picture: bool,
}

impl CallbackTrait for Draw {
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        screen: &ScreenDescriptor,
        _encoder: &mut wgpu::CommandEncoder,
        resources: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        if let Some(pipeline) = resources.get_mut::<OverlayPipeline>() {
            let viewport_px = pixels(self.rect, screen.pixels_per_point, screen.size_in_pixels);
            let picture = picture_input(&self.frame, self.frame_id);
            pipeline.prepare(
                device,
                queue,
                &DrawInput {
                    picture,
                    camera: self.frame.camera,
                    table: self.table.as_ref(),
                    settings: self.settings,
                    selection: &self.selection,
                    show_picture: self.show_picture,
                    viewport_px,
                    pixels_per_point: screen.pixels_per_point,
                },
            );
        }
        Vec::new()
    }

    fn paint(&self, _info: PaintCallbackInfo, pass: &mut wgpu::RenderPass<'static>, resources: &CallbackResources) {
        if let Some(pipeline) = resources.get::<OverlayPipeline>() {
            pipeline.paint(pass);
        }
    }
}

/// A frame as the overlay wants it.
pub(crate) fn picture_input(frame: &Frame, id: u64) -> PictureInput<'_> {
    PictureInput { id, width_px: frame.width_px, height_px: frame.height_px, rgba: &frame.rgba, depth: &frame.depth }
}

/// A rectangle in points as whole pixels of the attachment: x, y, width, height.
fn pixels(rect: Rect, pixels_per_point: f32, screen_size_px: [u32; 2]) -> [u32; 4] {
    let info = PaintCallbackInfo { viewport: rect, clip_rect: rect, pixels_per_point, screen_size_px };
    let px = info.viewport_in_pixels();
    [px.left_px.max(0) as u32, px.top_px.max(0) as u32, px.width_px.max(0) as u32, px.height_px.max(0) as u32]
}

/// What the viewport says where nothing was opened, or its loading or building was cancelled.
const NOTHING: &str = "Nothing to show. F5 tries again, Ctrl+N shows samples and recent files, Ctrl+O opens a file";

/// What the viewport remembers between frames.
#[derive(Default)]
pub struct Viewport {
    /// The picture as egui's own texture, for when the overlay's pipeline is out of order.
    fallback: Option<(u64, egui::TextureHandle)>,
    asked_for_focus: bool,
}

impl Viewport {
    /// Shows picture and containers in what is left of the window, and lets hands move the camera.
    pub fn show(&mut self, ui: &mut egui::Ui, has_pipeline: bool, state: &mut AppState) -> Rect {
        let rect = ui.max_rect();
        let response = ui.allocate_rect(rect, Sense::click_and_drag());
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Viewport"));
        if !self.asked_for_focus {
            self.asked_for_focus = true;
            response.request_focus();
        }

        let scale = ui.ctx().pixels_per_point();
        let screen = ui.ctx().viewport_rect().size() * scale;
        let [_, _, width, height] = pixels(rect, scale, [screen.x.round() as u32, screen.y.round() as u32]);
        (state.layout.viewport_px, state.layout.pixels_per_point) = ([width, height], scale);

        input::handle(ui, &response, state);
        Self::hover(&response, scale, state);
        count(state);

        if let Some(presented) = &state.model.presented {
            if has_pipeline && !state.graphics.failed {
                let Preferences { show_geometry, show_containers, .. } = state.preferences;
                let draw = Draw {
                    frame: Arc::clone(&presented.frame),
                    frame_id: presented.frame_id,
                    table: show_containers.then(|| Arc::clone(&presented.table)),
                    settings: presented.table.drawable(&state.wanted.overlay),
                    selection: state.selection.nodes.clone(),
                    rect,
                    show_picture: show_geometry,
                };
                ui.painter().add(Callback::new_paint_callback(rect, draw));
            } else {
                let texture = self.fallback_texture(ui.ctx(), presented.frame_id, &presented.frame);
                let uv = Rect::from_min_max(egui::Pos2::ZERO, egui::pos2(1.0, 1.0));
                ui.painter().image(texture, rect, uv, egui::Color32::WHITE);
            }
        } else {
            // Nothing to look at yet: what is on its way, or what to do, where eyes are.
            let text = match state.activity.load.as_ref().or(state.activity.build.as_ref()) {
                Some(job) => format!("{} {:.0} %", job.label, job.progress.clamp(0.0, 1.0) * 100.0),
                None if state.activity.render.is_some() => "Tracing".to_owned(),
                // Whatever was given up was told; before that nothing was asked for yet.
                None if state.messages.history.is_empty() => String::new(),
                None => NOTHING.to_owned(),
            };
            let text = egui::RichText::new(text).size(16.0).color(theme::palette(ui).dim);
            ui.put(rect.shrink(24.0), egui::Label::new(text).wrap().selectable(false));
        }
        rect
    }

    /// What lies under the cursor.
    fn hover(response: &egui::Response, scale: f32, state: &mut AppState) {
        state.selection.hover = None;
        let hovered = state.selection.nodes.hovered.take();
        let (Some(at), Some(presented)) = (response.hover_pos(), &state.model.presented) else { return };
        if response.dragged() {
            state.selection.nodes.hovered = hovered;
            return;
        }
        let [x_px, y_px] = input::pixel_at(at, response.rect, scale, state.layout.viewport_px);
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
        state.selection.nodes.hovered = primitive.and_then(|primitive| picking::shown_node_of(state, primitive));
    }

    fn fallback_texture(&mut self, ctx: &egui::Context, id: u64, frame: &Frame) -> egui::TextureId {
        if let Some((known, texture)) = &self.fallback
            && *known == id
        {
            return texture.id();
        }
        let size = [frame.width_px as usize, frame.height_px as usize];
        let step = step_within(ctx.input(|input| input.max_texture_side), size);
        let rgba = thinned(&frame.rgba, size[0].max(1), step);
        let image = egui::ColorImage::from_rgba_unmultiplied(size.map(|side| side.div_ceil(step)), rgba.as_flattened());
        let texture = ctx.load_texture("picture", image, egui::TextureOptions::LINEAR);
        let id_of_texture = texture.id();
        self.fallback = Some((id, texture));
        id_of_texture
    }
}

/// How many containers are drawn and how many the settings hold.
fn count(state: &mut AppState) {
    let Some(presented) = &state.model.presented else { return };
    if !state.preferences.show_containers {
        state.graphics.overlay_counts = (0, 0);
        return;
    }
    state.graphics.overlay_counts = presented.table.count(&state.wanted.overlay, &state.selection.nodes);
}

/// The camera of the shown picture; the wanted one where there is none.
pub(crate) fn shown_camera(state: &AppState) -> Camera {
    state.model.presented.as_ref().map_or(state.wanted.camera, |presented| presented.frame.camera)
}
