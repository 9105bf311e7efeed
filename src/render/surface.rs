//! The surface at a hit: position, normals and colour.

use std::ops::{Add, Mul};
use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};

use super::brdf::Reflectance;
use super::settings::{NormalSource, RenderSettings};
use crate::scene::{Attributes, CornerNormals, Material, Scene};
use crate::vectors::direction;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Hit, Ray, Triangle};

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
    /// The ray comes from behind the surface.
    pub(super) is_back: bool,
}

impl Orientation {
    /// That of a plane with this unit normal.
    pub(super) const fn flat(normal: Vec3, position: Vec3) -> Self {
        Self { geometric: normal, smooth: normal, lifted: position, is_back: false }
    }
}

/// Triangles whose smooth normals take less time than a coarse picture.
const SMOOTHED_AT_ONCE: usize = 1 << 17;

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
        Ok(match Self::without_smoothing(settings, scene) {
            Some(normals) => normals,
            None => scene.normals_by_crease(settings.crease_degrees, token)?.map_or(Self::Flat, Self::Crease),
        })
    }

    /// [`Normals::new`], but flat ones where smooth ones would take long to make.
    pub(super) fn at_once(settings: &RenderSettings, scene: &Scene, token: &CancelToken) -> Result<Self, Cancelled> {
        if scene.triangles.len() <= SMOOTHED_AT_ONCE {
            return Self::new(settings, scene, token);
        }
        Ok(Self::without_smoothing(settings, scene)
            .unwrap_or_else(|| scene.known_normals_by_crease(settings.crease_degrees).map_or(Self::Flat, Self::Crease)))
    }

    /// `None` where normals by crease angle are asked for.
    fn without_smoothing(settings: &RenderSettings, scene: &Scene) -> Option<Self> {
        match settings.normals {
            NormalSource::Flat => Some(Self::Flat),
            NormalSource::File if scene.has_normals() => Some(Self::File),
            NormalSource::File | NormalSource::Crease => None,
        }
    }

    /// Normals of a triangle's corners; zero stands for the geometric one.
    fn of(&self, scene: &Scene, hit: u32) -> Option<[Vec3; 3]> {
        let triangle = scene.surface_of(hit);
        let normals = match self {
            Self::Flat => return None,
            Self::File => {
                let Attributes { corners, normals, .. } = scene.attributes.as_ref()?;
                corners[triangle as usize].map(|corner| normals.get(corner as usize).copied().unwrap_or_default())
            }
            Self::Crease(normals) => normals.of(triangle),
        };
        Some(scene.normals_of(hit, normals))
    }
}

/// Interpolates the values of the corners at the hit.
fn interpolate<T>(values: &[T], corners: [u32; 3], hit: &Hit) -> T
where
    T: Copy + Add<Output = T> + Mul<f32, Output = T>,
{
    let [a, b, c] = corners.map(|corner| values[corner as usize]);
    a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v
}

/// The hit point, interpolated from the triangle's corners, which is more accurate than along the ray.
pub(super) fn position(scene: &Scene, hit: &Hit) -> Vec3 {
    let triangle = &scene.triangle(hit.primitive_index);
    triangle.a + (triangle.b - triangle.a) * hit.u + (triangle.c - triangle.a) * hit.v
}

