//! From a hit to a colour: one shader a mode, chosen once for a whole picture.

use glam::Vec3;

use super::ambient_occlusion::{self, around, openness};
use super::sampling::SampleId;
use super::settings::HeatKind;
use super::trace_context::TraceContext;
use super::{srgb, surface};
use bvhscope_engine::geometry::{Hit, Ray};
use bvhscope_engine::tree::Container;
use bvhscope_engine::tree::traverse::TestCounts;

/// What a sample gives to its pixel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shaded {
    /// Linear RGB; unused where the mode colours its values.
    pub(super) color: Vec3,
    /// The number that the colour stands for, in modes that have one.
    pub(super) value: f32,
}

impl Shaded {
    fn color(color: Vec3) -> Self {
        Self { color, value: 0.0 }
    }
}

/// A shading mode.
pub(super) trait Shade<C: Container>: Sync {
    /// Whether tests are counted while the primary rays are traced.
    const COUNTS: bool = false;

    /// Where tests are counted, whether in the wide tree instead of the binary one.
    fn counts_steps(&self) -> bool {
        false
    }

    /// Adds the rays to `rays` of which [`Shade::hit`] wants to know whether something
    /// blocks them.
    fn occlusion_rays(&self, _context: &TraceContext<C>, _ray: &Ray, _hit: &Hit, _id: SampleId, _rays: &mut Vec<Ray>) {}

    /// The sample of a ray that hit something. `blocked` are the answers to [`Shade::occlusion_rays`].
    fn hit(&self, context: &TraceContext<C>, ray: &Ray, hit: &Hit, tests: TestCounts, blocked: &[bool]) -> Shaded;

    /// The sample of a ray that hit nothing; `background` is what lies there.
    fn miss(&self, background: Vec3, _tests: TestCounts) -> Shaded {
        Shaded::color(background)
    }
}

/// The surface's direction in world space as a colour: x, y, z from -1..1 to red, green, blue.
pub(super) struct Normals;

impl<C: Container> Shade<C> for Normals {
    fn hit(&self, context: &TraceContext<C>, ray: &Ray, hit: &Hit, _tests: TestCounts, _blocked: &[bool]) -> Shaded {
        let normal = surface::orientation(context.scene, ray, hit).smooth;
        // The usual colours of normal maps are sRGB numbers.
        Shaded::color((normal * 0.5 + 0.5).map(srgb::decode))
    }
}

/// TraceContext depth as a value.
pub(super) struct Depth;

impl<C: Container> Shade<C> for Depth {
    fn hit(&self, context: &TraceContext<C>, ray: &Ray, hit: &Hit, _tests: TestCounts, _blocked: &[bool]) -> Shaded {
        Shaded { color: Vec3::ZERO, value: context.camera.view_depth(ray, hit.t) }
    }

    fn miss(&self, _background: Vec3, _tests: TestCounts) -> Shaded {
        Shaded { color: Vec3::ZERO, value: super::frame::Frame::NO_HIT }
    }
}

/// How open the surface is, as a grey.
pub(super) struct AmbientOcclusion;

impl<C: Container> Shade<C> for AmbientOcclusion {
    fn occlusion_rays(&self, context: &TraceContext<C>, ray: &Ray, hit: &Hit, id: SampleId, rays: &mut Vec<Ray>) {
        let position = surface::position(context.scene, hit);
        let orientation = surface::orientation(context.scene, ray, hit);
        let radius = context.diagonal * ambient_occlusion::RADIUS;
        rays.extend(around(context, position, &orientation, radius, ambient_occlusion::RAYS, id));
    }

    fn hit(&self, _context: &TraceContext<C>, _ray: &Ray, _hit: &Hit, _tests: TestCounts, blocked: &[bool]) -> Shaded {
        let open = openness(blocked);
        // An sRGB number: half open looks half bright.
        Shaded::color(Vec3::splat(srgb::decode(0.05 + 0.9 * open)))
    }
}

/// Tests of the pixel's ray as a value.
pub(super) struct Heat(pub(super) HeatKind);

impl Heat {
    fn value(&self, tests: TestCounts) -> Shaded {
        let value = match self.0 {
            HeatKind::Containers => tests.containers,
            HeatKind::Primitives => tests.primitives,
            HeatKind::Both | HeatKind::Steps => tests.containers + tests.primitives,
        };
        Shaded { color: Vec3::ZERO, value: value as f32 }
    }
}

impl<C: Container> Shade<C> for Heat {
    const COUNTS: bool = true;

    fn counts_steps(&self) -> bool {
        self.0 == HeatKind::Steps
    }

    fn hit(&self, _context: &TraceContext<C>, _ray: &Ray, _hit: &Hit, tests: TestCounts, _blocked: &[bool]) -> Shaded {
        self.value(tests)
    }

    fn miss(&self, _background: Vec3, tests: TestCounts) -> Shaded {
        self.value(tests)
    }
}
