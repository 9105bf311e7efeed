//! Boxes of the parts of a triangle on both sides of a plane, for the builders that split references.

use glam::DVec3;

use crate::geometry::{Aabb, Triangle};

/// Distance by which a part extends beyond the plane that it was split at, relative to the largest coordinate, so that
/// rays near the plane cannot pass between both sides.
const OVERLAP: f64 = 4.0 * f32::EPSILON as f64;

/// Distance by which parts of the triangles in `bounds` extend beyond their planes.
pub fn overlap_within(bounds: &Aabb) -> f64 {
    f64::from(bounds.min.abs().max(bounds.max.abs()).max_element()) * OVERLAP
}

/// Boxes of the parts of `triangle` within `bounds` below and above `position` along `axis`, extended by `overlap`; empty where
/// there is no part.
pub fn halves(triangle: &Triangle, bounds: &Aabb, axis: usize, position: impl Into<f64>, overlap: f64) -> [Aabb; 2] {
    let position = position.into();
    let corners = [triangle.a, triangle.b, triangle.c].map(glam::Vec3::as_dvec3);
    // Rounding errors are covered by the outward padding below.
    let mut sides = [[DVec3::INFINITY, DVec3::NEG_INFINITY]; 2];
    let mut add = |side: usize, point: DVec3| {
        sides[side] = [sides[side][0].min(point), sides[side][1].max(point)];
    };
    for (from, to) in [(0, 1), (1, 2), (2, 0)] {
        let (from, to) = (corners[from], corners[to]);
        if from[axis] <= position {
            add(0, from);
        }
        if from[axis] >= position {
            add(1, from);
        }
        if (from[axis] - position) * (to[axis] - position) < 0.0 {
            let mut cut = from + (to - from) * ((position - from[axis]) / (to[axis] - from[axis]));
            cut[axis] = position;
            add(0, cut);
            add(1, cut);
        }
    }
    sides.map(|[min, max]| {
        let outer = Aabb { min: (min - overlap).as_vec3(), max: (max + overlap).as_vec3() };
        outer.intersection(bounds)
    })
}
