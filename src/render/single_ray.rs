//! Single rays, the same that pictures trace: that of a pixel, and those that leave its surface towards the light.

use std::fmt;

use glam::Vec2;
use serde::{Deserialize, Serialize};

use super::ambient_occlusion::{self, around};
use super::lights::Lights;
use super::lit::{key_light, sky_rays};
use super::request::RenderRequest;
use super::sampling::{SampleId, subpixel};
use super::surface;
use super::trace_context::TraceContext;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Hit, Ray};
use bvhscope_engine::kernel::parallel::par_tasks;

/// Purpose of a ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RayKind {
    /// The visible surface.
    Primary,
    /// Sunlight on the visible surface.
    Shadow,
    /// Occlusion of its sky by something near: the first ray of the ambient occlusion mode.
    AmbientOcclusion,
    /// Where its light comes from: the first ray into its hemisphere in the lit mode, which the second sample traces.
    Bounce,
}

impl RayKind {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Primary, Self::Shadow, Self::AmbientOcclusion, Self::Bounce];

    /// The name on the command line and in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Primary => "primary",
            Self::Shadow => "shadow",
            Self::AmbientOcclusion => "ao",
            Self::Bounce => "bounce",
        }
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Primary => "Primary",
            Self::Shadow => "Shadow",
            Self::AmbientOcclusion => "Occlusion",
            Self::Bounce => "Bounce",
        }
    }

    /// True if any hit will do, not only the nearest.
    pub const fn ends_at_any_hit(self) -> bool {
        matches!(self, Self::Shadow | Self::AmbientOcclusion)
    }

    /// The sample of a pixel that traces it first. The first sample traces no light that bounces.
    const fn sample(self) -> u32 {
        if matches!(self, Self::Bounce) { 1 } else { 0 }
    }
}

/// Where the first ray comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RayStart {
    /// Through a pixel of the picture, by column and row.
    Pixel([u32; 2]),
    /// A given ray.
    Given(Ray),
}

/// Why a picture traces no such ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoRay {
    /// Nothing is hit.
    Background,
    /// There is no sun.
    Headlight,
    /// The sun is behind the surface.
    FacesAway,
    /// The material shines by itself.
    Unlit,
}

impl fmt::Display for NoRay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Background => "the primary ray hits nothing, so there is no surface for another ray to start from",
            Self::Headlight => "the headlight is at the eye, so its shadows are never visible: there is no shadow ray",
            Self::FacesAway => "the surface there faces away from the sun: it is dark without a shadow ray",
            Self::Unlit => {
                "the material there is unlit: it has its own colour whatever the light, and needs no ray for it"
            }
        })
    }
}

/// The ray of this kind that the picture of `request` traces for `start`, whole: [`Visible::cut`](super::Visible::cut) leaves the part of it that
/// the section plane keeps. Rays of a given start are those of the first pixel.
///
/// # Errors
///
/// Fails if cancelled. The inner error is the reason why there is no such ray.
pub fn single_ray(
    request: &RenderRequest,
    start: RayStart,
    kind: RayKind,
    token: &CancelToken,
) -> Result<Result<Ray, NoRay>, Cancelled> {
    let pixel = if let RayStart::Pixel(pixel) = start { pixel } else { [0; 2] };
    let id = SampleId { x: pixel[0], y: pixel[1], sample: kind.sample() };
    let first = match start {
        RayStart::Given(ray) => ray,
        RayStart::Pixel([x, y]) => {
            let at = Vec2::new(x as f32, y as f32) + subpixel(id.sample);
            request.camera.for_size(request.width_px, request.height_px).ray(at.x, at.y)
        }
    };
    if kind == RayKind::Primary {
        return Ok(Ok(first));
    }
    request.accel.widen(token)?;
    let normals = surface::Normals::new(&request.settings, &request.accel.scene, token)?;
    let context = TraceContext::new(request, normals);
    let Some(hit) = closest(&context, &first) else { return Ok(Err(NoRay::Background)) };
    Ok(leaving(&context, request, (&first, hit), kind, id))
}

/// The rays of this kind that the picture of `request` traces through the centres of its pixels or from the surfaces seen there, row by
/// row, as far as the section plane keeps them: those of [`single_ray`] for each pixel. Pixels without such a ray are left out. The same
/// for every tree of a scene, and on any number of threads; in the calling thread's rayon pool.
pub fn rays_of_picture(request: &RenderRequest, kind: RayKind, token: &CancelToken) -> Result<Vec<Ray>, Cancelled> {
    if kind != RayKind::Primary {
        request.accel.widen(token)?;
    }
    let normals = surface::Normals::new(&request.settings, &request.accel.scene, token)?;
    let context = TraceContext::new(request, normals);
    let rows = par_tasks(0..request.height_px, token, |y, _| Ok(row_of_rays(&context, request, kind, y)))?;
    Ok(rows.concat())
}

