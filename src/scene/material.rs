//! Diffuse materials and textures.

use std::sync::LazyLock;

use glam::{Vec2, Vec3, Vec4};

/// A diffuse material.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Its name in the file; may be empty.
    pub name: String,
    /// Linear RGB reflectance.
    pub base_color: Vec3,
    /// Multiplies `base_color`: an index into the scene's textures.
    pub base_color_texture: Option<u32>,
    /// Linear RGB emitted light.
    pub emissive: Vec3,
    /// Texture alpha below which the surface is cut out; 0 for none.
    pub alpha_cutoff: f32,
    /// Shows the base colour unlit.
    pub unlit: bool,
}

impl Material {
    /// The default material: a warm clay.
    pub fn clay() -> Self {
        Self {
            name: String::new(),
            base_color: Vec3::new(0.62, 0.42, 0.32),
            base_color_texture: None,
            emissive: Vec3::ZERO,
            alpha_cutoff: 0.0,
            unlit: false,
        }
    }
}

/// Addressing of a texture outside 0..1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum WrapMode {
    /// Repeats the texture.
    Repeat,
    /// Repeats the texture, mirrored every other time.
    MirroredRepeat,
    /// Repeats the texel at the edge.
    ClampToEdge,
}

/// An image in sRGB with straight alpha, row by row from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// `width * height` texels, sRGB-encoded red, green, blue and linear alpha.
    pub texels: Vec<[u8; 4]>,
    /// Wrap modes along u and v.
    pub wrap: [WrapMode; 2],
    /// Offset, rotation and scale of KHR_texture_transform as a matrix on (u, v, 1); the identity without it.
    pub uv_transform: glam::Affine2,
}

impl Texture {
    /// Bytes of the texels.
    pub fn bytes(&self) -> u64 {
        size_of_val(&self.texels[..]) as u64
    }

    /// Bilinearly interpolated linear RGB and alpha at `uv` (v down).
    pub fn sample(&self, uv: Vec2) -> Vec4 {
        if self.texels.is_empty() {
            return Vec4::ONE;
        }
        let uv = self.uv_transform.transform_point2(uv);
        // Coordinates that are not finite read the corner.
        let uv = if uv.is_finite() { uv } else { Vec2::ZERO };
        let (x, fx) = bilinear_taps(uv.x, self.width, self.wrap[0]);
        let (y, fy) = bilinear_taps(uv.y, self.height, self.wrap[1]);
        let row = |y: u32| self.texel(x[0], y).lerp(self.texel(x[1], y), fx);
        row(y[0]).lerp(row(y[1]), fy)
    }

    /// A texel as linear RGB and alpha.
    fn texel(&self, x: u32, y: u32) -> Vec4 {
        let index = (y as usize).saturating_mul(self.width as usize).saturating_add(x as usize);
        let [r, g, b, a] = self.texels.get(index).copied().unwrap_or([255; 4]);
        let linear = &*SRGB_TO_LINEAR;
        Vec4::new(linear[r as usize], linear[g as usize], linear[b as usize], f32::from(a) / 255.0)
    }
}

/// Linear value of each sRGB byte (IEC 61966-2-1).
static SRGB_TO_LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|byte| {
        let encoded = byte as f32 / 255.0;
        if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
    })
});

/// The indices of the two texels beside a coordinate, and the weight of the second.
fn bilinear_taps(coordinate: f32, size: u32, wrap: WrapMode) -> ([u32; 2], f32) {
    // Whole periods are subtracted first, so that large coordinates keep their precision.
    let coordinate = match wrap {
        WrapMode::Repeat => coordinate - coordinate.floor(),
        WrapMode::MirroredRepeat => coordinate.rem_euclid(2.0),
        WrapMode::ClampToEdge => coordinate.clamp(0.0, 1.0),
    };
    let position = coordinate * size as f32 - 0.5;
    let floor = position.floor();
    let first = floor as i64;
    ([first, first.saturating_add(1)].map(|index| wrap_index(index, size, wrap)), position - floor)
}

fn wrap_index(index: i64, size: u32, wrap: WrapMode) -> u32 {
    let (n, last) = (i64::from(size.max(1)), i64::from(size.saturating_sub(1)));
    let within = index.rem_euclid(n);
    let is_mirrored = index.div_euclid(n).rem_euclid(2) == 1;
    let index = match wrap {
        WrapMode::MirroredRepeat if is_mirrored => last.saturating_sub(within),
        WrapMode::Repeat | WrapMode::MirroredRepeat => within,
        WrapMode::ClampToEdge => index.clamp(0, last),
    };
    index as u32
}

/// Converts an sRGB colour to linear RGB.
pub(super) fn linear_from_srgb(color: Vec3) -> Vec3 {
    let channel = |encoded: f32| {
        let encoded = if encoded.is_finite() { encoded.clamp(0.0, 1.0) } else { 1.0 };
        if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
    };
    Vec3::new(channel(color.x), channel(color.y), channel(color.z))
}
