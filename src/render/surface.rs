//! The surface at a hit: position, normals and colour.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::settings::{NormalSource, RenderSettings};
use crate::scene::{Attributes, CornerNormals, Material, Scene};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Hit, Ray};

/// Surface normals at a hit, both facing the origin of the ray.
#[derive(Debug, Clone, Copy)]
pub(super) struct Orientation {
    /// Unit normal of the triangle's plane.
    pub(super) geometric: Vec3,
    /// Unit normal interpolated from those of the corners; the geometric one if there are none.
    pub(super) smooth: Vec3,
    /// Where shadow rays start: the hit, lifted to the curved surface that the normals pretend (Hanika, *Hacking the Shadow
    /// Terminator*, Ray Tracing Gems II, 2021), so that coarse triangles do not shade one another.
    pub(super) lifted: Vec3,
}

/// Normals of the corners of triangles.
#[derive(Debug, Clone)]
pub(super) enum Normals {
    /// Every triangle is flat.
    Flat,
    /// Those of the file.
    File,
    /// By crease angle.
    Crease(Arc<CornerNormals>),
}

impl Normals {
    /// The normals that `settings` ask for; flat ones where smooth ones do not fit into the memory budget.
    pub(super) fn new(settings: &RenderSettings, scene: &Scene, token: &CancelToken) -> Result<Self, Cancelled> {
        Ok(match settings.normals {
            NormalSource::Flat => Self::Flat,
            NormalSource::File if scene.has_normals() => Self::File,
            NormalSource::File | NormalSource::Crease => {
                scene.normals_by_crease(settings.crease_degrees, token)?.map_or(Self::Flat, Self::Crease)
            }
        })
    }

    /// Normals of a triangle's corners; zero stands for the geometric one.
    fn of(&self, scene: &Scene, triangle: u32) -> Option<[Vec3; 3]> {
        match self {
            Self::Flat => None,
            Self::File => {
                let Attributes { corners, normals, .. } = scene.attributes.as_ref()?;
                Some(corners[triangle as usize].map(|corner| normals.get(corner as usize).copied().unwrap_or_default()))
            }
            Self::Crease(normals) => Some(normals.of(triangle)),
        }
    }
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
pub(super) fn orientation(scene: &Scene, normals: &Normals, ray: &Ray, hit: &Hit) -> Orientation {
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
    let position = position(scene, hit);
    let Some(corners) = normals.of(scene, hit.primitive_index) else {
        return Orientation { geometric, smooth: geometric, lifted: position };
    };
    let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
    let sum = corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2];
    let smooth = sum.normalize_or(geometric);
    // Files disagree on which side of a triangle is outside.
    let side = if smooth.dot(geometric) < 0.0 { -1.0 } else { 1.0 };
    let mut lifted = position;
    for ((corner, normal), weight) in [triangle.a, triangle.b, triangle.c].into_iter().zip(corners).zip(weights) {
        // As far as the hit lies below the plane through the corner.
        let normal = normal * side;
        lifted -= normal * ((position - corner).dot(normal).min(0.0) * weight);
    }
    Orientation { geometric, smooth: smooth * side, lifted }
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
