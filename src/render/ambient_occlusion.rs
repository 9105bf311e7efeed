//! How open a surface is to its surroundings: the share of cosine-distributed rays that meet nothing nearby.

use glam::Vec3;

use super::sampling::{SampleId, cosine_direction};
use super::surface::Orientation;
use super::view::View;
use crate::bvh::Container;

/// What is farther away than this share of the scene's diagonal takes no light away.
pub(super) const RADIUS: f32 = 0.25;

/// Rays a sample of the ambient occlusion mode.
pub(super) const RAYS: u32 = 4;

/// Share of `rays` rays from a surface point that get `radius` far, 0 to 1. The directions continue the pixel's sequence
/// from sample to sample, so that many samples cover the hemisphere evenly.
pub(super) fn openness<C: Container>(
    view: &View<C>,
    position: Vec3,
    orientation: &Orientation,
    radius: f32,
    rays: u32,
    id: SampleId,
) -> f32 {
    let mut open = 0;
    for index in 0..rays {
        let mut direction = cosine_direction(orientation.smooth, id.point(id.sample * rays + index));
        // A smooth normal leans over the flat triangle's edge: mirror what would start inside.
        let below = direction.dot(orientation.geometric);
        if below < 0.0 {
            direction -= orientation.geometric * (2.0 * below);
        }
        open += u32::from(!view.is_blocked(&view.ray_from(position, orientation.geometric, direction, radius)));
    }
    open as f32 / rays as f32
}
