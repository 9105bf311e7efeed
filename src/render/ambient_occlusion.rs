//! Ambient occlusion: the fraction of cosine-distributed rays from a surface point that hit nothing nearby.

use glam::Vec3;

use super::sampling::{SampleId, cosine_direction};
use super::surface::Orientation;
use super::trace_context::TraceContext;
use bvhscope_engine::geometry::Ray;

/// Length of occlusion rays as a fraction of the scene's diagonal.
pub(super) const RADIUS: f32 = 0.25;

/// Occlusion rays per sample in the ambient occlusion mode.
pub(super) const RAYS: u32 = 4;

/// Occlusion rays of length `radius` from a surface point. The directions continue the pixel's low-discrepancy sequence from
/// sample to sample, so that accumulated samples cover the hemisphere evenly.
pub(super) fn around(
    context: &TraceContext,
    position: Vec3,
    orientation: &Orientation,
    radius: f32,
    rays: u32,
    id: SampleId,
) -> impl Iterator<Item = Ray> {
    (0..rays).map(move |index| {
        let mut direction = cosine_direction(orientation.smooth, id.point(id.sample * rays + index));
        // Around a smooth normal some directions point into the flat triangle: mirror them.
        let below = direction.dot(orientation.geometric);
        if below < 0.0 {
            direction -= orientation.geometric * (2.0 * below);
        }
        context.ray_from(position, orientation.geometric, direction, radius)
    })
}

/// Fraction of unblocked rays, 0 to 1.
pub(super) fn openness(blocked: &[bool]) -> f32 {
    let open = blocked.iter().filter(|&&blocked| !blocked).count();
    open as f32 / blocked.len() as f32
}
