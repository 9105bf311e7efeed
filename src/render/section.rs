//! How a cut model looks: a plain hatch where the section plane cuts through solid matter.

use glam::Vec3;
use rayon::prelude::*;

use crate::scene::Scene;
use crate::section::SectionPlane;

/// Linear colours of the hatch: its ground and its lines.
const HATCH: [Vec3; 2] = [Vec3::new(0.155, 0.165, 0.19), Vec3::new(0.06, 0.065, 0.08)];
/// Distance of two lines of the hatch as a fraction of the scene's diagonal, and the width of a line as a fraction of that.
const SPACING: f32 = 1.0 / 70.0;
const LINE_SHARE: f32 = 0.3;

/// The section plane of a picture.
pub(super) struct Section {
    pub(super) plane: SectionPlane,
    /// 1 where the triangles of the scene face outwards on the whole, -1 where they face inwards.
    pub(super) outward: f32,
    /// Unit vectors along the plane.
    along: [Vec3; 2],
}

impl Section {
    pub(super) fn new(plane: SectionPlane, scene: &Scene) -> Self {
        let center = scene.bounds.center();
        // Six times the enclosed volume, which is negative where triangles face inwards.
        let volume = |triangle: &bvhscope_engine::geometry::Triangle| {
            let [a, b, c] = [triangle.a, triangle.b, triangle.c].map(|corner| (corner - center).as_dvec3());
            a.dot(b.cross(c))
        };
        // Summed in chunks of a fixed size, so that the sum does not depend on the number of threads.
        let parts: Vec<f64> = scene.triangles.par_chunks(1 << 14).map(|part| part.iter().map(volume).sum()).collect();
        let (u, v) = plane.normal.any_orthonormal_pair();
        Self { plane, outward: if parts.iter().sum::<f64>() < 0.0 { -1.0 } else { 1.0 }, along: [u, v] }
    }

    /// Linear colour of the hatch at a point of the plane.
    pub(super) fn hatch(&self, point: Vec3, diagonal: f32) -> Vec3 {
        let [u, v] = self.along.map(|axis| point.dot(axis));
        let place = ((u + v) * std::f32::consts::FRAC_1_SQRT_2 / (diagonal * SPACING)).rem_euclid(1.0);
        HATCH[usize::from(place < LINE_SHARE)]
    }
}
