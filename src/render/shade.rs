//! Shading modes: from a hit to a colour or value. The mode is chosen once per picture.

use glam::Vec3;

use super::ambient_occlusion::{self, around, openness};
use super::sampling::SampleId;
use super::settings::HeatKind;
use super::surface;
use super::trace_context::TraceContext;
use crate::accel::tracer::Counting;
use crate::colors::srgb;
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
    pub(super) const fn value(value: f32) -> Self {
        Self { color: Vec3::ZERO, is_radiance: false, value }
    }
}

/// A primary ray to shade, with what was traced for it.
pub(super) struct Sample<'a> {
    pub(super) context: &'a TraceContext<'a>,
    pub(super) ray: &'a Ray,
    pub(super) id: SampleId,
    /// Tests of the ray, if [`Shade::COUNTS`].
    pub(super) tests: TestCounts,
    /// The fates of the sample's occlusion rays; empty until they are traced.
    pub(super) blocked: &'a [bool],
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
    fn prepare(&self, _sample: &Sample<'_>, _hit: &Hit, _rays: &mut Vec<Ray>) -> Self::Point {
        Self::Point::default()
    }

    /// Appends the occlusion rays of a hit to `rays`. `bounces` are the rays of [`Shade::prepare`], and their closest hits.
    fn occlusion_rays(
        &self,
        _sample: &Sample<'_>,
        _hit: &Hit,
        _point: &mut Self::Point,
        _bounces: (&[Ray], &[Option<Hit>]),
        _rays: &mut Vec<Ray>,
    ) {
    }

    /// The colour of a ray that hit a surface.
    fn hit(&self, sample: &Sample<'_>, hit: &Hit, point: &Self::Point) -> Shaded;

    /// Appends the occlusion rays that [`Shade::miss`] needs to `rays`.
    fn occlusion_rays_of_miss(&self, _sample: &Sample<'_>, _rays: &mut Vec<Ray>) {}

    /// The colour of a ray that hit nothing; `background` is the linear background colour.
    fn miss(&self, _sample: &Sample<'_>, background: Vec3) -> Shaded {
        Shaded::color(background)
    }
}

/// The surface normal in world space as a colour: x, y, z from -1..1 to red, green, blue.
pub(super) struct Normals;

impl Shade for Normals {
    type Point = ();

    fn hit(&self, sample: &Sample<'_>, hit: &Hit, _point: &()) -> Shaded {
        let normal = sample.context.orientation(sample.ray, hit).smooth;
        // Normal maps usually hold sRGB-encoded numbers.
        Shaded::color((normal * 0.5 + 0.5).map(srgb::decode))
    }
}

/// View depth as a value.
pub(super) struct Depth;

impl Shade for Depth {
    type Point = ();

    fn hit(&self, sample: &Sample<'_>, hit: &Hit, _point: &()) -> Shaded {
        Shaded::value(sample.context.camera.view_depth(sample.ray, hit.t))
    }

    fn miss(&self, _sample: &Sample<'_>, _background: Vec3) -> Shaded {
        Shaded::value(super::frame::Frame::NO_HIT)
    }
}

/// Ambient occlusion as a grey.
pub(super) struct AmbientOcclusion;

impl Shade for AmbientOcclusion {
    type Point = ();

    fn occlusion_rays(
        &self,
        Sample { context, ray, id, .. }: &Sample<'_>,
        hit: &Hit,
        (): &mut (),
        _bounces: (&[Ray], &[Option<Hit>]),
        rays: &mut Vec<Ray>,
    ) {
        let position = surface::position(context.scene, hit);
        let orientation = context.orientation(ray, hit);
        let radius = context.diagonal * ambient_occlusion::RADIUS;
        rays.extend(around(context, position, &orientation, radius, ambient_occlusion::RAYS, *id));
    }

    fn hit(&self, sample: &Sample<'_>, _hit: &Hit, _point: &()) -> Shaded {
        let open = openness(sample.blocked);
        // Encoded as sRGB, so that half open looks half bright.
        Shaded::color(Vec3::splat(srgb::decode(0.05 + 0.9 * open)))
    }
}

/// Number of tests of the pixel's ray as a value.
pub(super) struct Heat(pub(super) HeatKind);

impl Heat {
    fn value(&self, tests: TestCounts) -> Shaded {
        let value = match self.0 {
            HeatKind::Containers | HeatKind::WholeRay | HeatKind::Copies => tests.containers,
            HeatKind::Primitives => tests.primitives,
            _ => tests.total(),
        };
        Shaded::value(value as f32)
    }
}

impl Shade for Heat {
    type Point = ();

    const COUNTS: bool = true;

    fn counting(&self) -> Counting {
        match self.0 {
            HeatKind::Steps => Counting::Steps,
            HeatKind::Lines => Counting::Lines,
            HeatKind::WholeRay => Counting::WholeRay,
            HeatKind::Copies => Counting::Copies,
            _ => Counting::Tests,
        }
    }

    fn hit(&self, sample: &Sample<'_>, _hit: &Hit, _point: &()) -> Shaded {
        self.value(sample.tests)
    }

    fn miss(&self, sample: &Sample<'_>, _background: Vec3) -> Shaded {
        self.value(sample.tests)
    }
}
