//! Lit shading: sky light, a key light and materials. Samples after the first trace where the light of the sky is blocked, and
//! what is there: one bounce of light.

use glam::Vec3;

use super::ambient_occlusion::around;
use super::brdf::Reflectance;
use super::lights::Lights;
use super::sampling::SampleId;
use super::shade::{Shade, Shaded};
use super::surface::{self, Orientation};
use super::trace_context::TraceContext;
use bvhscope_engine::geometry::{Hit, Ray};
use bvhscope_engine::tree::Container;
use bvhscope_engine::tree::traverse::TestCounts;

/// Distance, as a fraction of the scene's diagonal, within which a surface shades another by contact.
const CONTACT_RADIUS: f32 = 0.08;
/// Fraction of the sky's light at a surface that blocks the sky, where it touches the blocked one and beyond
/// [`CONTACT_RADIUS`]: stands in for all further bounces.
const BOUNCED_SKY: [f32; 2] = [0.1, 0.65];
/// How far bounced light is mixed with grey of the same mean.
const BOUNCE_PALENESS: f32 = 0.5;
/// Part of the headlight that surfaces out of view reflect: nothing is known of what lies between.
const BOUNCED_HEADLIGHT: f32 = 0.5;

/// Lit shading with materials and textures.
pub(super) struct Lit {
    pub(super) lights: Lights,
    /// Fraction of the sky's light that arrives at the surfaces in view on average: that of the first sample, which traces none.
    pub(super) mean_openness: Vec3,
}

/// A surface in the light, before its shadow rays are traced.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct LitPoint {
    reflectance: Reflectance,
    /// Unit normal, facing the ray.
    normal: Vec3,
    emitted: Vec3,
    /// Fraction of the sky's light that arrives by the material's occlusion map.
    occlusion: f32,
    is_unlit: bool,
    /// Light of an open sky.
    sky: Vec3,
    /// Fraction of it that arrives where nothing is known to block it.
    openness: Vec3,
    /// Light from what blocks the sky; see [`Lit::trace_ambient`].
    bounce: Option<(Vec3, Vec3)>,
    /// The surface has a shadow ray to the sun.
    faces_sun: bool,
}

impl LitPoint {
    /// The shadow rays' answers: whether the sun reaches the surface, and all light that arrives from elsewhere than the key
    /// light.
    fn resolve(&self, blocked: &[bool]) -> (bool, Vec3) {
        let (own, other) = blocked.split_at(usize::from(self.faces_sun).min(blocked.len()));
        let ambient = match self.bounce {
            None => self.sky * self.openness,
            Some((light, sun)) => bounced_light(if other == [false] { light + sun } else { light }, self.sky),
        };
        (own == [false], ambient * self.occlusion)
    }
}

/// Light from where the sky is blocked: no brighter than the sky, so that few samples suffice, and paler than the surfaces that
/// reflect it, as each further bounce would add light of others.
pub(super) fn bounced_light(light: Vec3, sky: Vec3) -> Vec3 {
    let grey = light.element_sum() / 3.0;
    light.lerp(Vec3::splat(grey), BOUNCE_PALENESS).min(sky)
}

impl Lit {
    /// Shading without a measured openness: the first sample sees the whole sky.
    pub(super) const fn new(lights: Lights) -> Self {
        Self { lights, mean_openness: Vec3::ONE }
    }

