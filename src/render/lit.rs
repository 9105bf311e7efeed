//! Lit shading: sky light, a key light and materials. Samples after the first trace where the light of the sky is blocked, and
//! what is there: one bounce of light.

use glam::Vec3;

use super::ambient_occlusion::around;
use super::brdf::Reflectance;
use super::ground::Ground;
use super::lights::{KeyLight, Lights};
use super::sampling::SampleId;
use super::shade::{Sample, Shade, Shaded};
use super::surface::{self, Orientation};
use super::trace_context::{TraceContext, chance};
use bvhscope_engine::geometry::{Hit, Ray};

/// Distance, as a fraction of the scene's diagonal, within which a surface shades another by contact.
const CONTACT_RADIUS: f32 = 0.08;
/// Fraction of the sky's light at a surface that blocks the sky, where it touches the blocked one and beyond
/// [`CONTACT_RADIUS`]: stands in for all further bounces.
const BOUNCED_SKY: [f32; 2] = [0.1, 0.65];
/// Directions that are traced in each sample after the first.
const BOUNCES: usize = 1;
/// Brightest bounced light as a fraction of the sky's.
const MAX_BOUNCED: f32 = 0.6;
/// Greatest weight of the mean light in view: that of a view which no sky reaches.
const MAX_MEAN_WEIGHT: f32 = 0.5;
/// How far bounced light is mixed with grey of the same mean.
const BOUNCE_PALENESS: f32 = 0.5;
/// Part of the headlight that surfaces out of view reflect; obstacles between are not traced.
const BOUNCED_HEADLIGHT: f32 = 0.5;

/// Lit shading with materials and textures.
pub(super) struct Lit {
    pub(super) lights: Lights,
    /// Fraction of the sky's light that arrives at the surfaces in view on average: that of the first sample, which traces none.
    pub(super) mean_openness: Vec3,
    /// Catches the model's shadow.
    pub(super) ground: Option<Ground>,
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
    /// Light from what blocks the sky in each direction that was traced; see [`Lit::bounce`].
    bounces: [Option<Bounce>; BOUNCES],
    /// How many of these were traced: none in the first sample.
    bounce_count: usize,
    /// Weight of the mean light in view, which has no noise, against what was traced.
    mean_weight: f32,
    key: KeyLight,
    /// The shadow ray to the key light of a surface that faces it.
    key_ray: Option<Ray>,
}

impl LitPoint {
    /// The shadow rays' answers: whether the key light reaches the surface, and all light that arrives from elsewhere than the key
    /// light.
    fn resolve(&self, blocked: &[bool], mean_openness: Vec3) -> (bool, Vec3) {
        let mut blocked = blocked.iter();
        let sees_key = self.key_ray.is_some() && blocked.next() == Some(&false);
        let mean = self.sky * mean_openness;
        if self.bounce_count == 0 {
            return (sees_key, mean * self.occlusion);
        }
        let mut sum = Vec3::ZERO;
        for bounce in &self.bounces[..self.bounce_count] {
            sum += match bounce {
                None => self.sky,
                Some(Bounce { light, sun: Some(sun) }) if blocked.next() == Some(&false) => {
                    bounced_light(*light + *sun, self.sky)
                }
                Some(Bounce { light, .. }) => bounced_light(*light, self.sky),
            };
        }
        (sees_key, (sum / self.bounce_count as f32).lerp(mean, self.mean_weight) * self.occlusion)
    }
}

/// Light from a surface that blocks the sky.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounce {
    /// Without the sun.
    pub(super) light: Vec3,
    /// Of the sun, if its shadow ray meets nothing; `None` without one.
    pub(super) sun: Option<Vec3>,
}

/// Light from where the sky is blocked: less bright than the sky, so that few samples suffice, and paler than the surfaces that
/// reflect it, as each further bounce would add light of others.
pub(super) fn bounced_light(light: Vec3, sky: Vec3) -> Vec3 {
    let grey = light.element_sum() / 3.0;
    light.lerp(Vec3::splat(grey), BOUNCE_PALENESS).min(sky * MAX_BOUNCED)
}

impl Lit {
    /// Shading without a measured openness: the first sample sees the whole sky.
    pub(super) const fn new(lights: Lights) -> Self {
        Self { lights, mean_openness: Vec3::ONE, ground: None }
    }

    /// The light that a ray into the hemisphere of a surface meets, as if from everywhere; it is to go through [`bounced_light`].
    /// `None` if the ray hits nothing and so meets the sky. The shadow ray of its sun is appended to `rays`.
    pub(super) fn bounce(
        &self,
        context: &TraceContext,
        ray: &Ray,
        hit: Option<Hit>,
        rays: &mut Vec<Ray>,
    ) -> Option<Bounce> {
        let hit = hit?;
        let scene = context.scene;
        let material = scene.material(hit.primitive_index);
        let color = surface::base_color(scene, material, &hit);
        let emitted = surface::emitted(scene, material, &hit);
        if material.unlit {
            return Some(Bounce { light: color + emitted, sun: None });
        }
        let there = context.orientation(ray, &hit);
        let distance = (hit.t / (CONTACT_RADIUS * context.diagonal)).min(1.0);
        let [near, far] = BOUNCED_SKY;
        let mut light = self.lights.sky(there.smooth) * (near + (far - near) * distance);
        let mut sun = None;
        let key = self.lights.key(there.lifted, there.smooth, -ray.direction, Some(chance(&hit)));
        let facing = there.smooth.dot(key.towards).max(0.0);
        if !self.lights.casts_shadows() {
            light += key.light * (BOUNCED_HEADLIGHT * facing);
        } else if facing > 0.0 {
            sun = Some(color * key.light * facing);
            rays.push(context.ray_to(there.lifted, there.geometric, key.towards, key.distance));
        }
        Some(Bounce { light: color * light + emitted, sun })
    }
}

