//! The lights of lit shading: a sky, and a sun, a headlight or the lights of the file. One unit of light gives a white diffuse surface
//! that faces it radiance 1.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::settings::Light;
use crate::scene::{FileLight, Scene};

/// Linear sky light on surfaces that face straight up and down, interpolated in between.
const SKY: Vec3 = Vec3::new(0.50, 0.55, 0.62);
const GROUND: Vec3 = Vec3::new(0.26, 0.23, 0.20);
/// Linear light of the sun on a surface that faces it.
const SUN: Vec3 = Vec3::new(1.25, 1.17, 1.02);
/// Linear light of the headlight on a surface that faces the camera.
const HEADLIGHT: Vec3 = Vec3::new(0.85, 0.84, 0.82);
/// Tangent of the sun's angular radius: about twice the true one, so that shadows are soft at a distance.
const SUN_RADIUS: f32 = 0.012;

/// The lights of a picture.
#[derive(Debug, Clone)]
pub(super) struct Lights {
    key: Light,
    up: Vec3,
    /// Unit direction towards the sun.
    sun: Vec3,
    /// The lights in place of the sun; empty for others.
    of_file: Arc<[FileLight]>,
}

/// The key light as it arrives at a point.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct KeyLight {
    /// Unit direction to it.
    pub(super) towards: Vec3,
    /// Distance, up to which it can be blocked.
    pub(super) distance: f32,
    /// Linear light on a surface that faces it.
    pub(super) light: Vec3,
}

impl Lights {
    /// The lights of pictures of `scene`.
    pub(super) fn of_scene(key: Light, scene: &Scene) -> Self {
        let of_file = if key == Light::File { Arc::clone(&scene.lights) } else { Arc::new([]) };
        Self { of_file, ..Self::new(key, scene.up) }
    }

    /// The lights of a scene with up axis `up`, which has none of its own.
    pub(super) fn new(key: Light, up: Vec3) -> Self {
        // From the default camera the sun is high in front and to the left.
        let side = if up.y.abs() > 0.5 { Vec3::Z } else { Vec3::NEG_Y };
        let right = up.cross(side).normalize_or(Vec3::X);
        let sun = (up * 1.0 + side * 0.55 - right * 0.45).normalize();
        Self { key, up, sun, of_file: Arc::new([]) }
    }

    /// Light of the whole sky on an open surface with this normal.
    pub(super) fn sky(&self, normal: Vec3) -> Vec3 {
        GROUND.lerp(SKY, 0.5 + 0.5 * normal.dot(self.up))
    }

    /// Light of the sky around `direction`, over a cone that widens with the roughness of the surface that mirrors it: a
    /// horizon that is sharp in a smooth metal, and [`Lights::sky`] itself in the roughest.
    pub(super) fn mirrored_sky(&self, direction: Vec3, roughness: f32) -> Vec3 {
        let height = direction.dot(self.up);
        let half_width = 0.06 + 0.94 * roughness;
        let above = (0.5 + 0.5 * height / half_width).clamp(0.0, 1.0);
        // The surroundings that smooth surfaces mirror are brighter overhead, and darkest just below the horizon.
        let zenith = 1.0 + (1.0 - roughness) * 0.9 * height.max(0.0);
        GROUND.lerp(SKY * zenith, above)
    }

    /// Whether the key light can be blocked.
    pub(super) fn casts_shadows(&self) -> bool {
        self.key != Light::Headlight
    }

    /// The direction of a shadow ray to the key light: to a point of the sun's disc, which `point` in the unit square chooses.
    pub(super) fn towards(&self, key: &KeyLight, point: Vec2) -> Vec3 {
        if self.of_file.is_empty() { self.towards_sun(point) } else { key.towards }
    }

    /// A direction to a point of the sun's disc; `point` lies in the unit square.
    fn towards_sun(&self, point: Vec2) -> Vec3 {
        let (sin, cos) = (point.x * std::f32::consts::TAU).sin_cos();
        let radius = SUN_RADIUS * point.y.sqrt();
        let (tangent, bitangent) = self.sun.any_orthonormal_pair();
        (self.sun + tangent * (radius * cos) + bitangent * (radius * sin)).normalize()
    }

