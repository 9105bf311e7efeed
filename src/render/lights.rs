//! The lights of lit shading: a sky, and a sun or a headlight. One unit of light gives a white diffuse surface that faces it
//! radiance 1.

use glam::{Vec2, Vec3};

use super::settings::Light;

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
#[derive(Debug, Clone, Copy)]
pub(super) struct Lights {
    key: Light,
    up: Vec3,
    /// Unit direction towards the sun.
    sun: Vec3,
}

impl Lights {
    /// The lights of a scene with up axis `up`.
    pub(super) fn new(key: Light, up: Vec3) -> Self {
        // From the default camera the sun is high in front and to the left.
        let side = if up.y.abs() > 0.5 { Vec3::Z } else { Vec3::NEG_Y };
        let right = up.cross(side).normalize_or(Vec3::X);
        Self { key, up, sun: (up * 1.0 + side * 0.55 - right * 0.45).normalize() }
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

    /// The sun's direction, where the sun is the key light.
    pub(super) fn sun(&self) -> Option<Vec3> {
        (self.key == Light::Sun).then_some(self.sun)
    }

    /// A direction to a point of the sun's disc; `point` lies in the unit square.
    pub(super) fn towards_sun(&self, point: Vec2) -> Vec3 {
        let (sin, cos) = (point.x * std::f32::consts::TAU).sin_cos();
        let radius = SUN_RADIUS * point.y.sqrt();
        let (tangent, bitangent) = self.sun.any_orthonormal_pair();
        (self.sun + tangent * (radius * cos) + bitangent * (radius * sin)).normalize()
    }

    /// Direction and light of the key light at a surface that is seen from `view`.
    pub(super) fn key(&self, view: Vec3) -> (Vec3, Vec3) {
        match self.key {
            Light::Headlight => (view, HEADLIGHT),
            Light::Sun => (self.sun, SUN),
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
            assert_eq!(lights.sun(), Some(lights.sun));
            let edge = lights.towards_sun(Vec2::new(0.3, 1.0));
            assert!((edge.angle_between(lights.sun) - SUN_RADIUS).abs() < 1e-3);
        }
        assert_eq!(Lights::new(Light::Headlight, Vec3::Y).sun(), None);
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
}
