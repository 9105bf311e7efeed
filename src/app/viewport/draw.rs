//! Draws picture and containers with the overlay's own pipeline, inside egui's render pass, or the picture as a texture of egui
//! where that is not available. The presented picture with the selected triangles tinted, made once per picture and selection.

use std::sync::Arc;

use egui::{ColorImage, Context, PaintCallbackInfo, Rect, TextureHandle, TextureId, TextureOptions};
use egui_wgpu::{CallbackResources, CallbackTrait, ScreenDescriptor};

use super::picking::rect_px;
use crate::app::state::{AppState, Presented, TreeSide};
use crate::overlay::{
    DrawInput, NodeTable, OverlayPipeline, OverlaySettings, PictureInput, Selection, Shown, step_within, thinned,
    tinted,
};
use crate::render::Frame;
use crate::visibility::TriangleSet;

/// Data of one draw; owned, because egui paints after the UI code of the frame has run.
pub(crate) struct OverlayCallback {
    /// The traced picture.
    pub(crate) frame: Arc<Frame>,
    /// Identifies the picture, so that it is uploaded once.
    pub(crate) frame_id: u64,
    /// The picture with the selected triangles tinted, in place of its own pixels.
    pub(crate) tinted: Option<Tinted>,
    /// Nodes of the tree; `None` to draw no containers.
    pub(crate) table: Option<Arc<NodeTable>>,
    /// The nodes that are drawn.
    pub(crate) shown: Arc<Shown>,
    /// How they are drawn.
    pub(crate) settings: OverlaySettings,
    /// Highlighted and hidden nodes.
    pub(crate) selection: Selection,
    /// Rectangle of the viewport in points.
    pub(crate) rect: Rect,
    /// Whether the picture is drawn under the containers.
    pub(crate) show_picture: bool,
    /// Which of two pictures side by side this is.
    pub(crate) side: TreeSide,
    /// Whether there is a second tree, for whose picture GPU objects are kept.
    pub(crate) has_second: bool,
}

/// The GPU objects of the second of two pictures side by side, made when it is first drawn.
struct SecondPipeline(OverlayPipeline);

impl OverlayCallback {
    fn pipeline_mut<'a>(
        &self,
        device: &wgpu::Device,
        resources: &'a mut CallbackResources,
    ) -> Option<&'a mut OverlayPipeline> {
        if self.side == TreeSide::A {
            return resources.get_mut::<OverlayPipeline>();
        }
        if resources.get::<SecondPipeline>().is_none() {
            let format = resources.get::<OverlayPipeline>()?.format();
            resources.insert(SecondPipeline(OverlayPipeline::new(device, format)));
        }
        resources.get_mut::<SecondPipeline>().map(|second| &mut second.0)
    }
}

impl CallbackTrait for OverlayCallback {
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        screen: &ScreenDescriptor,
        _encoder: &mut wgpu::CommandEncoder,
        resources: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        if !self.has_second {
            resources.remove::<SecondPipeline>();
        }
        if let Some(pipeline) = self.pipeline_mut(device, resources) {
            let viewport_px = rect_px(self.rect, screen.pixels_per_point, screen.size_in_pixels);
            let mut picture = picture_input(&self.frame, self.frame_id);
            if let Some(tinted) = &self.tinted {
                (picture.id, picture.rgba) = (tinted.id, &tinted.rgba);
            }
            pipeline.prepare(
                device,
                queue,
                &DrawInput {
                    picture,
                    camera: self.frame.camera,
                    table: self.table.as_ref(),
                    shown: &self.shown,
                    settings: self.settings,
                    selection: &self.selection,
                    show_picture: self.show_picture,
                    section: self.frame.settings.section,
                    neutral_lines: self.frame.settings.shading.is_coded(),
                    backdrop: self.frame.settings.background.backdrop(),
                    viewport_px,
                    pixels_per_point: screen.pixels_per_point,
                },
            );
        }
        Vec::new()
    }

    fn paint(&self, _info: PaintCallbackInfo, pass: &mut wgpu::RenderPass<'static>, resources: &CallbackResources) {
        let second = || resources.get::<SecondPipeline>().map(|second| &second.0);
        let pipeline = if self.side == TreeSide::A { resources.get::<OverlayPipeline>() } else { second() };
        if let Some(pipeline) = pipeline {
            pipeline.paint(pass);
        }
    }
}

