//! The surface at a hit: position, normals and colour.

use glam::{Vec2, Vec3};

use crate::scene::{Attributes, Material, Scene};
use bvhscope_engine::geometry::{Hit, Ray};

/// Surface normals at a hit, both facing the origin of the ray.
#[derive(Debug, Clone, Copy)]
pub(super) struct Orientation {
    /// Unit normal of the triangle's plane.
    pub(super) geometric: Vec3,
    /// Unit normal interpolated from the file's vertex normals; the geometric one if there are none.
    pub(super) smooth: Vec3,
}

/// Interpolates the values of the corners at the hit.
fn interpolate(values: &[Vec3], corners: [u32; 3], hit: &Hit) -> Vec3 {
    let [a, b, c] = corners.map(|corner| values[corner as usize]);
    a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v
}

/// The hit point, interpolated from the triangle's corners, which is more accurate than along the ray.
pub(super) fn position(scene: &Scene, hit: &Hit) -> Vec3 {
    let triangle = &scene.triangles[hit.primitive_index as usize];
    triangle.a + (triangle.b - triangle.a) * hit.u + (triangle.c - triangle.a) * hit.v
}

/// The surface normals at a hit.
pub(super) fn orientation(scene: &Scene, ray: &Ray, hit: &Hit) -> Orientation {
    let triangle = &scene.triangles[hit.primitive_index as usize];
    let towards = -ray.direction;
    let scaled = triangle.scaled_normal();
    let mut geometric = if scaled.length_squared() > 1e-30 {
        scaled.normalize()
    } else {
        // The cross product of two short edges may underflow although their directions are well defined.
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
        // Files disagree on which side of a triangle is outside.
        if smooth.dot(geometric) < 0.0 {
            smooth = -smooth;
        }
    }
    Orientation { geometric, smooth }
}

/// Texture coordinates at a hit; zero if the file has none.
fn uv(scene: &Scene, hit: &Hit) -> Vec2 {
    match &scene.attributes {
        Some(Attributes { corners, uvs, .. }) if !uvs.is_empty() => {
            let [a, b, c] = corners[hit.primitive_index as usize].map(|corner| uvs[corner as usize]);
            a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v
        }
        _ => Vec2::ZERO,
    }
}

/// Alpha of the base colour texture at a hit; 1 without texture.
pub(super) fn alpha(scene: &Scene, material: &Material, hit: &Hit) -> f32 {
    material.base_color_texture.map_or(1.0, |texture| scene.textures[texture as usize].sample(uv(scene, hit)).w)
}

/// Linear base colour at a hit: material times texture times vertex colour.
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
