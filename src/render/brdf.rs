//! Reflection of light at a surface: a diffuse base under a microfacet coat, as in glTF 2.0 (appendix B).

use std::f32::consts::PI;

use glam::Vec3;

/// Least roughness: smoother surfaces would reflect the sun in less than a pixel.
const MIN_ROUGHNESS: f32 = 0.08;
/// Largest reflected multiple of the light, so that single samples of highlights do not stay visible.
const MAX_HIGHLIGHT: f32 = 24.0;

/// How a surface point reflects.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Reflectance {
    /// Linear RGB that is scattered: nothing of a metal.
    pub(super) diffuse: Vec3,
    /// Linear RGB reflectance at normal incidence.
    pub(super) f0: Vec3,
    /// Perceptual roughness, [`MIN_ROUGHNESS`] to 1.
    roughness: f32,
}

impl Reflectance {
    /// The reflectance of a material: `dielectric` is its reflectance at normal incidence as far as it is no metal.
    pub(super) fn new(base_color: Vec3, metallic: f32, roughness: f32, dielectric: Vec3) -> Self {
        Self {
            diffuse: base_color * (1.0 - metallic),
            f0: dielectric.lerp(base_color, metallic),
            roughness: roughness.clamp(MIN_ROUGHNESS, 1.0),
        }
    }

    /// Perceptual roughness.
    pub(super) const fn roughness(&self) -> f32 {
        self.roughness
    }

    /// Radiance towards `view` for each unit of light from `light` on a surface that faces it. Units are those of the lights:
    /// a white diffuse surface that faces a light of 1 has radiance 1.
    pub(super) fn direct(&self, normal: Vec3, view: Vec3, light: Vec3) -> Vec3 {
        let n_dot_l = normal.dot(light);
        if n_dot_l <= 0.0 {
            return Vec3::ZERO;
        }
        let n_dot_v = normal.dot(view).max(1e-3);
        let half = (view + light).normalize_or(normal);
        let (n_dot_h, v_dot_h) = (normal.dot(half).clamp(0.0, 1.0), view.dot(half).clamp(0.0, 1.0));
        let alpha = self.roughness * self.roughness;
        let fresnel = schlick(self.f0, v_dot_h);
        let highlight = (PI * ggx(alpha, n_dot_h) * smith(alpha, n_dot_l, n_dot_v)).min(MAX_HIGHLIGHT);
        (self.diffuse * (Vec3::ONE - fresnel) + fresnel * highlight) * n_dot_l
    }

    /// Fraction of light from everywhere that is mirrored towards a viewer at cosine `n_dot_v`: the split-sum term of Karis
    /// (*Real Shading in Unreal Engine 4*, 2013) in his analytic fit (*Physically Based Shading on Mobile*, 2014).
    pub(super) fn mirrored(&self, n_dot_v: f32) -> Vec3 {
        let r = self.roughness;
        let [x, y, z, w] = [1.0 - r, 0.0425 - 0.0275 * r, 1.04 - 0.572 * r, 0.022 * r - 0.04];
        let a = (x * x).min((-9.28 * n_dot_v.clamp(0.0, 1.0)).exp2()) * x + y;
        (self.f0 * (z - 1.04 * a) + (w + 1.04 * a)).max(Vec3::ZERO)
    }
}

/// Normal distribution of Trowbridge and Reitz (1975), known as GGX (Walter et al., *Microfacet Models for Refraction through
/// Rough Surfaces*, 2007).
fn ggx(alpha: f32, n_dot_h: f32) -> f32 {
    let square = alpha * alpha;
    let denominator = n_dot_h * n_dot_h * (square - 1.0) + 1.0;
    square / (PI * denominator * denominator)
}

/// Height-correlated masking and shadowing over 4 (n·l)(n·v) (Heitz, *Understanding the Masking-Shadowing Function*, 2014).
fn smith(alpha: f32, n_dot_l: f32, n_dot_v: f32) -> f32 {
    let square = alpha * alpha;
    let towards = |near: f32, far: f32| near * (far * far * (1.0 - square) + square).sqrt();
    0.5 / (towards(n_dot_l, n_dot_v) + towards(n_dot_v, n_dot_l)).max(1e-6)
}

/// Fresnel reflectance (Schlick, *An Inexpensive BRDF Model for Physically-Based Rendering*, 1994).
fn schlick(f0: Vec3, v_dot_h: f32) -> Vec3 {
    f0 + (Vec3::ONE - f0) * (1.0 - v_dot_h).powi(5)
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: Vec3 = Vec3::Z;

    fn towards(degrees: f32) -> Vec3 {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Vec3::new(sin, 0.0, cos)
    }

    #[test]
    fn a_rough_surface_seen_straight_reflects_as_worked_out() {
        // α = 1: D = 1/π, V = 0.5 / 2, F = 0.04, so that 0.01 is added to 96 % of the base colour.
        let clay = Reflectance::new(Vec3::new(0.5, 0.25, 0.0), 0.0, 1.0, Vec3::splat(0.04));
        let found = clay.direct(N, N, N);
        assert!((found - Vec3::new(0.49, 0.25, 0.01)).abs().max_element() < 1e-6, "{found}");
        // A metal scatters nothing: D V π F with F = base colour.
        let metal = Reflectance::new(Vec3::new(0.8, 0.4, 0.2), 1.0, 1.0, Vec3::splat(0.04));
        let found = metal.direct(N, N, N);
        assert!((found - Vec3::new(0.2, 0.1, 0.05)).abs().max_element() < 1e-6, "{found}");
        assert_eq!(metal.direct(N, N, towards(91.0)), Vec3::ZERO);
    }

    #[test]
    fn no_surface_reflects_more_light_than_it_receives() {
        for roughness in [0.3, 0.6, 1.0] {
            for degrees in [0.0, 40.0, 80.0] {
                let white = Reflectance::new(Vec3::ONE, 1.0, roughness, Vec3::ZERO);
                let (view, steps) = (towards(degrees), 200);
                // The hemisphere of lights in equal cells of cos² θ and φ.
                let mut sum = 0.0;
                for a in 0..steps {
                    for b in 0..steps {
                        let square = (a as f32 + 0.5) / steps as f32;
                        let phi = (b as f32 + 0.5) / steps as f32 * std::f32::consts::TAU;
                        let (radius, z) = ((1.0 - square).sqrt(), square.sqrt());
                        let light = Vec3::new(radius * phi.cos(), radius * phi.sin(), z);
                        sum += white.direct(N, view, light).x / z;
                    }
                }
                let reflected = sum / (steps * steps) as f32;
                assert!((0.3..1.02).contains(&reflected), "roughness {roughness}, {degrees}°: {reflected}");
                let split = white.mirrored(degrees.to_radians().cos()).x;
                assert!((0.3..1.02).contains(&split), "roughness {roughness}, {degrees}°: {split}");
            }
        }
    }

    #[test]
    fn highlights_narrow_with_smoothness_and_stand_in_the_mirror_direction() {
        let [smooth, rough] = [0.2, 0.7].map(|r| Reflectance::new(Vec3::splat(0.5), 0.0, r, Vec3::splat(0.04)));
        let at = |surface: &Reflectance, degrees| surface.direct(N, towards(-30.0), towards(degrees)).x;
        assert!(at(&smooth, 30.0) > at(&rough, 30.0) + 0.5);
        assert!(at(&smooth, 60.0) < at(&smooth, 30.0) * 0.5);
    }
}