/// The surface normals at a hit.
pub(super) fn orientation(scene: &Scene, normals: &Normals, ray: &Ray, hit: &Hit) -> Orientation {
    let triangle = &scene.triangle(hit.primitive_index);
    let towards = -ray.direction;
    let scaled = triangle.scaled_normal();
    let mut geometric = if (1e-30..1e30).contains(&scaled.length_squared()) {
        scaled.normalize()
    } else {
        // The cross product of two short or long edges may leave the range although their directions are well defined.
        let [ab, ac] = [triangle.b, triangle.c].map(|corner| direction(corner - triangle.a).unwrap_or(Vec3::ZERO));
        ab.cross(ac).normalize_or(towards)
    };
    let is_behind = geometric.dot(towards) < 0.0;
    if is_behind {
        geometric = -geometric;
    }
    let position = position(scene, hit);
    let Some(corners) = normals.of(scene, hit.primitive_index) else {
        return Orientation { geometric, smooth: geometric, lifted: position, is_back: is_behind };
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
    Orientation { geometric, smooth: smooth * side, lifted, is_back: side < 0.0 }
}

/// Texture coordinates of a triangle's corners; `None` if the file has none in this set.
fn corner_uvs(scene: &Scene, hit: u32, set: u8) -> Option<[Vec2; 3]> {
    let attributes = scene.attributes.as_ref()?;
    let uvs = if set == 0 { &attributes.uvs } else { &attributes.uvs2 };
    if uvs.is_empty() {
        return None;
    }
    Some(attributes.corners[scene.surface_of(hit) as usize].map(|corner| uvs[corner as usize]))
}

/// A texture at a hit: linear RGB and alpha. Reads the corner where the file has no texture coordinates.
fn sample(scene: &Scene, texture: u32, hit: &Hit) -> Vec4 {
    let texture = &scene.textures[texture as usize];
    let uv = corner_uvs(scene, hit.primitive_index, texture.uv_set)
        .map_or(Vec2::ZERO, |[a, b, c]| a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v);
    texture.sample(uv)
}

/// Opacity at a hit: of material, texture and vertices.
pub(super) fn alpha(scene: &Scene, material: &Material, hit: &Hit) -> f32 {
    let of_texture = material.base_color_texture.map_or(1.0, |texture| sample(scene, texture, hit).w);
    let of_vertices = match &scene.attributes {
        Some(Attributes { corners, alphas, .. }) if !alphas.is_empty() => {
            interpolate(alphas, corners[scene.surface_of(hit.primitive_index) as usize], hit)
        }
        _ => 1.0,
    };
    material.alpha * of_texture * of_vertices
}

/// Linear light that a surface emits at a hit.
pub(super) fn emitted(scene: &Scene, material: &Material, hit: &Hit) -> Vec3 {
    match material.emissive_texture {
        Some(texture) => material.emissive * sample(scene, texture, hit).truncate(),
        None => material.emissive,
    }
}

/// Fraction of the sky's light that arrives at a hit by the occlusion map, 0 to 1.
pub(super) fn occlusion(scene: &Scene, material: &Material, hit: &Hit) -> f32 {
    let Some(texture) = material.occlusion_texture else { return 1.0 };
    1.0 - material.occlusion_strength * (1.0 - sample(scene, texture, hit).x)
}

/// How a material reflects at a hit, where its base colour is `base_color`.
pub(super) fn reflectance(scene: &Scene, material: &Material, base_color: Vec3, hit: &Hit) -> Reflectance {
    let (mut metallic, mut roughness) = (material.metallic, material.roughness);
    let rough = material.roughness_texture.map(|texture| sample(scene, texture, hit));
    if let Some(texel) = rough {
        roughness *= texel.y;
    }
    if let Some(texture) = material.metallic_texture {
        let shared = rough.filter(|_| material.roughness_texture == Some(texture));
        metallic *= shared.unwrap_or_else(|| sample(scene, texture, hit)).z;
    }
    let specular = match material.specular_texture {
        Some(texture) => material.specular * sample(scene, texture, hit).truncate(),
        None => material.specular,
    };
    Reflectance::new(base_color, metallic, roughness, specular)
}

/// The unit normal at a hit by the material's normal map, facing the origin of the ray; the smooth one without a map, or without
/// texture coordinates that span the triangle. Tangents are those of the file, or follow the texture coordinates of each triangle.
pub(super) fn mapped_normal(
    scene: &Scene,
    material: &Material,
    orientation: &Orientation,
    ray: &Ray,
    hit: &Hit,
) -> Vec3 {
    let normal = orientation.smooth;
    let Some(index) = material.normal_texture else { return normal };
    let texture = &scene.textures[index as usize];
    let Some(uvs) = corner_uvs(scene, hit.primitive_index, texture.uv_set) else { return normal };
    let [a, b, c] = uvs.map(|uv| texture.uv_transform.transform_point2(uv));
    let triangle = &scene.triangle(hit.primitive_index);
    let by_uvs = || tangents(triangle, b - a, c - a, normal);
    let Some((along_u, along_v)) = file_tangents(scene, orientation, hit).or_else(by_uvs) else { return normal };
    let texel = sample(scene, index, hit).truncate() * 2.0 - 1.0;
    // Seen from behind, the bumps are dents.
    let scale = if orientation.is_back { -material.normal_scale } else { material.normal_scale };
    // y of tangent space points against v.
    let mapped = along_u * (texel.x * scale) - along_v * (texel.y * scale) + normal * texel.z.max(0.0);
    let mapped = mapped.normalize_or(normal);
    // A normal that faces away would be black.
    let facing = mapped.dot(-ray.direction);
    if facing < MIN_FACING { (mapped - ray.direction * (MIN_FACING - facing)).normalize_or(normal) } else { mapped }
}

/// Least cosine between a mapped normal and the direction to the viewer.
const MIN_FACING: f32 = 0.02;

/// Unit directions along u and along v by the tangents of the file, perpendicular to the smooth normal; `None` where it has none.
fn file_tangents(scene: &Scene, orientation: &Orientation, hit: &Hit) -> Option<(Vec3, Vec3)> {
    let Attributes { corners, tangents, .. } = scene.attributes.as_ref().filter(|all| !all.tangents.is_empty())?;
    let tangent = interpolate(tangents, corners[scene.surface_of(hit.primitive_index) as usize], hit);
    let tangent = scene.tangent_of(hit.primitive_index, tangent);
    let normal = orientation.smooth;
    let along_u = (tangent.truncate() - normal * normal.dot(tangent.truncate())).try_normalize()?;
    // The bitangent belongs to the side that the file calls the front, and points against v.
    let sign = if (tangent.w < 0.0) == orientation.is_back { 1.0 } else { -1.0 };
    Some((along_u, normal.cross(along_u) * -sign))
}

/// Unit directions on the surface along u and along v, perpendicular to `normal`. `uv_b` and `uv_c` are the texture coordinates of
/// the second and third corner less those of the first.
fn tangents(triangle: &Triangle, uv_b: Vec2, uv_c: Vec2, normal: Vec3) -> Option<(Vec3, Vec3)> {
    let (ab, ac) = (triangle.b - triangle.a, triangle.c - triangle.a);
    // The area is negative where textures are mirrored; its size does not matter for directions.
    let sign = uv_b.perp_dot(uv_c).signum();
    let along_u = (ab * uv_c.y - ac * uv_b.y) * sign;
    let along_v = (ac * uv_b.x - ab * uv_c.x) * sign;
    let flat = |direction: Vec3| {
        let direction = direction.normalize_or_zero();
        (direction - normal * normal.dot(direction)).try_normalize()
    };
    Some((flat(along_u)?, flat(along_v)?))
}

/// Linear base colour at a hit: material times texture times vertex colour.
pub(super) fn base_color(scene: &Scene, material: &Material, hit: &Hit) -> Vec3 {
    let mut color = material.base_color;
    if let Some(texture) = material.base_color_texture {
        color *= sample(scene, texture, hit).truncate();
    }
    if let Some(Attributes { corners, colors, .. }) = &scene.attributes
        && !colors.is_empty()
    {
        color *= interpolate(colors, corners[scene.surface_of(hit.primitive_index) as usize], hit);
    }
    color
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneSource;
    use glam::DVec3;

    /// The unit triangle in the plane z = 0 with a texel that leans along u and against v.
    fn leaning() -> Scene {
        let triangle = Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y };
        let mut scene = Scene::from_triangles(SceneSource::default_builtin(), vec![triangle]);
        assert_eq!(scene.offset, DVec3::ZERO);
        let uvs = vec![Vec2::ZERO, Vec2::X, Vec2::NEG_Y];
        scene.attributes = Some(Attributes {
            corners: vec![[0, 1, 2]].into(),
            normals: vec![Vec3::Z; 3],
            uvs: uvs.into(),
            ..Attributes::default()
        });
        scene.materials[0].normal_texture = Some(0);
        let texture = crate::scene::Texture {
            width: 1,
            height: 1,
            texels: Arc::new(vec![[192, 160, 230, 255]]),
            is_linear: true,
            uv_set: 0,
            wrap: [crate::scene::WrapMode::Repeat; 2],
            uv_transform: glam::Affine2::IDENTITY,
        };
        scene.textures.push(texture);
        scene
    }

    fn seen(scene: &Scene, from: Vec3) -> Vec3 {
        let hit = Hit { primitive_index: 0, t: 1.0, u: 0.25, v: 0.25 };
        let ray = Ray::new(from, -from);
        let orientation = orientation(scene, &Normals::File, &ray, &hit);
        mapped_normal(scene, &scene.materials[0], &orientation, &ray, &hit)
    }

    #[test]
    fn tangents_of_a_file_replace_those_by_texture_coordinates() {
        let mut scene = leaning();
        let by_uvs = [Vec3::Z, Vec3::NEG_Z].map(|from| seen(&scene, from));
        assert!(by_uvs[0].x > 0.1 && by_uvs[0].y > 0.1, "{by_uvs:?}");
        let mut with = |tangent: Vec4| {
            scene.attributes.as_mut().into_iter().for_each(|all| all.tangents = vec![tangent; 3]);
            [Vec3::Z, Vec3::NEG_Z].map(|from| seen(&scene, from))
        };
        for (found, expected) in with(Vec4::new(1.0, 0.0, 0.0, 1.0)).into_iter().zip(by_uvs) {
            assert!((found - expected).length() < 1e-6, "{found} instead of {expected}");
        }
        // A mirrored bitangent turns y around, a tangent along y both.
        let [front, back] = with(Vec4::new(1.0, 0.0, 0.0, -1.0));
        assert!((front - by_uvs[0] * Vec3::new(1.0, -1.0, 1.0)).length() < 1e-6, "{front}");
        assert!((back - by_uvs[1] * Vec3::new(1.0, -1.0, 1.0)).length() < 1e-6, "{back}");
        let [turned, _] = with(Vec4::new(0.0, 1.0, 0.0, 1.0));
        assert!((turned - Vec3::new(-by_uvs[0].y, by_uvs[0].x, by_uvs[0].z)).length() < 1e-6, "{turned}");
        assert_eq!(with(Vec4::ZERO), by_uvs);
    }
}
