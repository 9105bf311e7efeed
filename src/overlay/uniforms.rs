//! The uniform buffer: camera, viewport and colour scale.

use glam::Vec3;

use crate::camera::Projection;
use crate::overlay::input::DrawInput;
use crate::overlay::level::strength;
use crate::overlay::ramp::{RAMP_STOPS, shader_ramp};

/// The uniform buffer; the struct `View` in `common.wgsl` has the same layout.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
#[expect(missing_docs, reason = "each field is explained in common.wgsl")]
pub struct ViewUniforms {
    pub eye: [f32; 3],
    pub perspective: f32,
    pub right: [f32; 3],
    pub near: f32,
    pub up: [f32; 3],
    pub depth_slack: f32,
    pub forward: [f32; 3],
    pub half_width_px: f32,
    pub tangent: [f32; 2],
    pub covered: [f32; 2],
    pub viewport: [f32; 4],
    pub hidden_alpha: f32,
    pub by_depth: u32,
    pub circle_segments: u32,
    pub show_picture: u32,
    pub neutral: u32,
    pub strength: f32,
    pub levels: [f32; 2],
    pub section: [f32; 4],
    pub background: [f32; 4],
    pub ramp: [[f32; 4]; RAMP_STOPS],
}

impl ViewUniforms {
    /// The uniforms of one draw.
    pub fn new(input: &DrawInput<'_>, circle_segments: u32) -> Self {
        let [x, y, width, height] = input.viewport_px;
        let frame = input.camera.for_size(width, height);
        let (right, up, forward) = frame.axes();
        let perspective = input.camera.projection == Projection::Perspective;
        let distance = input.camera.distance();
        let line_width = if input.settings.line_width.is_finite() { input.settings.line_width } else { 1.25 };
        let points = if input.pixels_per_point.is_finite() { input.pixels_per_point } else { 1.0 };
        let is_neutral = input.neutral_lines && input.show_picture;
        Self {
            eye: input.camera.eye.to_array(),
            perspective: f32::from(u8::from(perspective)),
            right: right.to_array(),
            near: if perspective { (distance * 1e-4).max(f32::MIN_POSITIVE) } else { 0.0 },
            up: up.to_array(),
            // Orthographic depths may be near zero, so a slack relative to the depth is not enough.
            depth_slack: if perspective { 0.0 } else { distance * 1e-3 },
            forward: forward.to_array(),
            half_width_px: (line_width * points * 0.5).clamp(0.05, 64.0),
            tangent: frame.half_extent().to_array(),
            covered: covered(
                [width, height],
                [input.picture.width_px, input.picture.height_px],
                input.picture.coarseness,
            ),
            viewport: [x as f32, y as f32, width.max(1) as f32, height.max(1) as f32],
            hidden_alpha: input.settings.hidden_alpha.clamp(0.0, 1.0),
            by_depth: u32::from(input.shown.colors.is_by_depth()),
            circle_segments,
            show_picture: u32::from(input.show_picture),
            neutral: u32::from(is_neutral),
            strength: strength(input.selection.selected.is_some(), is_neutral),
            levels: input.shown.levels.map(|level| level as f32),
            section: section(input, [right, up, forward]),
            background: input.backdrop,
            ramp: shader_ramp(),
        }
    }
}

/// The section plane in view space, see `common.wgsl`.
fn section(input: &DrawInput<'_>, axes: [Vec3; 3]) -> [f32; 4] {
    let Some(plane) = input.section else { return [0.0, 0.0, 0.0, -1.0] };
    let (normal, offset) = plane.outward();
    let [x, y, z] = axes.map(|axis| normal.dot(axis));
    [x, y, z, normal.dot(input.camera.eye) - offset]
}

/// Width and height in viewport pixels that the picture covers. A pixel of a coarse picture covers a square of viewport pixels,
/// so the picture may extend beyond the viewport; a picture made for a viewport of another shape is stretched.
fn covered(viewport: [u32; 2], picture: [u32; 2], coarseness: f32) -> [f32; 2] {
    let [width, height] = viewport.map(|size| size.max(1));
    let squares = |size: u32| (f64::from(size) / f64::from(coarseness)).ceil() as u32;
    let whole = coarseness >= 1.0 && [squares(width), squares(height)] == picture;
    if whole { picture.map(|size| size as f32 * coarseness) } else { [width as f32, height as f32] }
}

#[cfg(test)]
mod tests {
    use super::covered;

    #[test]
    fn a_coarse_picture_covers_whole_squares() {
        assert_eq!(covered([640, 480], [640, 480], 1.0), [640.0, 480.0]);
        assert_eq!(covered([641, 480], [81, 60], 8.0), [648.0, 480.0]);
        assert_eq!(covered([1000, 999], [250, 250], 4.0), [1000.0, 1000.0]);
        assert_eq!(covered([641, 480], [513, 384], 1.25), [641.25, 480.0]);
    }

    #[test]
    fn a_picture_of_another_shape_is_stretched() {
        assert_eq!(covered([640, 480], [500, 480], 1.0), [640.0, 480.0]);
        assert_eq!(covered([640, 480], [0, 0], f32::NAN), [640.0, 480.0]);
    }
}
