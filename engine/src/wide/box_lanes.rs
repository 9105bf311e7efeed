//! Eight boxes side by side, and what it means to test a ray against eight containers.

use bytemuck::{Pod, Zeroable};
use fearless_simd::Simd;

use crate::wide::layout::WIDTH;

/// A ray that is tested against the eight containers of `B`.
pub trait LaneTest<S: Simd, B> {
    /// Whether it enters the same containers as `WideContainer::intersect`.
    const EXACT: bool = true;
    /// Factor on the distance up to which containers are entered: distances of entry come out larger by no more than that.
    const SLACK: f32 = 1.0;

    /// The lanes whose containers the ray enters up to `t_max`, one bit each, and the distances of entry.
    fn intersect(&self, simd: S, bounds: &B, t_max: f32) -> (u32, [f32; WIDTH]);
}

/// Eight boxes: the lower and the upper planes of each axis.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct BoxLanes(pub(crate) [[[f32; WIDTH]; 2]; 3]);