    /// Traces one ray into the hemisphere of a surface; `None` if it meets the sky. Returns the light that arrives from there, as
    /// if from everywhere: first that without the sun, then that of the sun on what was hit, whose shadow ray is appended to `rays`. The sum of both is to
    /// go through [`bounced_light`].
    pub(super) fn trace_ambient<C: Container>(
        &self,
        context: &TraceContext<C>,
        position: Vec3,
        orientation: &Orientation,
        id: SampleId,
        rays: &mut Vec<Ray>,
    ) -> Option<(Vec3, Vec3)> {
        let ray = around(context, position, orientation, f32::INFINITY, 1, id).next()?;
        let hit = context.closest(&ray)?;
        let scene = context.scene;
        let material = scene.material(hit.primitive_index);
        let color = surface::base_color(scene, material, &hit);
        let emitted = surface::emitted(scene, material, &hit);
        if material.unlit {
            return Some((color + emitted, Vec3::ZERO));
        }
        let there = context.orientation(&ray, &hit);
        let distance = (hit.t / (CONTACT_RADIUS * context.diagonal)).min(1.0);
        let [near, far] = BOUNCED_SKY;
        let mut light = self.lights.sky(there.smooth) * (near + (far - near) * distance);
        let mut bounced_sun = Vec3::ZERO;
        let (towards_key, key) = self.lights.key(-ray.direction);
        if self.lights.sun().is_none() {
            light += key * (BOUNCED_HEADLIGHT * there.smooth.dot(towards_key).max(0.0));
        } else if there.smooth.dot(towards_key) > 0.0 {
            bounced_sun = color * key * there.smooth.dot(towards_key);
            rays.push(context.ray_from(there.lifted, there.geometric, towards_key, f32::INFINITY));
        }
        Some((color * light + emitted, bounced_sun))
    }
}

impl<C: Container> Shade<C> for Lit {
    type Point = LitPoint;

    /// A shadow ray to the sun, then one from what blocks the sky.
    fn prepare(
        &self,
        context: &TraceContext<C>,
        ray: &Ray,
        hit: &Hit,
        id: SampleId,
        shadow_rays: &mut Vec<Ray>,
    ) -> LitPoint {
        let scene = context.scene;
        let material = scene.material(hit.primitive_index);
        let base_color = surface::base_color(scene, material, hit);
        let mut point = LitPoint {
            emitted: surface::emitted(scene, material, hit),
            is_unlit: material.unlit,
            openness: Vec3::ONE,
            ..LitPoint::default()
        };
        if material.unlit {
            point.emitted += base_color;
            return point;
        }
        let orientation = context.orientation(ray, hit);
        let position = surface::position(scene, hit);
        point.normal = surface::mapped_normal(scene, material, &orientation, ray, hit);
        point.occlusion = surface::occlusion(scene, material, hit);
        point.sky = self.lights.sky(point.normal);
        point.reflectance = surface::reflectance(scene, material, base_color, hit);
        if let Some(sun) = self.lights.sun()
            && orientation.smooth.dot(sun) > 0.0
            && point.normal.dot(sun) > 0.0
        {
            let towards = if id.sample == 0 { sun } else { self.lights.towards_sun(id.light_point()) };
            shadow_rays.push(context.ray_from(orientation.lifted, orientation.geometric, towards, f32::INFINITY));
            point.faces_sun = true;
        }
        // The first sample stays noise-free and fast.
        if id.sample == 0 {
            point.openness = self.mean_openness;
        } else {
            point.bounce = self.trace_ambient(context, position, &orientation, id, shadow_rays);
        }
        point
    }

    fn hit(
        &self,
        _context: &TraceContext<C>,
        ray: &Ray,
        _hit: &Hit,
        point: &LitPoint,
        _tests: TestCounts,
        blocked: &[bool],
    ) -> Shaded {
        if point.is_unlit {
            return Shaded::color(point.emitted);
        }
        let LitPoint { reflectance, normal, .. } = *point;
        let view = -ray.direction;
        let (sees_sun, ambient) = point.resolve(blocked);
        let mirrored = reflectance.mirrored(normal.dot(view));
        // What blocks the sky blocks its reflection as well.
        let openness = ambient / point.sky;
        let direction = (normal * (2.0 * normal.dot(view)) - view).normalize_or(normal);
        let mut radiance = reflectance.diffuse * (1.0 - mirrored.max_element()) * ambient
            + mirrored * self.lights.mirrored_sky(direction, reflectance.roughness()) * openness;
        if sees_sun || self.lights.sun().is_none() {
            let (towards_key, key) = self.lights.key(view);
            radiance += reflectance.direct(normal, view, towards_key) * key;
        }
        Shaded::radiance(radiance + point.emitted)
    }
}
