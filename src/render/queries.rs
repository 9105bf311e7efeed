//! Pictures of queries beside the nearest hit: how thick the model is along each ray, by all hits; how far each point of the section
//! plane is from the surface, by the closest point; and the tests that they cost in the binary tree.

use glam::Vec3;

use super::crossings::Crossings;
use super::frame::Frame;
use super::request::RenderRequest;
use super::shade::{Sample, Shade, Shaded};
use super::trace_context::TraceContext;
use crate::section::SectionPlane;
use bvhscope_engine::geometry::{Aabb, Hit, Ray};
use bvhscope_engine::tree::traverse::TestCounts;

/// Most hits of a ray whose thicknesses are summed.
const MOST_HITS: usize = 1 << 16;
/// Number of lines of equal distance over half of the scene's diagonal, at least.
const FEWEST_LINES: f32 = 10.0;
/// Width of such a line in pixels.
const LINE_WIDTH: f32 = 1.2;
/// Margin of the plane around the scene as a fraction of its diagonal.
const MARGIN: f32 = 0.15;

/// Sum of the thicknesses of a closed model along the whole ray in world units.
pub(super) struct Thickness;

impl Shade for Thickness {
    type Point = ();

    fn hit(&self, sample: &Sample<'_>, _hit: &Hit, _point: &()) -> Shaded {
        let mut hits = Vec::new();
        let has_more = sample.context.all_hits(sample.ray, MOST_HITS, &mut hits);
        let triangle = |hit| sample.context.scene.triangle(hit);
        Shaded::value(Crossings::new(&hits, has_more, sample.ray.direction, triangle).thickness())
    }

    fn miss(&self, _sample: &Sample<'_>, _background: Vec3) -> Shaded {
        Shaded::value(Frame::NO_HIT)
    }
}

/// A value of the pixel's ray that does not depend on whether it hits anything.
pub(super) struct OfRay<'a>(pub(super) &'a (dyn Fn(&Sample<'_>) -> Shaded + Sync));

impl Shade for OfRay<'_> {
    type Point = ();

    fn hit(&self, sample: &Sample<'_>, _hit: &Hit, _point: &()) -> Shaded {
        (self.0)(sample)
    }

    fn miss(&self, sample: &Sample<'_>, _background: Vec3) -> Shaded {
        (self.0)(sample)
    }
}

/// Tests of a query for all hits of the ray.
pub(super) fn all_hits_tests(sample: &Sample<'_>) -> Shaded {
    tests(sample.context.all_hits_tests(sample.ray))
}

fn tests(TestCounts { containers, primitives }: TestCounts) -> Shaded {
    Shaded::value((containers + primitives) as f32)
}

/// The plane whose points closest points are looked for: the section plane, without one that across the middle of the scene which faces
/// the camera.
pub(super) struct QueriedPlane {
    plane: SectionPlane,
    /// Only points in it are queried.
    around: Aabb,
    /// Distance between two lines of equal distance in world units.
    spacing: f32,
}

impl QueriedPlane {
    pub(super) fn new(context: &TraceContext<'_>, request: &RenderRequest) -> Self {
        let bounds = context.scene.bounds;
        let across = || SectionPlane::through(&bounds, -request.camera.forward());
        let margin = Vec3::splat(context.diagonal * MARGIN);
        Self {
            plane: request.settings.section.unwrap_or_else(across),
            around: Aabb { min: bounds.min - margin, max: bounds.max + margin },
            spacing: line_spacing(context.diagonal),
        }
    }

    /// The point of the plane that the ray of a sample meets.
    fn point(&self, ray: &Ray) -> Option<Vec3> {
        let t = (self.plane.offset - self.plane.normal.dot(ray.origin)) / self.plane.normal.dot(ray.direction);
        let point = ray.at(t);
        (t > 0.0 && point.cmpge(self.around.min).all() && point.cmple(self.around.max).all()).then_some(point)
    }

    /// Distance of the point from the surface in world units, whatever is hidden or cut off, with lines of equal distance.
    pub(super) fn surface_distance(&self, Sample { context, ray, .. }: &Sample<'_>) -> Shaded {
        let near = self.point(ray).and_then(|point| Some((point, context.distance_to_surface(point)?)));
        let Some((point, distance)) = near else { return Shaded::value(Frame::NO_HIT) };
        let pixel = context.camera.pixel_size(context.camera.view_depth(ray, ray.direction.dot(point - ray.origin)));
        let from_line = (distance / self.spacing - (distance / self.spacing).round()).abs() * self.spacing;
        let ink = (LINE_WIDTH - from_line / pixel.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        // Values are coloured afterwards: until then the unused colour stores the line's coverage.
        Shaded { color: Vec3::splat(ink), ..Shaded::value(distance) }
    }

    /// Tests of a query for the closest point of the surface.
    pub(super) fn closest_point_tests(&self, Sample { context, ray, .. }: &Sample<'_>) -> Shaded {
        let count = |point| context.closest_point_tests(point);
        tests(self.point(ray).map_or_else(TestCounts::default, count))
    }
}

/// Distance between two lines of equal distance in a scene of this diagonal: 1, 2 or 5 times a power of ten.
pub(super) fn line_spacing(diagonal: f32) -> f32 {
    let most = diagonal * 0.5 / FEWEST_LINES;
    let power = 10.0_f32.powf(most.max(f32::MIN_POSITIVE).log10().floor());
    [5.0, 2.0].into_iter().map(|digit| digit * power).find(|spacing| *spacing <= most).unwrap_or(power)
}
