//! How open a surface is to its surroundings: the share of cosine-distributed rays that meet nothing nearby.

use glam::Vec3;

use super::sampling::{SampleId, cosine_direction};
use super::surface::Orientation;
use super::trace_context::TraceContext;
use bvhscope_engine::geometry::Ray;
use bvhscope_engine::tree::Container;

/// What is farther away than this share of the scene's diagonal takes no light away.
pub(super) const RADIUS: f32 = 0.25;

/// Rays a sample of the ambient occlusion mode.
pub(super) const RAYS: u32 = 4;

/// So many rays from a surface point, `radius` long. The directions continue the pixel's sequence from sample to sample, so
/// that many samples cover the hemisphere evenly.
pub(super) fn around<C: Container>(
    context: &TraceContext<C>,
    position: Vec3,
    orientation: &Orientation,
    radius: f32,
    rays: u32,
    id: SampleId,
) -> impl Iterator<Item = Ray> {
    (0..rays).map(move |index| {
        let mut direction = cosine_direction(orientation.smooth, id.point(id.sample * rays + index));
        // A smooth normal leans over the flat triangle's edge: mirror what would start inside.
        let below = direction.dot(orientation.geometric);
        if below < 0.0 {
            direction -= orientation.geometric * (2.0 * below);
        }
        context.ray_from(position, orientation.geometric, direction, radius)
    })
}

/// Share of rays that nothing blocks, 0 to 1.
pub(super) fn openness(blocked: &[bool]) -> f32 {
    let open = blocked.iter().filter(|&&blocked| !blocked).count();
    open as f32 / blocked.len() as f32
}