/// Borrows the parts of a frame that the overlay draws.
pub(crate) fn picture_input(frame: &Frame, id: u64) -> PictureInput<'_> {
    PictureInput {
        id,
        width_px: frame.width_px,
        height_px: frame.height_px,
        coarseness: frame.coarseness,
        rgba: &frame.rgba,
        depth: &frame.depth,
    }
}

/// Texture of the newest picture; empty until it is needed.
#[derive(Default)]
pub(crate) struct FallbackTexture {
    /// The picture's identity, and its texture.
    cached: Option<(u64, TextureHandle)>,
}

impl FallbackTexture {
    /// The texture of `frame`, uploaded once per picture. Rows and columns are skipped where the picture is larger than the
    /// driver's textures.
    pub(crate) fn id(&mut self, ctx: &Context, frame_id: u64, frame: &Frame) -> TextureId {
        if let Some((id, texture)) = &self.cached
            && *id == frame_id
        {
            return texture.id();
        }
        let size = [frame.width_px as usize, frame.height_px as usize];
        let step = step_within(ctx.input(|input| input.max_texture_side), size);
        let rgba = thinned(&frame.rgba, size[0].max(1), step);
        let image = ColorImage::from_rgba_unmultiplied(size.map(|side| side.div_ceil(step)), rgba.as_flattened());
        let texture = ctx.load_texture("picture", image, TextureOptions::LINEAR);
        let texture_id = texture.id();
        self.cached = Some((frame_id, texture));
        texture_id
    }
}

/// A tinted picture.
#[derive(Clone)]
pub(crate) struct Tinted {
    /// Identifies it among tinted and plain pictures.
    pub(crate) id: u64,
    /// Its pixels, as those of the frame.
    pub(crate) rgba: Arc<Vec<[u8; 4]>>,
}

/// Set in the ids of tinted pictures, which plain ones do not have.
const TINTED: u64 = 1 << 63;

/// Nodes whose triangles are collected in one UI frame.
const NODES_PER_FRAME: usize = 100_000;

/// Triangles below a node, as far as they are collected.
struct Collected {
    triangles: TriangleSet,
    /// The nodes that are still to be visited.
    open: Vec<u32>,
}

/// The picture tinted last, and what it was made from.
#[derive(Default)]
pub(crate) struct Tint {
    /// Table and node, and the triangles below the node.
    selected: Option<((u64, u32), Collected)>,
    /// Picture, table and node.
    last: Option<((u64, u64, u32), Tinted)>,
    count: u64,
}

impl Tint {
    /// The presented picture with the triangles of the selected node tinted; `None` where none is selected, or the root, which
    /// is everything, and where colours stand for values.
    pub(crate) fn update(&mut self, state: &AppState, presented: &Presented) -> Option<Tinted> {
        let exists = |node: &u32| (1..presented.table.len() as u32).contains(node);
        let is_coded = presented.frame.settings.shading.is_coded();
        let Some(node) = state.selection.nodes.selected.filter(|node| exists(node) && !is_coded) else {
            self.selected = None;
            return None;
        };
        let table = presented.table.id;
        let key = (presented.frame_id, table, node);
        if let Some((_, tinted)) = self.last.as_ref().filter(|(last, _)| *last == key) {
            return Some(tinted.clone());
        }
        let mut selected = if let Some((last, collected)) = self.selected.take()
            && last == (table, node)
        {
            collected
        } else {
            let triangles = TriangleSet::none(presented.accel.scene.triangles.len());
            Collected { triangles, open: vec![node] }
        };
        presented.table.collect_triangles(&mut selected.open, &mut selected.triangles, NODES_PER_FRAME);
        let Collected { triangles, open } = &selected;
        let tinted = open.is_empty().then(|| {
            self.count += 1;
            let rgba = Arc::new(tinted(&presented.frame.rgba, &presented.frame.primitive, triangles));
            Tinted { id: TINTED | self.count, rgba }
        });
        self.selected = Some(((table, node), selected));
        let tinted = tinted?;
        self.last = Some((key, tinted.clone()));
        Some(tinted)
    }

    /// Whether the triangles of the selected node are still being collected.
    pub(crate) fn is_collecting(&self) -> bool {
        self.selected.as_ref().is_some_and(|(_, collected)| !collected.open.is_empty())
    }
}
