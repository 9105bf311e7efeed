//! All hits of a ray, as if no surface ended it: where it enters and leaves, how thick what it passes through is, and whether it begins
//! inside.

use bvhscope_engine::geometry::{Hit, Triangle};
use glam::Vec3;

/// Hits whose distances differ by less, relative to the distance, and which face the same way are of one surface: a ray through an edge
/// hits the triangles on both of its sides.
const SAME_DISTANCE: f32 = 4.0 * f32::EPSILON;

/// A triangle that a ray hits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Distance along the ray.
    pub t: f32,
    /// The triangle.
    pub triangle: u32,
    /// The ray meets its front, the side from which its corners turn counter-clockwise.
    pub is_front: bool,
    /// Number of surfaces that the ray has passed through after it.
    pub surfaces: u32,
    /// Of every second surface the distance from the one before: how thick a closed model is there, for a ray that begins outside.
    pub thickness: Option<f32>,
}

/// All hits of a ray, the nearest first.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Crossings {
    /// The hits.
    pub hits: Vec<Crossing>,
    /// There are more, farther away.
    pub has_more: bool,
}

impl Crossings {
    /// The crossings of a ray towards `direction` at `hits`, sorted by distance, with the triangles that `triangle` has.
    pub fn new(hits: &[Hit], has_more: bool, direction: Vec3, triangle: impl Fn(u32) -> Triangle) -> Self {
        let mut crossings: Vec<Crossing> = Vec::with_capacity(hits.len());
        // Distance of the last surface.
        let mut entered = 0.0;
        for &Hit { t, primitive_index, .. } in hits {
            let is_front = triangle(primitive_index).scaled_normal().dot(direction) < 0.0;
            let last = crossings.last().map(|last| (last.t, last.is_front, last.surfaces));
            let is_same = last.is_some_and(|(last, front, _)| is_front == front && t - last <= SAME_DISTANCE * t.abs());
            let surfaces = last.map_or(0, |(.., surfaces)| surfaces) + u32::from(!is_same);
            let thickness = (!is_same && surfaces.is_multiple_of(2)).then_some(t - entered);
            if !is_same {
                entered = t;
            }
            crossings.push(Crossing { t, triangle: primitive_index, is_front, surfaces, thickness });
        }
        Self { hits: crossings, has_more }
    }

    /// Number of surfaces that the ray passes through.
    pub fn surfaces(&self) -> u32 {
        self.hits.last().map_or(0, |last| last.surfaces)
    }

    /// Sum of the thicknesses.
    pub fn thickness(&self) -> f32 {
        // The standard library's sum of no numbers is -0.
        self.hits.iter().filter_map(|hit| hit.thickness).fold(0.0, |sum, thickness| sum + thickness)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hit(t: f32, primitive_index: u32) -> Hit {
        Hit { t, primitive_index, u: 0.25, v: 0.25 }
    }

    #[test]
    fn both_triangles_of_an_edge_are_one_surface_and_thickness_is_that_of_pairs() {
        let front = Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y };
        let back = Triangle { a: Vec3::ZERO, b: Vec3::Y, c: Vec3::X };
        // Two walls; the ray meets an edge of the first at its front.
        let triangles = [front, front, back, front, back];
        let hits = [hit(1.0, 0), hit(1.0, 1), hit(3.0, 2), hit(5.0, 3), hit(5.5, 4)];
        let crossings = Crossings::new(&hits, false, Vec3::NEG_Z, |hit| triangles[hit as usize]);
        let of = |hit: &Crossing| (hit.is_front, hit.surfaces, hit.thickness);
        let found: Vec<_> = crossings.hits.iter().map(of).collect();
        let expected =
            [(true, 1, None), (true, 1, None), (false, 2, Some(2.0)), (true, 3, None), (false, 4, Some(0.5))];
        assert_eq!(found, expected);
        assert_eq!((crossings.surfaces(), crossings.thickness()), (4, 2.5));
        // Two walls that touch are two surfaces, because they face opposite ways.
        let touching = Crossings::new(&[hit(1.0, 2), hit(1.0, 0)], false, Vec3::NEG_Z, |hit| triangles[hit as usize]);
        assert_eq!((touching.surfaces(), touching.thickness()), (2, 0.0));
        let none = Crossings::default();
        assert!(none.surfaces() == 0 && none.thickness().to_bits() == 0, "not -0, which a legend would show");
    }
}
