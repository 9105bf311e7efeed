//! The picture as a texture of egui, for when the overlay's pipeline is not available.

use egui::{ColorImage, Context, TextureHandle, TextureId, TextureOptions};

use crate::overlay::{step_within, thinned};
use crate::render::Frame;

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
