//! Lit shading: sky light, a key light, and contact shadows in samples after the first.

use glam::Vec3;

use super::ambient_occlusion::{around, openness};
use super::sampling::SampleId;
use super::settings::Light;
use super::shade::{Shade, Shaded};
use super::surface::{self, Orientation};
use super::trace_context::TraceContext;
use bvhscope_engine::geometry::{Hit, Ray};
use bvhscope_engine::tree::Container;
use bvhscope_engine::tree::traverse::TestCounts;

/// Linear sky light from straight above and below, interpolated in between.
const SKY: Vec3 = Vec3::new(0.50, 0.55, 0.62);
const GROUND: Vec3 = Vec3::new(0.26, 0.23, 0.20);
/// Linear irradiance of the sun on a surface that faces it.
const SUN: Vec3 = Vec3::new(1.25, 1.17, 1.02);
/// Linear irradiance of the headlight on a surface that faces the camera.
const HEADLIGHT: Vec3 = Vec3::new(0.85, 0.84, 0.82);
/// Length of contact-shadow rays as a fraction of the scene's diagonal.
const CONTACT_RADIUS: f32 = 0.08;
/// Fraction of sky light in a fully occluded corner: stands in for indirect light.
const BOUNCE: f32 = 0.3;
/// Tone mapping is the identity below this value and rolls off towards white above.
const SHOULDER: f32 = 0.6;

/// Lit shading with materials and textures.
pub(super) struct Lit {
    light: Light,
    up: Vec3,
    /// Unit direction towards the sun.
    sun: Vec3,
}

impl Lit {
    /// The lights of a scene with up axis `up`.
    pub(super) fn new(light: Light, up: Vec3) -> Self {
        // From the default camera the sun is high in front and to the left.
        let side = if up.y.abs() > 0.5 { Vec3::Z } else { Vec3::NEG_Y };
        let right = up.cross(side).normalize_or(Vec3::X);
        Self { light, up, sun: (up * 1.0 + side * 0.55 - right * 0.45).normalize() }
    }
}

impl Lit {
    /// Whether a surface faces the sun. The flat normal must face it too, or self-shadowing would show the triangles of smooth
    /// surfaces.
    fn faces_sun(&self, orientation: &Orientation) -> bool {
        orientation.smooth.dot(self.sun) > 0.0 && orientation.geometric.dot(self.sun) > 0.0
    }
}

impl<C: Container> Shade<C> for Lit {
    /// A contact-shadow ray, then a shadow ray to the sun.
    fn occlusion_rays(&self, context: &TraceContext<C>, ray: &Ray, hit: &Hit, id: SampleId, rays: &mut Vec<Ray>) {
        // The first sample stays noise-free and fast; each further one adds a contact-shadow ray.
        let contact = id.sample > 0;
        if !contact && self.light == Light::Headlight || context.scene.material(hit.primitive_index).unlit {
            return;
        }
        let orientation = surface::orientation(context.scene, ray, hit);
        let position = surface::position(context.scene, hit);
        if contact {
            rays.extend(around(context, position, &orientation, context.diagonal * CONTACT_RADIUS, 1, id));
        }
        if self.light == Light::Sun && self.faces_sun(&orientation) {
            rays.push(context.ray_from(position, orientation.geometric, self.sun, f32::INFINITY));
        }
    }

    fn hit(&self, context: &TraceContext<C>, ray: &Ray, hit: &Hit, _tests: TestCounts, blocked: &[bool]) -> Shaded {
        let scene = context.scene;
        let material = scene.material(hit.primitive_index);
        let base_color = surface::base_color(scene, material, hit);
        if material.unlit {
            return Shaded { color: base_color + material.emissive, value: 0.0 };
        }
        let orientation = surface::orientation(scene, ray, hit);
        let normal = orientation.smooth;

        let mut sky = GROUND.lerp(SKY, 0.5 + 0.5 * normal.dot(self.up));
        let faces_sun = self.light == Light::Sun && self.faces_sun(&orientation);
        let (contact, sun) = blocked.split_at(blocked.len() - usize::from(faces_sun));
        if !contact.is_empty() {
            sky *= BOUNCE + (1.0 - BOUNCE) * openness(contact);
        }
        let key = match self.light {
            Light::Headlight => HEADLIGHT * normal.dot(-ray.direction).max(0.0),
            Light::Sun => {
                if sun == [false] {
                    SUN * normal.dot(self.sun)
                } else {
                    Vec3::ZERO
                }
            }
        };
        Shaded { color: tone_map(base_color * (sky + key) + material.emissive), value: 0.0 }
    }
}

/// Identity up to `SHOULDER`, then an exponential roll-off below 1.
fn tone_map(color: Vec3) -> Vec3 {
    color.map(|x| if x <= SHOULDER { x } else { 1.0 - (1.0 - SHOULDER) * ((SHOULDER - x) / (1.0 - SHOULDER)).exp() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tone_mapping_keeps_mid_greys_order_and_range() {
        assert_eq!(tone_map(Vec3::new(0.0, 0.18, 0.5)), Vec3::new(0.0, 0.18, 0.5));
        let steps: Vec<f32> = (0..100).map(|i| tone_map(Vec3::splat(i as f32 * 0.03)).x).collect();
        assert!(steps.windows(2).all(|pair| pair[0] < pair[1] && pair[1] < 1.0));
        assert!(tone_map(Vec3::NAN).x.is_nan());
    }

    #[test]
    fn the_sun_stands_above_in_every_up_axis() {
        for up in [Vec3::Y, Vec3::Z, Vec3::X] {
            assert!(Lit::new(Light::Sun, up).sun.dot(up) > 0.5);
        }
    }
}