/// The rays of one row of pixels.
fn row_of_rays(context: &TraceContext, request: &RenderRequest, kind: RayKind, y: u32) -> Vec<Ray> {
    let id = |x: u32| SampleId { x, y, sample: kind.sample() };
    let first: Vec<Ray> = (0..request.width_px).map(|x| through_pixel(context, id(x))).collect();
    let rays = if kind == RayKind::Primary {
        first
    } else {
        let mut hits = vec![None; first.len()];
        context.closest_hits(&first, &mut hits);
        let of_pixels = (0..).map(id).zip(first.iter().zip(hits));
        let leaving =
            of_pixels.filter_map(|(id, (first, hit))| leaving(context, request, (first, hit?), kind, id).ok());
        leaving.collect()
    };
    rays.into_iter().map(|ray| request.visible().cut(ray)).collect()
}

/// The primary ray of a sample.
fn through_pixel(context: &TraceContext, id: SampleId) -> Ray {
    let at = Vec2::new(id.x as f32, id.y as f32) + subpixel(id.sample);
    context.camera.ray(at.x, at.y)
}

/// The closest hit as pictures find it.
fn closest(context: &TraceContext, ray: &Ray) -> Option<Hit> {
    let mut hits = [None];
    context.closest_hits(std::slice::from_ref(ray), &mut hits);
    hits[0]
}

