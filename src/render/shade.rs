//! Shading modes: from a hit to a colour or value. The mode is chosen once per picture.

use glam::Vec3;

use super::ambient_occlusion::{self, around, openness};
use super::sampling::SampleId;
use super::settings::HeatKind;
use super::trace_context::TraceContext;
use super::{srgb, surface};
use crate::accel::tracer::Counting;
use bvhscope_engine::geometry::{Hit, Ray};
use bvhscope_engine::tree::traverse::TestCounts;

/// The contribution of a sample to its pixel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shaded {
    /// Linear RGB; unused in modes that colour their values afterwards.
    pub(super) color: Vec3,
    /// True if the colour is radiance, to be exposed and tone mapped, rather than a display colour.
    pub(super) is_radiance: bool,
    /// The value that the colour encodes, in modes that have one.
    pub(super) value: f32,
}

impl Shaded {
    /// A colour that is shown as it is.
    pub(super) const fn color(color: Vec3) -> Self {
        Self { color, is_radiance: false, value: 0.0 }
    }

    /// Linear radiance.
    pub(super) const fn radiance(color: Vec3) -> Self {
        Self { color, is_radiance: true, value: 0.0 }
    }

    /// A value that is coloured afterwards.
    const fn value(value: f32) -> Self {
        Self { color: Vec3::ZERO, is_radiance: false, value }
    }
}

/// A shading mode.
pub(super) trait Shade: Sync {
    /// True if the mode counts tests while tracing primary rays.
    const COUNTS: bool = false;

    /// Kind of count, if [`Shade::COUNTS`].
    fn counting(&self) -> Counting {
        Counting::Tests
    }

    /// Values computed for a hit before its other rays are traced.
    type Point: Copy + Default;

    /// Works out what the other methods need, and appends to `rays` those whose closest hits [`Shade::occlusion_rays`] needs.
    fn prepare(
        &self,
        _context: &TraceContext,
        _ray: &Ray,
        _hit: &Hit,
        _id: SampleId,
        _rays: &mut Vec<Ray>,
    ) -> Self::Point {
        Self::Point::default()
    }

    /// Appends the occlusion rays of a hit to `rays`. `bounces` are the rays of [`Shade::prepare`], and their closest hits.
    fn occlusion_rays(
        &self,
        _context: &TraceContext,
        _ray: &Ray,
        _hit: &Hit,
        _point: &mut Self::Point,
        _bounces: (&[Ray], &[Option<Hit>]),
        _rays: &mut Vec<Ray>,
    ) {
    }

    /// The sample of a ray that hit a surface. `blocked` has one element per ray of [`Shade::occlusion_rays`].
    fn hit(
        &self,
        context: &TraceContext,
        ray: &Ray,
        hit: &Hit,
        point: &Self::Point,
        tests: TestCounts,
        blocked: &[bool],
    ) -> Shaded;

    /// Appends the occlusion rays that [`Shade::miss`] needs to `rays`.
    fn occlusion_rays_of_miss(&self, _context: &TraceContext, _ray: &Ray, _id: SampleId, _rays: &mut Vec<Ray>) {}

    /// The sample of a ray that hit nothing; `background` is the linear background colour. `blocked` has one element per ray of
    /// [`Shade::occlusion_rays_of_miss`].
    fn miss(
        &self,
        _context: &TraceContext,
        _ray: &Ray,
        background: Vec3,
        _tests: TestCounts,
        _blocked: &[bool],
    ) -> Shaded {
        Shaded::color(background)
    }
}

/// The surface normal in world space as a colour: x, y, z from -1..1 to red, green, blue.
pub(super) struct Normals;

impl Shade for Normals {
    type Point = ();

    fn hit(
        &self,
        context: &TraceContext,
        ray: &Ray,
        hit: &Hit,
        _point: &(),
        _tests: TestCounts,
        _blocked: &[bool],
    ) -> Shaded {
        let normal = context.orientation(ray, hit).smooth;
        // Normal maps usually hold sRGB-encoded numbers.
        Shaded::color((normal * 0.5 + 0.5).map(srgb::decode))
    }
}

/// View depth as a value.
pub(super) struct Depth;

impl Shade for Depth {
    type Point = ();

    fn hit(
        &self,
        context: &TraceContext,
        ray: &Ray,
        hit: &Hit,
        _point: &(),
        _tests: TestCounts,
        _blocked: &[bool],
    ) -> Shaded {
        Shaded::value(context.camera.view_depth(ray, hit.t))
    }

    fn miss(
        &self,
        _context: &TraceContext,
        _ray: &Ray,
        _background: Vec3,
        _tests: TestCounts,
        _blocked: &[bool],
    ) -> Shaded {
        Shaded::value(super::frame::Frame::NO_HIT)
    }
}

/// Ambient occlusion as a grey.
pub(super) struct AmbientOcclusion;

impl Shade for AmbientOcclusion {
    type Point = SampleId;

    fn prepare(&self, _context: &TraceContext, _ray: &Ray, _hit: &Hit, id: SampleId, _rays: &mut Vec<Ray>) -> SampleId {
        id
    }

    fn occlusion_rays(
        &self,
        context: &TraceContext,
        ray: &Ray,
        hit: &Hit,
        id: &mut SampleId,
        _bounces: (&[Ray], &[Option<Hit>]),
        rays: &mut Vec<Ray>,
    ) {
        let position = surface::position(context.scene, hit);
        let orientation = context.orientation(ray, hit);
        let radius = context.diagonal * ambient_occlusion::RADIUS;
        rays.extend(around(context, position, &orientation, radius, ambient_occlusion::RAYS, *id));
    }

    fn hit(
        &self,
        _context: &TraceContext,
        _ray: &Ray,
        _hit: &Hit,
        _point: &SampleId,
        _tests: TestCounts,
        blocked: &[bool],
    ) -> Shaded {
        let open = openness(blocked);
        // Encoded as sRGB, so that half open looks half bright.
        Shaded::color(Vec3::splat(srgb::decode(0.05 + 0.9 * open)))
    }
}

/// Number of tests of the pixel's ray as a value.
pub(super) struct Heat(pub(super) HeatKind);

impl Heat {
    fn value(&self, tests: TestCounts) -> Shaded {
        let value = match self.0 {
            HeatKind::Containers | HeatKind::WholeRay => tests.containers,
            HeatKind::Primitives => tests.primitives,
            HeatKind::Both | HeatKind::Steps | HeatKind::Lines => tests.containers + tests.primitives,
        };
        Shaded::value(value as f32)
    }
}

impl Shade for Heat {
    type Point = ();

    const COUNTS: bool = true;

    fn counting(&self) -> Counting {
        match self.0 {
            HeatKind::Containers | HeatKind::Primitives | HeatKind::Both => Counting::Tests,
            HeatKind::Steps => Counting::Steps,
            HeatKind::Lines => Counting::Lines,
            HeatKind::WholeRay => Counting::WholeRay,
        }
    }

    fn hit(
        &self,
        _context: &TraceContext,
        _ray: &Ray,
        _hit: &Hit,
        _point: &(),
        tests: TestCounts,
        _blocked: &[bool],
    ) -> Shaded {
        self.value(tests)
    }

    fn miss(
        &self,
        _context: &TraceContext,
        _ray: &Ray,
        _background: Vec3,
        tests: TestCounts,
        _blocked: &[bool],
    ) -> Shaded {
        self.value(tests)
    }
}
