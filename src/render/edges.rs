//! Triangle edges drawn over the surface as lines of constant width in pixels.

use glam::Vec3;

use bvhscope_engine::geometry::{Hit, Ray, Triangle};

/// Half the line width in pixels; the neighbouring triangle draws the other half.
const HALF_WIDTH_PX: f32 = 0.5;
/// Fraction of the surface's light that a line absorbs.
const DARKNESS: f32 = 0.82;
/// Opacity of a line over a colour that encodes a value.
const STRENGTH: f32 = 0.6;
/// Triangle heights in pixels between which lines fade in, so that the edges of a fine mesh do not turn it black.
const FADE_PX: [f32; 2] = [2.0, 7.0];

/// Coverage of a hit by an edge line, 0 to 1. `pixel` is the size of a pixel at the hit in world units.
pub(super) fn ink(triangle: &Triangle, ray: &Ray, hit: &Hit, pixel: f32) -> f32 {
    let corners = [triangle.a, triangle.b, triangle.c];
    let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
    let (mut nearest, mut height) = (f32::INFINITY, f32::INFINITY);
    for (opposite, weight) in weights.into_iter().enumerate() {
        let (from, to) = (corners[(opposite + 1) % 3], corners[(opposite + 2) % 3]);
        // Distance between the edge and a line along the ray: the separation on screen, however the triangle is tilted.
        let across = ray.direction.cross(to - from);
        let over_edge = (from - corners[opposite]).dot(across).abs() / across.length() / pixel;
        if over_edge.is_finite() {
            // The barycentric weight of the opposite corner is the hit's relative distance from the edge.
            nearest = nearest.min(over_edge * weight.max(0.0));
            height = height.min(over_edge);
        }
    }
    let coverage = (HALF_WIDTH_PX + 0.5 - nearest).clamp(0.0, 1.0);
    let fade = ((height - FADE_PX[0]) / (FADE_PX[1] - FADE_PX[0])).clamp(0.0, 1.0);
    coverage * fade
}

/// The linear surface colour `color` darkened by a line with coverage `ink`.
pub(super) fn over_surface(color: Vec3, ink: f32) -> Vec3 {
    color * (1.0 - DARKNESS * ink)
}

/// An sRGB colour-map colour with a line of coverage `ink` over it: dark over light colours, light over dark ones.
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

    /// A ray from `eye` to the point with these barycentric weights of the second and third corner.
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
        // At a slant of one to ten, five pixels apart on the surface are half a pixel apart on screen.
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