/// The ray that leaves the surface which a primary ray hits.
fn leaving(
    context: &TraceContext,
    request: &RenderRequest,
    (first, hit): (&Ray, Hit),
    kind: RayKind,
    id: SampleId,
) -> Result<Ray, NoRay> {
    let scene = context.scene;
    let material = scene.material(hit.primitive_index);
    if material.unlit && kind != RayKind::AmbientOcclusion {
        return Err(NoRay::Unlit);
    }
    let orientation = context.orientation(first, &hit);
    let position = surface::position(scene, &hit);
    match kind {
        RayKind::Primary => Ok(*first),
        RayKind::Shadow => {
            let lights = Lights::of_scene(request.settings.light, scene);
            if !lights.casts_shadows() {
                return Err(NoRay::Headlight);
            }
            let normal = surface::mapped_normal(scene, material, &orientation, first, &hit);
            key_light(context, &lights, &orientation, (normal, -first.direction), id).1.ok_or(NoRay::FacesAway)
        }
        RayKind::AmbientOcclusion => {
            let radius = context.diagonal * ambient_occlusion::RADIUS;
            let mut rays = around(context, position, &orientation, radius, ambient_occlusion::RAYS, id);
            rays.next().ok_or(NoRay::Background)
        }
        RayKind::Bounce => sky_rays(context, position, &orientation, id).next().ok_or(NoRay::Background),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use std::sync::Arc;

    use super::super::lit::Lit;
    use super::super::settings::{Light, RenderSettings};
    use super::super::shade::{AmbientOcclusion, Sample, Shade};
    use super::*;
    use crate::accel::Accel;
    use crate::camera::Camera;
    use crate::scene::{LoadOptions, SceneSource, load};
    use bvhscope_engine::settings::BuildSettings;
    use bvhscope_engine::tree::traverse::TestCounts;

    fn request(light: Light) -> RenderRequest {
        let token = CancelToken::new();
        let source = SceneSource::Builtin { name: "teapot".to_owned(), size: Some(3) };
        let scene = Arc::new(load(&source, &LoadOptions::default(), &token).unwrap());
        let accel = Arc::new(Accel::build(&scene, &BuildSettings::default(), &token).unwrap());
        let settings = RenderSettings { light, ..RenderSettings::default() };
        RenderRequest::new(&accel, Camera::framing(&scene.bounds, scene.up), settings, [24, 16])
    }

    /// The rays that a shading mode traces for a sample of a pixel: those whose closest hits it needs, and occlusion rays.
    fn rays_of<S: Shade>(context: &TraceContext, shade: &S, id: SampleId) -> [Vec<Ray>; 2] {
        let at = Vec2::new(id.x as f32, id.y as f32) + subpixel(id.sample);
        let ray = context.camera.ray(at.x, at.y);
        let (mut bounces, mut occlusion) = (Vec::new(), Vec::new());
        if let Some(hit) = closest(context, &ray) {
            let sample = Sample { context, ray: &ray, id, tests: TestCounts::default(), blocked: &[] };
            let mut point = shade.prepare(&sample, &hit, &mut bounces);
            shade.occlusion_rays(&sample, &hit, &mut point, (&[], &[]), &mut occlusion);
        }
        [bounces, occlusion]
    }

    #[test]
    fn secondary_rays_are_those_of_the_picture() {
        let (request, token) = (request(Light::Sun), CancelToken::new());
        let mut found = [0; 3];
        let normals = surface::Normals::new(&request.settings, &request.accel.scene, &token).unwrap();
        let context = TraceContext::new(&request, normals);
        let lit = Lit::new(Lights::of_scene(request.settings.light, &request.accel.scene));
        for [x, y] in (0..request.height_px).flat_map(|y| (0..request.width_px).map(move |x| [x, y])) {
            let [first, second] = [0, 1].map(|sample| SampleId { x, y, sample });
            let [_, shadow] = rays_of(&context, &lit, first);
            let [_, occlusion] = rays_of(&context, &AmbientOcclusion, first);
            let [bounce, _] = rays_of(&context, &lit, second);
            let of_kinds =
                [(RayKind::Shadow, shadow), (RayKind::AmbientOcclusion, occlusion), (RayKind::Bounce, bounce)];
            for ((kind, traced), found) in of_kinds.into_iter().zip(&mut found) {
                let ray = single_ray(&request, RayStart::Pixel([x, y]), kind, &token).unwrap();
                assert_eq!(ray.ok(), traced.first().copied(), "{kind:?} of {x}, {y}");
                *found += usize::from(!traced.is_empty());
            }
        }
        assert!(found.iter().all(|&count| count > 10), "{found:?}");
    }

    #[test]
    fn the_rays_of_a_picture_are_those_of_its_pixels() {
        let token = CancelToken::new();
        let sun = request(Light::Sun);
        let whole = 24 * 16;
        let plane = crate::section::SectionPlane { normal: glam::Vec3::Z, offset: 0.0, flipped: false };
        let settings = RenderSettings { section: Some(plane), ..sun.settings };
        for request in [sun.clone(), RenderRequest { settings, ..sun }] {
            for kind in RayKind::ALL {
                let pixels = (0..16).flat_map(|y| (0..24).map(move |x| RayStart::Pixel([x, y])));
                let singles: Vec<Ray> = pixels
                    .filter_map(|pixel| single_ray(&request, pixel, kind, &token).unwrap().ok())
                    .map(|ray| request.visible().cut(ray))
                    .collect();
                let together = rays_of_picture(&request, kind, &token).unwrap();
                assert_eq!(together, singles, "{kind:?}");
                let is_whole = together.len() == whole;
                assert!(!together.is_empty() && is_whole == (kind == RayKind::Primary), "{kind:?}: {}", together.len());
            }
        }
        assert_eq!(rays_of_picture(&request(Light::Headlight), RayKind::Shadow, &token), Ok(Vec::new()));
    }

    #[test]
    fn a_ray_that_no_picture_traces_has_a_reason() {
        let token = CancelToken::new();
        let of =
            |request: &RenderRequest, pixel, kind| single_ray(request, RayStart::Pixel(pixel), kind, &token).unwrap();
        let sun = request(Light::Sun);
        assert!(of(&sun, [0, 0], RayKind::Primary).is_ok(), "a ray beside the model is one too");
        for kind in [RayKind::Shadow, RayKind::AmbientOcclusion, RayKind::Bounce] {
            assert_eq!(of(&sun, [0, 0], kind), Err(NoRay::Background));
        }
        let pixels = || (0..16).flat_map(|y| (0..24).map(move |x| [x, y]));
        assert!(pixels().any(|pixel| of(&sun, pixel, RayKind::Shadow) == Err(NoRay::FacesAway)));
        let headlight = request(Light::Headlight);
        assert_eq!(of(&headlight, [12, 8], RayKind::Shadow), Err(NoRay::Headlight));
        assert!(of(&headlight, [12, 8], RayKind::Bounce).is_ok());
    }

    #[test]
    fn a_given_ray_is_traced_as_it_is() {
        let (request, token) = (request(Light::Sun), CancelToken::new());
        let center = request.accel.scene.bounds.center();
        let down = Ray::new(center + glam::Vec3::Y * 10.0, glam::Vec3::NEG_Y);
        let of = |kind| single_ray(&request, RayStart::Given(down), kind, &token).unwrap();
        assert_eq!(of(RayKind::Primary), Ok(down));
        assert!(of(RayKind::Shadow).unwrap().origin.y < down.origin.y);
    }
}
