//! Diffuse materials and textures.

use glam::{Vec2, Vec3};

/// How a surface reflects light.
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
    /// Where the alpha of the texture is below this, the surface has a hole; 0 for none.
    pub alpha_cutoff: f32,
    /// Shows its base colour without any light.
    pub unlit: bool,
}

impl Material {
    /// The warm clay of models that bring no material.
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

/// What lies beyond the edge of a texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WrapMode {
    /// The texture again.
    Repeat,
    /// The texture mirrored.
    MirroredRepeat,
    /// Its last texel.
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
    /// Along u and v.
    pub wrap: [WrapMode; 2],
    /// Offset, rotation and scale of KHR_texture_transform as a matrix on (u, v, 1); identity where there is none.
    pub uv_transform: glam::Affine2,
}

impl Texture {
    /// The bilinear colour at `uv` (v down): linear RGB and alpha.
    pub fn sample(&self, _uv: Vec2) -> glam::Vec4 {
        todo!("scene")
    }
}
