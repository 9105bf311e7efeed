//! The wgpu pass: the traced picture as a textured rectangle, and the lines over it, straight into the caller's pass.

use std::sync::Arc;

use eframe::wgpu;

use super::{NodeTable, OverlaySettings, Selection};
use crate::camera::Camera;

/// The traced picture, as plain slices so that this module need not know who made it.
#[derive(Debug, Clone, Copy)]
pub struct PictureInput<'a> {
    /// Unique for each picture, to tell whether it has been uploaded.
    pub id: u64,
    /// Width in pixels.
    pub width_px: u32,
    /// Height in pixels.
    pub height_px: u32,
    /// sRGB bytes.
    pub rgba: &'a [[u8; 4]],
    /// Linear view depth a pixel, 1e30 where nothing was hit.
    pub depth: &'a [f32],
}

/// What one draw shows.
pub struct DrawInput<'a> {
    /// The picture.
    pub picture: PictureInput<'a>,
    /// The camera of the picture (not the current one, or lines swim).
    pub camera: Camera,
    /// The tree's nodes; `None` draws the picture alone.
    pub table: Option<&'a Arc<NodeTable>>,
    /// Which and how.
    pub settings: OverlaySettings,
    /// Nodes that stand out.
    pub selection: &'a Selection,
    /// The rectangle of the viewport in the attachment: x, y, width, height in pixels.
    pub viewport_px: [u32; 4],
    /// Pixels a point, for line widths.
    pub pixels_per_point: f32,
}

/// All GPU objects of the overlay; lives in egui's callback resources or in an offscreen renderer.
pub struct OverlayPipeline {}

impl OverlayPipeline {
    /// Makes the pipelines for targets of `format`.
    pub fn new(_device: &wgpu::Device, _format: wgpu::TextureFormat) -> Self {
        todo!("overlay")
    }

    /// Uploads what changed since the last draw: the picture by its id, the nodes by the table's, the list of shown nodes
    /// and the uniforms. Returns how many containers are drawn and how many were wanted.
    pub fn prepare(&mut self, _device: &wgpu::Device, _queue: &wgpu::Queue, _input: &DrawInput<'_>) -> (usize, usize) {
        todo!("overlay")
    }

    /// Draws into the caller's pass, whose viewport is set to the rectangle given to `prepare`.
    pub fn paint(&self, _pass: &mut wgpu::RenderPass<'static>) {
        todo!("overlay")
    }
}
