//! Materials and textures.

use std::sync::{Arc, LazyLock};

use glam::{Vec2, Vec3, Vec4};

/// A material of metal and roughness, as in glTF 2.0. Textures are indices into the scene's.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Its name in the file; may be empty.
    pub name: String,
    /// Linear RGB reflectance.
    pub base_color: Vec3,
    /// Multiplies `base_color`, and `alpha` by its alpha.
    pub base_color_texture: Option<u32>,
    /// Opacity, which only decides about holes.
    pub alpha: f32,
    /// Part of the surface that is metal, 0 to 1.
    pub metallic: f32,
    /// Multiplies `metallic` by its blue channel.
    pub metallic_texture: Option<u32>,
    /// Perceptual roughness, 0 to 1.
    pub roughness: f32,
    /// Multiplies `roughness` by its green channel.
    pub roughness_texture: Option<u32>,
    /// Linear RGB reflectance at normal incidence of what is no metal.
    pub specular: Vec3,
    /// Multiplies `specular`.
    pub specular_texture: Option<u32>,
    /// Normals in tangent space, x along u, y against v; see [`Texture`].
    pub normal_texture: Option<u32>,
    /// Multiplies x and y of `normal_texture`.
    pub normal_scale: f32,
    /// Light of the sky that arrives, in its red channel.
    pub occlusion_texture: Option<u32>,
    /// How much of `occlusion_texture` is used, 0 to 1.
    pub occlusion_strength: f32,
    /// Linear RGB emitted light.
    pub emissive: Vec3,
    /// Multiplies `emissive`.
    pub emissive_texture: Option<u32>,
    /// Opacity below which the surface is cut out; 0 for none.
    pub alpha_cutoff: f32,
    /// Part of the light that passes through the surface, as through thin glass, 0 to 1.
    pub transmission: f32,
    /// Shows the base colour unlit.
    pub unlit: bool,
}

impl Material {
    /// Reflectance at normal incidence of most dielectrics, those with a refractive index of 1.5.
    pub const DIELECTRIC: Vec3 = Vec3::splat(0.04);

    /// The textures that it refers to.
    pub fn textures(&self) -> impl Iterator<Item = u32> {
        let all = [
            self.base_color_texture,
            self.metallic_texture,
            self.roughness_texture,
            self.specular_texture,
            self.normal_texture,
            self.occlusion_texture,
            self.emissive_texture,
        ];
        all.into_iter().flatten()
    }

