//! Pictures of queries beside the nearest hit: how thick the model is along each ray, by all hits; how far each point of the section
//! plane is from the surface, by the closest point; and the tests that they cost in the binary tree.

use glam::Vec3;

use super::crossings::Crossings;
use super::frame::Frame;
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
        let triangles = &sample.context.scene.triangles;
        Shaded::value(Crossings::new(&hits, has_more, sample.ray.direction, triangles).thickness())
    }

    fn miss(&self, _sample: &Sample<'_>, _background: Vec3) -> Shaded {
        Shaded::value(Frame::NO_HIT)
    }
}

/// Tests of a query for all hits of the ray.
pub(super) struct AllHitsTests;

impl AllHitsTests {
    fn of(sample: &Sample<'_>) -> Shaded {
        tests(sample.context.all_hits_tests(sample.ray))
    }
}

impl Shade for AllHitsTests {
    type Point = ();

    fn hit(&self, sample: &Sample<'_>, _hit: &Hit, _point: &()) -> Shaded {
        Self::of(sample)
    }

    fn miss(&self, sample: &Sample<'_>, _background: Vec3) -> Shaded {
        Self::of(sample)
    }
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
    pub(super) fn new(context: &TraceContext<'_>, section: Option<SectionPlane>, towards_camera: Vec3) -> Self {
        let bounds = context.scene.bounds;
        let margin = Vec3::splat(context.diagonal * MARGIN);
        Self {
            plane: section.unwrap_or_else(|| SectionPlane::through(&bounds, towards_camera)),
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
}

/// Distance between two lines of equal distance in a scene of this diagonal: 1, 2 or 5 times a power of ten.
pub(super) fn line_spacing(diagonal: f32) -> f32 {
    let most = diagonal * 0.5 / FEWEST_LINES;
    let power = 10.0_f32.powf(most.max(f32::MIN_POSITIVE).log10().floor());
    [5.0, 2.0].into_iter().map(|digit| digit * power).find(|spacing| *spacing <= most).unwrap_or(power)
}

/// Distance of the plane's points from the surface in world units, whatever is hidden or cut off, with lines of equal distance.
pub(super) struct SurfaceDistance(pub(super) QueriedPlane);

impl SurfaceDistance {
    fn of(&self, sample: &Sample<'_>) -> Shaded {
        let Some(point) = self.0.point(sample.ray) else { return Shaded::value(Frame::NO_HIT) };
        let Some(distance) = sample.context.distance_to_surface(point) else { return Shaded::value(Frame::NO_HIT) };
        let depth = sample.context.camera.view_depth(sample.ray, sample.ray.direction.dot(point - sample.ray.origin));
        let pixel = sample.context.camera.pixel_size(depth);
        let from_line = (distance / self.0.spacing - (distance / self.0.spacing).round()).abs() * self.0.spacing;
        let ink = (LINE_WIDTH - from_line / pixel.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        // Values are coloured afterwards: until then the unused colour stores the line's coverage.
        Shaded { color: Vec3::splat(ink), ..Shaded::value(distance) }
    }
}

impl Shade for SurfaceDistance {
    type Point = ();

    fn hit(&self, sample: &Sample<'_>, _hit: &Hit, _point: &()) -> Shaded {
        self.of(sample)
    }

    fn miss(&self, sample: &Sample<'_>, _background: Vec3) -> Shaded {
        self.of(sample)
    }
}

/// Tests of a query for the closest point of each of the plane's points.
pub(super) struct ClosestPointTests(pub(super) QueriedPlane);

impl ClosestPointTests {
    fn of(&self, sample: &Sample<'_>) -> Shaded {
        let count = |point| sample.context.closest_point_tests(point);
        tests(self.0.point(sample.ray).map_or_else(TestCounts::default, count))
    }
}

impl Shade for ClosestPointTests {
    type Point = ();

    fn hit(&self, sample: &Sample<'_>, _hit: &Hit, _point: &()) -> Shaded {
        self.of(sample)
    }

    fn miss(&self, sample: &Sample<'_>, _background: Vec3) -> Shaded {
        self.of(sample)
    }
}