    /// The key light at a surface with this position and normal that is seen from `view`. Of several lights of the file one stands
    /// for all: `pick`, 0 to 1, chooses it by the light that it gives without shadows; without it, it is the strongest.
    pub(super) fn key(&self, position: Vec3, normal: Vec3, view: Vec3, pick: Option<f32>) -> KeyLight {
        let far = |towards, light| KeyLight { towards, distance: f32::INFINITY, light };
        if self.key == Light::Headlight {
            return far(view, HEADLIGHT);
        }
        if self.of_file.is_empty() {
            return far(self.sun, SUN);
        }
        let arriving = |light: &FileLight| {
            let (towards, distance, light) = light.at(position);
            (KeyLight { towards, distance, light }, light.max_element() * normal.dot(towards).max(0.0))
        };
        let all = || self.of_file.iter().map(arriving);
        let total: f32 = all().map(|(_, strength)| strength).sum();
        let chosen = match pick {
            None => all().max_by(|a, b| a.1.total_cmp(&b.1)),
            Some(pick) => {
                let mut left = pick * total;
                all().filter(|(_, strength)| *strength > 0.0).find(|(_, strength)| {
                    left -= strength;
                    left <= 0.0
                })
            }
        };
        match chosen {
            Some((key, strength)) if strength > 0.0 => KeyLight { light: key.light * (total / strength), ..key },
            // Nothing arrives.
            _ => far(normal, Vec3::ZERO),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sun_stands_above_in_every_up_axis() {
        for up in [Vec3::Y, Vec3::Z, Vec3::X] {
            let lights = Lights::new(Light::Sun, up);
            assert!(lights.sun.dot(up) > 0.5);
            assert!(lights.casts_shadows());
            let edge = lights.towards_sun(Vec2::new(0.3, 1.0));
            assert!((edge.angle_between(lights.sun) - SUN_RADIUS).abs() < 1e-3);
        }
        assert!(!Lights::new(Light::Headlight, Vec3::Y).casts_shadows());
    }

    #[test]
    fn rough_surfaces_mirror_the_whole_sky_and_smooth_ones_a_horizon() {
        let lights = Lights::new(Light::Sun, Vec3::Y);
        for direction in [Vec3::Y, Vec3::NEG_Y, Vec3::X, Vec3::new(0.6, 0.8, 0.0)] {
            let difference = lights.mirrored_sky(direction, 1.0) - lights.sky(direction);
            assert!(difference.abs().max_element() < 1e-6, "{direction}");
        }
        let near = |y: f32| lights.mirrored_sky(Vec3::new(1.0, y, 0.0).normalize(), 0.1).y;
        assert!(near(0.2) > near(-0.2) * 2.0);
    }

    #[test]
    fn one_light_of_the_file_stands_for_all() {
        let light = |x: f32, strength: f32| FileLight {
            name: String::new(),
            color: Vec3::splat(strength),
            direction: Vec3::NEG_Y,
            position: Some(Vec3::new(x, 1.0, 0.0)),
            cone: None,
            range: f32::INFINITY,
            reach: 1.0,
        };
        let sun = Lights::new(Light::File, Vec3::Y);
        assert_eq!(sun.key(Vec3::ZERO, Vec3::Y, Vec3::Y, None).light, SUN);
        let lights = Lights { of_file: vec![light(0.0, 1.0), light(100.0, 1e4), light(0.0, 3.0)].into(), ..sun };
        let key = |normal: Vec3, pick: Option<f32>| lights.key(Vec3::ZERO, normal, Vec3::Y, pick);
        let strongest = key(Vec3::Y, None);
        assert_eq!((strongest.towards, strongest.distance), (Vec3::Y, 1.0));
        // All of them together, as the mean over any picks is.
        let total = 4.0 + 1.0 * 0.01;
        let picks = 4000;
        let mean: f32 = (0..picks)
            .map(|k| key(Vec3::Y, Some((k as f32 + 0.5) / picks as f32)))
            .map(|key| key.light.x * key.towards.y)
            .sum::<f32>()
            / picks as f32;
        assert!((mean - total).abs() < 0.02 && (strongest.light.x - total).abs() < 0.02, "{mean}, {strongest:?}");
        assert_eq!(key(Vec3::NEG_Y, None).light, Vec3::ZERO);
        assert_eq!(key(Vec3::NEG_Y, Some(0.3)).light, Vec3::ZERO);
    }
}
