//! Drawing the overlay into an image, without a window.

use crate::overlay::input::DrawInput;
use crate::overlay::pipeline::OverlayPipeline;

/// Why the overlay could not be drawn.
#[derive(Debug, thiserror::Error)]
pub enum OffscreenError {
    /// No Vulkan or GL driver; the text names the package to install.
    #[error("{0}")]
    NoAdapter(String),
    /// The driver failed.
    #[error("drawing the overlay failed: {0}")]
    Device(String),
}

/// Format of the images.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Draws any number of images with the same device.
pub struct Offscreen {
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipeline: OverlayPipeline,
}

impl Offscreen {
    /// Opens a device.
    pub fn new() -> Result<Self, OffscreenError> {
        let (device, queue) = pollster::block_on(open_device(wgpu::Adapter::limits))?;
        // wgpu panics on errors outside of error scopes unless a handler is set.
        device.on_uncaptured_error(std::sync::Arc::new(|error| log::error!("overlay: {error}")));
        let pipeline = scoped(&device, || Ok(OverlayPipeline::new(&device, FORMAT)))?;
        Ok(Self { device, queue, pipeline })
    }

    /// Draws picture and overlay into an image of the size of the viewport, whose origin is ignored: sRGB RGBA, 8 bits a channel, row by
    /// row from the top left.
    pub fn draw(&mut self, input: &DrawInput<'_>) -> Result<Vec<[u8; 4]>, OffscreenError> {
        let [_, _, width, height] = input.viewport_px;
        let limit = self.device.limits().max_texture_dimension_2d;
        if width == 0 || height == 0 || width > limit || height > limit {
            return Err(OffscreenError::Device(format!(
                "the picture is {width}×{height} pixels; this driver draws 1 to {limit} pixels a side"
            )));
        }
        let Self { device, queue, pipeline } = self;
        scoped(device, || draw(device, queue, pipeline, input))
    }
}

/// [`Offscreen::draw`] of a single image.
pub fn draw_offscreen(input: &DrawInput<'_>) -> Result<Vec<[u8; 4]>, OffscreenError> {
    Offscreen::new()?.draw(input)
}

/// Runs `work`; errors of the driver meanwhile become its error.
fn scoped<T>(device: &wgpu::Device, work: impl FnOnce() -> Result<T, OffscreenError>) -> Result<T, OffscreenError> {
    let scopes = [wgpu::ErrorFilter::Internal, wgpu::ErrorFilter::OutOfMemory, wgpu::ErrorFilter::Validation]
        .map(|filter| device.push_error_scope(filter));
    let done = work();
    for scope in scopes.into_iter().rev() {
        if let Some(error) = pollster::block_on(scope.pop()) {
            return Err(OffscreenError::Device(error.to_string()));
        }
    }
    done
}

/// Any adapter, software ones included. OpenGL comes last because probing for it prints errors on machines without a display.
async fn find_adapter() -> Result<wgpu::Adapter, wgpu::RequestAdapterError> {
    let with = |chosen: wgpu::Backends| {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
        descriptor.backends &= chosen;
        wgpu::Instance::new(descriptor)
    };
    let options = wgpu::RequestAdapterOptions::default();
    match with(wgpu::Backends::PRIMARY).request_adapter(&options).await {
        Ok(adapter) => Ok(adapter),
        Err(_) => with(wgpu::Backends::all()).request_adapter(&options).await,
    }
}

/// A device with the limits that `limits` derives from the adapter's.
pub(super) async fn open_device(
    limits: impl FnOnce(&wgpu::Adapter) -> wgpu::Limits,
) -> Result<(wgpu::Device, wgpu::Queue), OffscreenError> {
    let adapter = find_adapter().await.map_err(|error| {
        log::info!("no adapter: {error}");
        OffscreenError::NoAdapter(
            "drawing containers needs a Vulkan or OpenGL driver, and none was found. On Debian and Ubuntu: apt install \
             mesa-vulkan-drivers (software, works on every machine). Rendering without the overlay needs no driver."
                .to_owned(),
        )
    })?;
    let descriptor =
        wgpu::DeviceDescriptor { label: Some("overlay"), required_limits: limits(&adapter), ..Default::default() };
    adapter.request_device(&descriptor).await.map_err(|error| OffscreenError::Device(error.to_string()))
}

fn draw(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    pipeline: &mut OverlayPipeline,
    input: &DrawInput<'_>,
) -> Result<Vec<[u8; 4]>, OffscreenError> {
    let [_, _, width, height] = input.viewport_px;
    let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
    let target = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("overlay target"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    // Texture-to-buffer copies need rows padded to a multiple of 256 bytes.
    let row_bytes = (width * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer_bytes = u64::from(row_bytes) * u64::from(height);
    if buffer_bytes > device.limits().max_buffer_size {
        return Err(OffscreenError::Device(format!(
            "{width}×{height} pixels are more than this driver reads back at once"
        )));
    }
    let readback = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("overlay readback"),
        size: buffer_bytes,
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });

    let input = DrawInput { viewport_px: [0, 0, width, height], ..*input };
    pipeline.prepare(device, queue, &input);
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let view = target.create_view(&wgpu::TextureViewDescriptor::default());
    let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("overlay"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
        })],
        ..Default::default()
    });
    let mut pass = pass.forget_lifetime();
    pipeline.paint(&mut pass);
    drop(pass);
    encoder.copy_texture_to_buffer(
        target.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &readback,
            layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row_bytes), rows_per_image: None },
        },
        size,
    );
    queue.submit([encoder.finish()]);
    read(device, &readback, row_bytes, width)
}

/// A pixel whose colour is multiplied by its opacity, without that.
fn straight([r, g, b, a]: [u8; 4]) -> [u8; 4] {
    let divided =
        |channel: u8| (u32::from(channel) * 255 + u32::from(a) / 2).checked_div(a.into()).unwrap_or(0).min(255) as u8;
    if a == 255 { [r, g, b, a] } else { [divided(r), divided(g), divided(b), a] }
}

/// Waits for the copy and removes the padding of its rows.
fn read(
    device: &wgpu::Device,
    readback: &wgpu::Buffer,
    row_bytes: u32,
    width: u32,
) -> Result<Vec<[u8; 4]>, OffscreenError> {
    let failed = |error: &dyn std::fmt::Display| OffscreenError::Device(error.to_string());
    let (sender, receiver) = std::sync::mpsc::channel();
    readback.map_async(wgpu::MapMode::Read, .., move |result| {
        // The receiver is gone only if polling failed, which is reported there.
        let _ = sender.send(result);
    });
    device.poll(wgpu::PollType::wait_indefinitely()).map_err(|error| failed(&error))?;
    receiver.recv().map_err(|error| failed(&error))?.map_err(|error| failed(&error))?;
    let mapped = readback.get_mapped_range(..).map_err(|error| failed(&error))?;
    Ok(mapped
        .chunks_exact(row_bytes as usize)
        .flat_map(|row| bytemuck::cast_slice::<u8, [u8; 4]>(&row[..width as usize * 4]).iter().copied().map(straight))
        .collect())
}
