//! What a ray met: position, directions and colour of the surface at a hit.

use glam::{Vec2, Vec3};

use crate::scene::{Attributes, Material, Scene};
use bvhscope_engine::geometry::{Hit, Ray};

/// A surface's directions at a hit, both turned to the side that the ray came from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Orientation {
    /// Unit normal of the flat triangle.
    pub(super) geometric: Vec3,
    /// Unit normal interpolated from the corners where the file has normals, else the geometric one.
    pub(super) smooth: Vec3,
}

/// Weighs the corners' values at the hit.
fn interpolate(values: &[Vec3], corners: [u32; 3], hit: &Hit) -> Vec3 {
    let [a, b, c] = corners.map(|corner| values[corner as usize]);
    a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v
}

/// The point that was hit, from the triangle's corners: more exact than along the ray.
pub(super) fn position(scene: &Scene, hit: &Hit) -> Vec3 {
    let triangle = &scene.triangles[hit.primitive_index as usize];
    triangle.a + (triangle.b - triangle.a) * hit.u + (triangle.c - triangle.a) * hit.v
}

/// The surface's directions.
pub(super) fn orientation(scene: &Scene, ray: &Ray, hit: &Hit) -> Orientation {
    let triangle = &scene.triangles[hit.primitive_index as usize];
    let towards = -ray.direction;
    let scaled = triangle.scaled_normal();
    let mut geometric = if scaled.length_squared() > 1e-30 {
        scaled.normalize()
    } else {
        // The product of two short edges may underflow where their directions are fine.
        let (ab, ac) = ((triangle.b - triangle.a).normalize_or_zero(), (triangle.c - triangle.a).normalize_or_zero());
        ab.cross(ac).normalize_or(towards)
    };
    if geometric.dot(towards) < 0.0 {
        geometric = -geometric;
    }
    let mut smooth = geometric;
    if let Some(Attributes { corners, normals, .. }) = &scene.attributes
        && !normals.is_empty()
    {
        smooth = interpolate(normals, corners[hit.primitive_index as usize], hit).normalize_or(geometric);
        // Files disagree on which side is outside.
        if smooth.dot(geometric) < 0.0 {
            smooth = -smooth;
        }
    }
    Orientation { geometric, smooth }
}

/// Texture coordinates; zero where the file has none.
fn uv(scene: &Scene, hit: &Hit) -> Vec2 {
    match &scene.attributes {
        Some(Attributes { corners, uvs, .. }) if !uvs.is_empty() => {
            let [a, b, c] = corners[hit.primitive_index as usize].map(|corner| uvs[corner as usize]);
            a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v
        }
        _ => Vec2::ZERO,
    }
}

/// The texture's alpha; 1 without texture.
pub(super) fn alpha(scene: &Scene, material: &Material, hit: &Hit) -> f32 {
    material.base_color_texture.map_or(1.0, |texture| scene.textures[texture as usize].sample(uv(scene, hit)).w)
}

/// Linear reflectance: material times texture times vertex colour.
pub(super) fn base_color(scene: &Scene, material: &Material, hit: &Hit) -> Vec3 {
    let mut color = material.base_color;
    if let Some(texture) = material.base_color_texture {
        color *= scene.textures[texture as usize].sample(uv(scene, hit)).truncate();
    }
    if let Some(Attributes { corners, colors, .. }) = &scene.attributes
        && !colors.is_empty()
    {
        color *= interpolate(colors, corners[hit.primitive_index as usize], hit);
    }
    color
}
