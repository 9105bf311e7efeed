//! The traced picture and its depth as GPU textures.

use crate::overlay::enlarge::{enlarged, factor};
use crate::overlay::input::PictureInput;

/// Colour and depth textures of the picture uploaded last.
pub struct PictureTextures {
    /// Id of the uploaded picture; `None` for the placeholder.
    pub id: Option<u64>,
    /// sRGB bytes in a format without decoding. Larger than `depth` where the picture is coarse.
    pub color: wgpu::Texture,
    /// Linear view depth in world units.
    pub depth: wgpu::Texture,
}

impl PictureTextures {
    /// Textures with undefined content: `size` is the depth's, and the colours are `factor` times as large along each side.
    fn sized(device: &wgpu::Device, size: [u32; 2], factor: u32) -> Self {
        let texture = |label, format, size: [u32; 2]| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            })
        };
        Self {
            id: None,
            color: texture("overlay picture", wgpu::TextureFormat::Rgba8Unorm, size.map(|side| side * factor)),
            depth: texture("overlay depth", wgpu::TextureFormat::R32Float, size),
        }
    }

    /// One black texel until the first picture arrives; wgpu clears it.
    pub fn placeholder(device: &wgpu::Device) -> Self {
        Self::sized(device, [1, 1], 1)
    }

    /// Uploads `picture` unless it is the one uploaded last. Returns whether the textures were recreated. A picture without
    /// pixels is ignored; one larger than the device's texture limit is subsampled to fit, and a coarse
    /// one enlarged.
    pub fn upload(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, picture: &PictureInput<'_>) -> bool {
        let [width, height] = [picture.width_px as usize, picture.height_px as usize];
        let whole = width > 0 && picture.rgba.len() == width * height && picture.depth.len() == width * height;
        if self.id == Some(picture.id) || !whole || height == 0 {
            return false;
        }
        let limit = device.limits().max_texture_dimension_2d.max(1) as usize;
        let step = step_within(limit, [width, height]);
        let size = [width.div_ceil(step) as u32, height.div_ceil(step) as u32];
        let factor = Some(factor(picture.coarseness)).filter(|factor| width.max(height) * factor <= limit).unwrap_or(1);
        let color_size = size.map(|side| side * factor as u32);
        let renewed = [&self.color, &self.depth].map(size_of_texture) != [color_size, size];
        if renewed {
            *self = Self::sized(device, size, factor as u32);
        }
        if factor > 1 {
            let large = enlarged(picture.rgba, [width, height], factor);
            write(queue, &self.color, color_size, bytemuck::cast_slice(&large));
            write(queue, &self.depth, size, bytemuck::cast_slice(picture.depth));
        } else if step == 1 {
            write(queue, &self.color, size, bytemuck::cast_slice(picture.rgba));
            write(queue, &self.depth, size, bytemuck::cast_slice(picture.depth));
        } else {
            log::warn!(
                "a picture of {width}×{height} exceeds the driver's limit of {limit}; every {step}th pixel is shown"
            );
            let (rgba, depth) = (thinned(picture.rgba, width, step), thinned(picture.depth, width, step));
            write(queue, &self.color, size, bytemuck::cast_slice(&rgba));
            write(queue, &self.depth, size, bytemuck::cast_slice(&depth));
        }
        self.id = Some(picture.id);
        renewed
    }
}

/// Width and height in texels.
pub fn size_of_texture(texture: &wgpu::Texture) -> [u32; 2] {
    [texture.width(), texture.height()]
}

/// The smallest step such that every `step`th pixel of a picture of `size` fits a texture of `limit` texels a side.
pub fn step_within(limit: usize, size: [usize; 2]) -> usize {
    size[0].max(size[1]).div_ceil(limit.max(1)).max(1)
}

/// Every `step`th pixel of every `step`th row; `width` is the length of a row.
pub fn thinned<T: Copy>(pixels: &[T], width: usize, step: usize) -> Vec<T> {
    let rows = pixels.chunks_exact(width).step_by(step);
    rows.flat_map(|row| row.iter().copied().step_by(step)).collect()
}

/// Writes a whole texture of four bytes a texel.
fn write(queue: &wgpu::Queue, texture: &wgpu::Texture, size: [u32; 2], bytes: &[u8]) {
    queue.write_texture(
        texture.as_image_copy(),
        bytes,
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(size[0] * 4), rows_per_image: None },
        wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
    );
}

#[cfg(test)]
mod tests {
    use super::super::offscreen::open_device;
    use super::*;
    use crate::skip::{Lack, skip};

    /// A device limited to small textures stands in for a large screen.
    #[test]
    fn a_picture_beyond_the_driver_is_thinned_out() {
        const LIMIT: u32 = 64;
        let limits = |adapter: &wgpu::Adapter| wgpu::Limits { max_texture_dimension_2d: LIMIT, ..adapter.limits() };
        let (device, queue) = match pollster::block_on(open_device(limits)) {
            Ok(opened) => opened,
            Err(error) => return skip(Lack::Graphics, error),
        };
        let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let mut textures = PictureTextures::placeholder(&device);
        for (id, [width_px, height_px], expected) in
            [(1, [200, 100], [50, 25]), (2, [64, 64], [64, 64]), (3, [1, 129], [1, 43]), (4, [65, 1], [33, 1])]
        {
            let count = (width_px * height_px) as usize;
            let (rgba, depth) = (vec![[7; 4]; count], vec![1.0; count]);
            let picture = PictureInput { id, width_px, height_px, coarseness: 1.0, rgba: &rgba, depth: &depth };
            assert!(textures.upload(&device, &queue, &picture), "{width_px}×{height_px}");
            assert_eq!(size_of_texture(&textures.color), expected);
        }
        assert_eq!(pollster::block_on(scope.pop()).map(|error| error.to_string()), None);
    }
}
