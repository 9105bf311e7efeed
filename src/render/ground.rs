//! A ground that is not there: it shows the background, darkened where the model keeps light from it.

use glam::Vec3;

use super::ambient_occlusion::{around, openness};
use super::lights::Lights;
use super::sampling::SampleId;
use super::surface::Orientation;
use super::trace_context::TraceContext;
use crate::vectors::length;
use bvhscope_engine::geometry::{Aabb, Ray};

/// Distances from the model's centre, in diagonals of its bounding box, between which its shadow fades out.
const FADE: [f32; 2] = [2.0, 3.0];
/// Rays into the sky per sample after the first.
const RAYS: u32 = 2;

/// The plane through the lowest point of the model.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ground {
    up: Vec3,
    /// Coordinate of the plane along `up`.
    height: f32,
    center: Vec3,
}

impl Ground {
    /// The ground below `bounds`; `up` is a unit axis.
    pub(super) fn new(bounds: &Aabb, up: Vec3) -> Self {
        Self { up, height: bounds.min.dot(up).min(bounds.max.dot(up)), center: (bounds.min + bounds.max) * 0.5 }
    }

    /// Where a ray that comes from above meets the ground, and how much of a shadow is seen there, 0 to 1; `None` if it does not
    /// or only far from the model.
    fn meet(&self, ray: &Ray, diagonal: f32) -> Option<(Vec3, f32)> {
        let (above, falling) = (ray.origin.dot(self.up) - self.height, -ray.direction.dot(self.up));
        if above <= 0.0 || falling <= 1e-6 {
            return None;
        }
        let position = ray.origin + ray.direction * (above / falling);
        let away = length(position - self.center) / diagonal;
        let weight = ((FADE[1] - away) / (FADE[1] - FADE[0])).clamp(0.0, 1.0);
        (weight > 0.0).then_some((position, weight))
    }

    /// Appends the shadow rays of a ray that hit nothing: one to the key light, if that can be blocked, then in samples after the first
    /// some into the sky.
    pub(super) fn shadow_rays(
        &self,
        context: &TraceContext,
        lights: &Lights,
        ray: &Ray,
        id: SampleId,
        rays: &mut Vec<Ray>,
    ) {
        let Some((position, _)) = self.meet(ray, context.diagonal) else { return };
        if lights.casts_shadows() {
            let key = lights.key(position, self.up, self.up, None);
            let towards = if id.sample == 0 { key.towards } else { lights.towards(&key, id.light_point()) };
            rays.push(context.ray_to(position, self.up, towards, key.distance));
        }
        if id.sample > 0 {
            let flat = Orientation::flat(self.up, position);
            rays.extend(around(context, position, &flat, f32::INFINITY, RAYS, id));
        }
    }

    /// Fraction of the light that arrives where a ray meets the ground, by the answers of its shadow rays.
    pub(super) fn light(&self, lights: &Lights, ray: &Ray, diagonal: f32, blocked: &[bool]) -> f32 {
        let Some((position, weight)) = self.meet(ray, diagonal) else { return 1.0 };
        let grey = |light: Vec3| light.element_sum() / 3.0;
        let sky = grey(lights.sky(self.up));
        let key = lights.key(position, self.up, self.up, None);
        let has_sun = lights.casts_shadows();
        let sun = if has_sun { grey(key.light) * key.towards.dot(self.up).max(0.0) } else { 0.0 };
        let (to_sun, to_sky) = blocked.split_at(usize::from(has_sun).min(blocked.len()));
        let open = if to_sky.is_empty() { 1.0 } else { openness(to_sky) };
        let seen = if to_sun == [true] { 0.0 } else { sun };
        let light = (sky * open + seen) / (sky + sun);
        1.0 - weight * (1.0 - light)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::settings::Light;

    #[test]
    fn only_rays_from_above_near_the_model_meet_the_ground() {
        let bounds = Aabb { min: Vec3::new(-1.0, 2.0, -1.0), max: Vec3::new(1.0, 4.0, 1.0) };
        let ground = Ground::new(&bounds, Vec3::Y);
        let diagonal = 12.0_f32.sqrt();
        let down = Ray::new(Vec3::new(0.0, 10.0, 0.0), Vec3::NEG_Y);
        assert_eq!(ground.meet(&down, diagonal), Some((Vec3::new(0.0, 2.0, 0.0), 1.0)));
        for ray in [
            Ray::new(Vec3::new(0.0, 1.0, 0.0), Vec3::Y),
            Ray::new(Vec3::new(0.0, 1.0, 0.0), Vec3::NEG_Y),
            Ray::new(Vec3::new(0.0, 10.0, 0.0), Vec3::X),
            Ray::new(Vec3::new(500.0, 10.0, 0.0), Vec3::NEG_Y),
        ] {
            assert_eq!(ground.meet(&ray, diagonal), None, "{ray:?}");
        }
        // z up: the least coordinate along it.
        assert_eq!(Ground::new(&bounds, Vec3::Z).height, -1.0);
        let lights = Lights::new(Light::Sun, Vec3::Y);
        let light = |blocked: &[bool]| ground.light(&lights, &down, diagonal, blocked);
        assert_eq!((light(&[false]), light(&[false, false, false])), (1.0, 1.0));
        assert!(light(&[true]) < 0.5 && light(&[true, true, true]) < 0.01 && light(&[false, true, false]) < 1.0);
    }
}