/// The key light at a surface with this mapped `normal`, and the shadow ray towards it: `None` if nothing blocks that light, or the
/// surface or its mapped normal faces away from it.
pub(super) fn key_light(
    context: &TraceContext,
    lights: &Lights,
    orientation: &Orientation,
    (normal, view): (Vec3, Vec3),
    id: SampleId,
) -> (KeyLight, Option<Ray>) {
    let point = id.light_point();
    let key = lights.key(orientation.lifted, normal, view, (id.sample > 0).then_some(point.x));
    let is_facing = orientation.smooth.dot(key.towards) > 0.0 && normal.dot(key.towards) > 0.0;
    let ray = (lights.casts_shadows() && is_facing).then(|| {
        let towards = if id.sample == 0 { key.towards } else { lights.towards(&key, point) };
        context.ray_to(orientation.lifted, orientation.geometric, towards, key.distance)
    });
    (key, ray)
}

/// The rays of a surface into its hemisphere, in samples after the first.
pub(super) fn sky_rays(
    context: &TraceContext,
    position: Vec3,
    orientation: &Orientation,
    id: SampleId,
) -> impl Iterator<Item = Ray> {
    around(context, position, orientation, f32::INFINITY, BOUNCES as u32, id)
}

impl Shade for Lit {
    type Point = LitPoint;

    /// In samples after the first, a ray to what blocks the sky.
    fn prepare(&self, sample: &Sample<'_>, hit: &Hit, rays: &mut Vec<Ray>) -> LitPoint {
        let &Sample { context, ray, id, .. } = sample;
        let scene = context.scene;
        let material = scene.material(hit.primitive_index);
        let base_color = surface::base_color(scene, material, hit);
        let mut point = LitPoint {
            emitted: surface::emitted(scene, material, hit),
            is_unlit: material.unlit,
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
        let towards_viewer = (point.normal, -ray.direction);
        (point.key, point.key_ray) = key_light(context, &self.lights, &orientation, towards_viewer, id);
        // The first sample stays noise-free and fast.
        if id.sample > 0 {
            rays.extend(sky_rays(context, position, &orientation, id));
            point.bounce_count = BOUNCES;
            let closed = 1.0 - self.mean_openness.element_sum() / 3.0;
            point.mean_weight = MAX_MEAN_WEIGHT * (closed * closed).clamp(0.0, 1.0);
        }
        point
    }

    /// The shadow ray to the key light, then that of each surface that blocks the sky.
    fn occlusion_rays(
        &self,
        sample: &Sample<'_>,
        _hit: &Hit,
        point: &mut LitPoint,
        bounces: (&[Ray], &[Option<Hit>]),
        rays: &mut Vec<Ray>,
    ) {
        rays.extend(point.key_ray);
        for ((bounce, ray), hit) in point.bounces.iter_mut().zip(bounces.0).zip(bounces.1) {
            *bounce = self.bounce(sample.context, ray, *hit, rays);
        }
    }

    fn hit(&self, sample: &Sample<'_>, _hit: &Hit, point: &LitPoint) -> Shaded {
        if point.is_unlit {
            return Shaded::color(point.emitted);
        }
        let LitPoint { reflectance, normal, key, .. } = *point;
        let view = -sample.ray.direction;
        let (sees_key, ambient) = point.resolve(sample.blocked, self.mean_openness);
        let mirrored = reflectance.mirrored(normal.dot(view));
        // Surfaces that block the sky block its reflection as well.
        let openness = ambient / point.sky;
        let direction = (normal * (2.0 * normal.dot(view)) - view).normalize_or(normal);
        let mut radiance = reflectance.diffuse * (1.0 - mirrored.max_element()) * ambient
            + mirrored * self.lights.mirrored_sky(direction, reflectance.roughness()) * openness;
        if sees_key || !self.lights.casts_shadows() {
            radiance += reflectance.direct(normal, view, key.towards) * key.light;
        }
        Shaded::radiance(radiance + point.emitted)
    }

    fn occlusion_rays_of_miss(&self, sample: &Sample<'_>, rays: &mut Vec<Ray>) {
        if let Some(ground) = &self.ground {
            ground.shadow_rays(sample.context, &self.lights, sample.ray, sample.id, rays);
        }
    }

    fn miss(&self, sample: &Sample<'_>, background: Vec3) -> Shaded {
        let light = self
            .ground
            .as_ref()
            .map_or(1.0, |ground| ground.light(&self.lights, sample.ray, sample.context.diagonal, sample.blocked));
        Shaded::color(background * light)
    }
}
