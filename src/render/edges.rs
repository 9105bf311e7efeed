//! The triangles' edges over their surface, as lines of constant width in pixels.

use glam::Vec3;

use bvhscope_engine::geometry::{Hit, Ray, Triangle};

/// Half the width of a line in pixels; the other half is on the neighbouring triangle.
const HALF_WIDTH_PX: f32 = 0.5;
/// What a line takes of the surface's light.
const DARKNESS: f32 = 0.82;
/// How much of a line is seen over a colour that stands for a number.
const STRENGTH: f32 = 0.6;
/// Triangles lower than the first height in pixels have no lines, those higher than the second have them in full: between
/// them the lines of a fine mesh fade instead of making it black.
const FADE_PX: [f32; 2] = [2.0, 7.0];

/// How much of a line lies at a hit, 0 between the lines to 1. `pixel` is the size of a pixel at the hit, in world units.
pub(super) fn ink(triangle: &Triangle, ray: &Ray, hit: &Hit, pixel: f32) -> f32 {
    let corners = [triangle.a, triangle.b, triangle.c];
    let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
    let (mut nearest, mut height) = (f32::INFINITY, f32::INFINITY);
    for (opposite, weight) in weights.into_iter().enumerate() {
        let (from, to) = (corners[(opposite + 1) % 3], corners[(opposite + 2) % 3]);
        // Between the edge's line and one along the ray: as far as the eye sees them apart, however the triangle is tilted.
        let across = ray.direction.cross(to - from);
        let over_edge = (from - corners[opposite]).dot(across).abs() / across.length() / pixel;
        if over_edge.is_finite() {
            // The hit is as far from the edge as its weight of the corner opposite says.
            nearest = nearest.min(over_edge * weight.max(0.0));
            height = height.min(over_edge);
        }
    }
    let coverage = (HALF_WIDTH_PX + 0.5 - nearest).clamp(0.0, 1.0);
    let fade = ((height - FADE_PX[0]) / (FADE_PX[1] - FADE_PX[0])).clamp(0.0, 1.0);
    coverage * fade
}

/// A surface of linear colour `color` with so much of a line over it: darker.
pub(super) fn over_surface(color: Vec3, ink: f32) -> Vec3 {
    color * (1.0 - DARKNESS * ink)
}

/// An sRGB colour of a colour map with so much of a line over it: dark over light colours, light over dark ones.
pub(super) fn over_value([r, g, b, a]: [u8; 4], ink: f32) -> [u8; 4] {
    let luma = 0.3 * f32::from(r) + 0.59 * f32::from(g) + 0.11 * f32::from(b);
    let line = if luma > 110.0 { 0.0 } else { 255.0 };
    let mix = |channel: u8| {
        let channel = f32::from(channel);
        (channel + (line - channel) * STRENGTH * ink).round() as u8
    };
    [mix(r), mix(g), mix(b), a]
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: Triangle = Triangle { a: Vec3::ZERO, b: Vec3::new(10.0, 0.0, 0.0), c: Vec3::new(0.0, 10.0, 0.0) };

    /// A look from `eye` at the point with these weights of the second and third corner.
    fn seen(eye: Vec3, u: f32, v: f32, pixel: f32) -> f32 {
        let at = Vec3::new(10.0 * u, 10.0 * v, 0.0);
        let ray = Ray::new(eye, (at - eye).normalize());
        ink(&TRIANGLE, &ray, &Hit { t: at.distance(eye), primitive_index: 0, u, v }, pixel)
    }

    #[test]
    fn edges_have_lines_and_the_rest_has_none() {
        let above = Vec3::new(3.0, 3.0, 50.0);
        for [u, v] in [[0.5, 0.0], [0.0, 0.5], [0.5, 0.5]] {
            assert!(seen(above, u, v, 0.1) > 0.95, "{u} {v}");
        }
        assert_eq!(seen(above, 0.3, 0.3, 0.1), 0.0);
    }

    #[test]
    fn lines_are_as_wide_at_any_size_and_tilt() {
        let above = Vec3::new(3.0, 0.0, 1000.0);
        for pixel in [0.01, 0.1] {
            assert!(seen(above, 0.3, 0.04 * pixel, pixel) > 0.5, "within half a pixel");
            assert_eq!(seen(above, 0.3, 0.11 * pixel, pixel), 0.0, "beyond a pixel");
        }
        // Seen at a slant of one to ten, what is five pixels apart looks half a pixel apart.
        let slanted = Vec3::new(3.0, -1000.0, 100.0);
        assert!(seen(slanted, 0.3, 0.05, 0.1) > 0.3);
        assert_eq!(seen(slanted, 0.3, 0.2, 0.1), 0.0);
    }

    #[test]
    fn a_fine_mesh_is_not_blackened() {
        assert_eq!(seen(Vec3::new(3.0, 3.0, 50.0), 0.5, 0.0, 5.0), 0.0);
    }

    #[test]
    fn lines_stand_out_from_every_colour_of_a_map() {
        for grey in [0, 60, 109, 111, 180, 255] {
            let [lined, ..] = over_value([grey, grey, grey, 255], 1.0);
            assert!(lined.abs_diff(grey) >= 60, "{grey} became {lined}");
        }
        assert_eq!(over_value([1, 2, 3, 255], 0.0), [1, 2, 3, 255]);
    }
}
