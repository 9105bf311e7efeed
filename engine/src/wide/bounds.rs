//! Containers of wide trees, and how eight of them are tested side by side.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use std::fmt::Debug;

use bytemuck::{Pod, Zeroable};
use fearless_simd::{Simd, f32x8};

use crate::geometry::Ray;
use crate::tree::Container;
use crate::wide::box_lanes::LaneTest;
use crate::wide::ray_lanes::{RayLanes, RayRows, TriangleLanes};

/// A container of which wide trees are made.
#[allow(private_interfaces, reason = "only the kernels of wide trees prepare rays")]
pub trait WideContainer: Container + RayRows {
    /// Eight containers, one per lane.
    type Bounds: Pod + Send + Sync + PartialEq + Debug;
    /// Eight empty containers, which no ray enters.
    const EMPTY_BOUNDS: Self::Bounds;
    /// A ray prepared for tests against eight containers, with the rounding of [`Container::entry`].
    type Prepared<S: Simd>: LaneTest<S, Self::Bounds>;
    /// A single ray prepared for tests that take fewer steps and may also enter what [`WideContainer::Prepared`] just misses.
    type Fused<S: Simd>: LaneTest<S, Self::Bounds>;
    /// Eight containers in less memory.
    type Compact: CompactBounds<Self>;
    /// Whether there are nodes with [`WideContainer::Compact`].
    const HAS_COMPACT: bool;

    /// [`Container::relative_area`] of a container that is not empty, without checking.
    fn nonempty_area(&self) -> f32;
    /// Stores the container in a lane of `bounds`.
    fn store(&self, bounds: &mut Self::Bounds, lane: usize);
    /// The container in a lane of `bounds`.
    fn load(bounds: &Self::Bounds, lane: usize) -> Self;
    /// Prepares ray `at` of `rays`.
    fn prepare<S: Simd, const N: usize>(simd: S, rays: &RayLanes<N>, at: usize) -> Self::Prepared<S>;
    /// [`Container::distance_squared`] of eight containers from a point whose coordinates are in all lanes; infinite in unused lanes.
    fn distances_squared<S: Simd>(simd: S, bounds: &Self::Bounds, point: [f32x8<S>; 3]) -> f32x8<S>;
    /// Prepares a single ray for the shorter test, and for triangles; `None` where only [`WideContainer::prepare`] will do.
    fn prepare_fused<S: Simd>(simd: S, ray: &Ray) -> Option<(Self::Fused<S>, TriangleLanes<1>)>;
}

/// Up to eight containers in less memory, each rounded so that it encloses what was stored.
pub trait CompactBounds<C: WideContainer>: Pod + Send + Sync + PartialEq + Debug {
    /// Stores the first `count` of eight containers, one to eight; the others are empty.
    fn pack(lanes: &C::Bounds, count: usize) -> Self;
    /// The containers as rays are tested against them.
    fn unpack<S: Simd>(&self, simd: S) -> C::Bounds;
    /// The container in a lane.
    fn load(&self, lane: usize) -> C;
    /// True if a lane may hold `container`; rounding can give false positives.
    fn holds(&self, lane: usize, container: &C) -> bool;
}

/// Eight containers as they are, where there is no smaller form.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Whole<B>(B);

impl<C: WideContainer> CompactBounds<C> for Whole<C::Bounds> {
    fn pack(lanes: &C::Bounds, _: usize) -> Self {
        Self(*lanes)
    }

    #[inline(always)]
    fn unpack<S: Simd>(&self, _: S) -> C::Bounds {
        self.0
    }

    fn load(&self, lane: usize) -> C {
        C::load(&self.0, lane)
    }

    fn holds(&self, lane: usize, container: &C) -> bool {
        C::load(&self.0, lane) == *container
    }
}
