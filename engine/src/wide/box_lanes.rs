//! Eight boxes side by side, and what it means to test a ray against eight containers.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use bytemuck::{Pod, Zeroable};
use fearless_simd::{Simd, SimdBase, SimdMask, f32x8, mask32x8};

use crate::wide::layout::WIDTH;

/// A ray that is tested against the eight containers of `B`.
pub trait LaneTest<S: Simd, B> {
    /// True if it enters the same containers as `Container::entry` of each.
    const EXACT: bool = true;
    /// Factor on the distance up to which containers are entered: distances of entry come out larger by no more than that.
    const SLACK: f32 = 1.0;

    /// The lanes whose containers the ray enters up to `t_max`, and the distances of entry.
    fn intersect_lanes(&self, simd: S, bounds: &B, t_max: f32) -> (mask32x8<S>, f32x8<S>);

    /// [`LaneTest::intersect_lanes`] with one bit for each lane.
    #[inline(always)]
    fn intersect(&self, simd: S, bounds: &B, t_max: f32) -> (u32, [f32; WIDTH]) {
        let (entered, entry) = self.intersect_lanes(simd, bounds, t_max);
        (entered.to_bitmask() as u32, entry.to_array())
    }
}

/// Eight boxes: the lower and the upper planes of each axis.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct BoxLanes(pub(crate) [[[f32; WIDTH]; 2]; 3]);