    /// The default material: a warm clay.
    pub fn clay() -> Self {
        Self {
            name: String::new(),
            base_color: Vec3::new(0.62, 0.42, 0.32),
            base_color_texture: None,
            alpha: 1.0,
            metallic: 0.0,
            metallic_texture: None,
            roughness: 1.0,
            roughness_texture: None,
            specular: Self::DIELECTRIC,
            specular_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            occlusion_texture: None,
            occlusion_strength: 1.0,
            emissive: Vec3::ZERO,
            emissive_texture: None,
            alpha_cutoff: 0.0,
            transmission: 0.0,
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

/// An image with straight alpha, row by row from the top, and how it lies on surfaces. Several may share their texels.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// `width * height` texels: red, green and blue, and linear alpha.
    pub texels: Arc<Vec<[u8; 4]>>,
    /// Red, green and blue are numbers rather than colours encoded as sRGB.
    pub is_linear: bool,
    /// The set of texture coordinates: 0 for [`Attributes::uvs`](super::Attributes::uvs), 1 for the second one.
    pub uv_set: u8,
    /// Wrap modes along u and v.
    pub wrap: [WrapMode; 2],
    /// Offset, rotation and scale of KHR_texture_transform as a matrix on (u, v, 1); the identity without it.
    pub uv_transform: glam::Affine2,
}

impl Texture {
    /// Whether `other` lies on surfaces in the same way.
    pub(super) fn is_used_as(&self, other: &Self) -> bool {
        (self.wrap, self.uv_set, self.is_linear) == (other.wrap, other.uv_set, other.is_linear)
            && self.uv_transform == other.uv_transform
    }

    /// Bytes of the texels.
    pub fn bytes(&self) -> u64 {
        size_of_val(&self.texels[..]) as u64
    }

    /// A texture of colours in sRGB, repeated, by the first set of coordinates.
    pub(super) fn new(width: u32, height: u32, texels: Vec<[u8; 4]>) -> Self {
        Self {
            width,
            height,
            texels: Arc::new(texels),
            is_linear: false,
            uv_set: 0,
            wrap: [WrapMode::Repeat; 2],
            uv_transform: glam::Affine2::IDENTITY,
        }
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
        if self.is_linear {
            return Vec4::from_array([r, g, b, a].map(|byte| f32::from(byte) / 255.0));
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Three texels wide and two high, with alpha 0 to 5 fifths, which is interpolated as it is.
    fn texture(wrap: [WrapMode; 2]) -> Texture {
        let texels = [0, 51, 102, 153, 204, 255].map(|alpha| [255, 255, 255, alpha]).to_vec();
        Texture { wrap, ..Texture::new(3, 2, texels) }
    }

    fn assert_fifths(texture: &Texture, u: f32, v: f32, expected: f32) {
        let found = texture.sample(Vec2::new(u, v)).w * 5.0;
        assert!((found - expected).abs() < 1e-3, "{:?} at ({u}, {v}): {found} instead of {expected}", texture.wrap);
    }

    #[test]
    fn each_axis_wraps_in_its_own_way() {
        let sixth = 1.0 / 6.0;
        let repeated = texture([WrapMode::Repeat, WrapMode::ClampToEdge]);
        for (u, v, expected) in [
            (sixth, 0.25, 0.0),
            (0.5, 0.25, 1.0),
            (0.5, 0.75, 4.0),
            (2.0 / 6.0, 0.25, 0.5),
            (0.5, 0.5, 2.5),
            (1.0 + sixth, 0.25, 0.0),
            (-sixth, 0.25, 2.0),
            // Between the last texel and the first.
            (0.0, 0.25, 1.0),
            (0.5, -3.0, 1.0),
            (0.5, 0.0, 1.0),
            (0.5, 1.0, 4.0),
            (0.5, 9.0, 4.0),
        ] {
            assert_fifths(&repeated, u, v, expected);
        }
        let mirrored = texture([WrapMode::MirroredRepeat, WrapMode::Repeat]);
        for (u, v, expected) in [
            (sixth, 0.25, 0.0),
            (1.0 + sixth, 0.25, 2.0),
            (1.5, 0.75, 4.0),
            (2.0 + sixth, 0.25, 0.0),
            (-sixth, 0.25, 0.0),
            (0.0, 0.25, 0.0),
            (sixth, 1.25, 0.0),
            (sixth, 0.0, 1.5),
        ] {
            assert_fifths(&mirrored, u, v, expected);
        }
    }

    #[test]
    fn coordinates_are_transformed_and_must_be_finite() {
        let plain = texture([WrapMode::Repeat; 2]);
        let moved =
            Texture { uv_transform: glam::Affine2::from_translation(Vec2::new(1.0 / 3.0, 0.5)), ..plain.clone() };
        assert_fifths(&moved, 1.0 / 6.0, 0.25, 4.0);
        let clamped = texture([WrapMode::ClampToEdge; 2]);
        assert_fifths(&clamped, f32::NAN, 0.75, 0.0);
        assert_fifths(&clamped, 0.5, f32::INFINITY, 0.0);
        assert_eq!(Texture { texels: Arc::default(), ..plain }.sample(Vec2::ZERO), Vec4::ONE);
    }

    #[test]
    fn numbers_are_not_decoded_as_colors() {
        let colors = Texture::new(1, 1, vec![[128, 0, 255, 51]]);
        let numbers = Texture { is_linear: true, ..colors.clone() };
        assert!((colors.sample(Vec2::ZERO).x - 0.215_861).abs() < 1e-5);
        assert!((numbers.sample(Vec2::ZERO) - Vec4::new(128.0 / 255.0, 0.0, 1.0, 0.2)).abs().max_element() < 1e-6);
    }

    #[test]
    fn colors_beyond_the_range_of_srgb_are_clamped() {
        assert_eq!(linear_from_srgb(Vec3::new(-1.0, 2.0, f32::NAN)), Vec3::new(0.0, 1.0, 1.0));
        let linear = linear_from_srgb(Vec3::new(0.5, 0.04, 0.95));
        assert!((linear - Vec3::new(0.214_041, 0.003_095_98, 0.890_005)).abs().max_element() < 1e-5, "{linear}");
    }
}
