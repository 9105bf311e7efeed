//! Rays through the wide tree of a mesh of which there is a copy: nodes are tested in the coordinates of the mesh, triangles in the world.

use std::ops::ControlFlow;

use fearless_simd::{Simd, SimdBase};

use crate::geometry::{Aabb, CarriedRay, Hit, Placement, Ray, TriangleHit};
use crate::kernel::each;
use crate::tree::traverse::{Nearest, Probe};
use crate::wide::block::{BlockRay, TriangleBlock};
use crate::wide::box_bounds::BoxRay;
use crate::wide::box_lanes::{BoxLanes, LaneTest};
use crate::wide::child::Child;
use crate::wide::fused_box::FusedBoxRay;
use crate::wide::layout::{BLOCK, COORDINATES, WINDOW};
use crate::wide::ray_lanes::{RayLanes, TriangleLanes};
use crate::wide::trace::walk::{Walk, each_leaf};
use crate::wide::tree::WideTree;

/// Called with each hit and the index of its triangle in the mesh; returns the distance up to which hits are wanted from there on, or
/// that no more are wanted.
pub type Found<'a> = &'a mut dyn FnMut(TriangleHit, u32) -> ControlFlow<(), f32>;

/// A ray in the world, prepared for tests of triangles.
pub struct WorldRay {
    pub(super) ray: Ray,
    pub(super) lanes: TriangleLanes<1>,
}

impl WorldRay {
    /// `None` for a ray that cannot hit anything.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(simd: S, ray: &Ray) -> Option<Self> {
        if let Some((_, world)) = Self::fused(simd, ray) {
            return Some(world);
        }
        let ray = with_an_end(ray);
        let lanes = RayLanes::single::<S, Aabb>(simd, &ray)?.triangles;
        Some(Self { ray, lanes })
    }

    /// The ray also for tests of boxes; `None` for one that [`FusedBoxRay::new`] does not serve.
    #[inline(always)]
    pub(super) fn fused<S: Simd>(simd: S, ray: &Ray) -> Option<(FusedBoxRay, Self)> {
        let ray = with_an_end(ray);
        let (boxes, lanes) = FusedBoxRay::new(simd, &ray)?;
        Some((boxes, Self { ray, lanes }))
    }
}

/// A hit has a finite distance.
#[inline(always)]
fn with_an_end(ray: &Ray) -> Ray {
    Ray { t_max: ray.t_max.min(f32::MAX), ..*ray }
}

/// A copy of a part of a mesh.
#[derive(Clone, Copy)]
pub(crate) struct Copy<'a> {
    pub(crate) tree: &'a WideTree<Aabb>,
    /// Where the part begins.
    pub(crate) start: Child,
    pub(crate) place: &'a Placement,
}

/// The nearest hit so far, and the copy that it is with.
#[derive(Clone, Copy)]
pub(crate) struct HitOfCopy {
    pub(super) nearest: Nearest,
    pub(super) copy: u32,
}

impl HitOfCopy {
    /// No hit yet within `t_max`.
    #[inline(always)]
    pub(super) fn new(t_max: f32) -> Self {
        Self { nearest: Nearest::new(t_max), copy: 0 }
    }

    /// Distance up to which hits are accepted.
    #[inline(always)]
    pub(super) fn t(&self) -> f32 {
        self.nearest.t()
    }

    /// Whether there is a hit.
    #[inline(always)]
    pub(crate) fn found(&self) -> bool {
        self.nearest.found()
    }

    /// The copy and the hit, if any.
    #[inline(always)]
    pub(crate) fn hit(&self) -> Option<(u32, Hit)> {
        Some((self.copy, self.nearest.hit()?))
    }

    /// Accepts a hit no farther than the nearest so far: equal distances go to the lower copy, then to the lower triangle.
    #[inline(always)]
    pub(super) fn offer(&mut self, copy: u32, hit: TriangleHit, primitive_index: u32) {
        if hit.t == self.nearest.t() && self.nearest.found() && copy != self.copy {
            if copy > self.copy {
                return;
            }
            self.nearest = Nearest::new(hit.t);
        }
        if self.nearest.offer(hit, primitive_index) {
            self.copy = copy;
        }
    }
}

/// The copy that an item of a tree over copies is, or is part of, with its index; `None` where that has no triangles.
pub(crate) type CopyOf<'f, 'a> = &'f dyn Fn(u32) -> Option<(u32, Copy<'a>)>;

/// Hands the hits of `world` with the `copy` to `found`, in any order, as they are for the triangles that [`Placement::triangle`]
/// makes: at distances up to `t_max`. `probe` observes.
#[inline(always)]
pub(crate) fn each_hit<S: Simd, P: Probe>(
    simd: S,
    copy: Copy<'_>,
    world: &WorldRay,
    t_max: f32,
    probe: &mut P,
    found: Found<'_>,
) {
    let ray = Ray { t_max, ..world.ray };
    let Some(carried) = copy.place.carry(&ray) else { return scan(simd, copy, world, t_max, probe, found) };
    if let Some(boxes) = FusedBoxRay::widened(simd, &carried.ray, carried.widening) {
        walk(simd, copy, world, &boxes, &carried, t_max, probe, found);
    } else if let Some(boxes) = BoxRay::widened(simd, &carried.ray, carried.widening) {
        walk(simd, copy, world, &boxes, &carried, t_max, probe, found);
    } else {
        scan(simd, copy, world, t_max, probe, found);
    }
}

/// [`each_hit`], nearer children first.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "the ray in the world and in the mesh, and what becomes of hits")]
fn walk<S: Simd, T: LaneTest<S, BoxLanes>, P: Probe>(
    simd: S,
    copy: Copy<'_>,
    world: &WorldRay,
    boxes: &T,
    carried: &CarriedRay,
    mut t_max: f32,
    probe: &mut P,
    found: Found<'_>,
) {
    let walk = Walk { start: copy.start, t_max: carried.distance(t_max), is_ordered: true };
    each_leaf(
        simd,
        copy.tree,
        walk,
        boxes,
        probe,
        #[inline(always)]
        |leaf, probe| {
            visit_leaf(simd, copy, world, leaf, &mut t_max, probe, found).map_continue(|()| carried.distance(t_max))
        },
    );
}

/// [`each_hit`] of every triangle, for a ray that cannot be carried into the coordinates of the mesh.
#[cold]
#[inline(never)]
fn scan<S: Simd, P: Probe>(simd: S, copy: Copy<'_>, world: &WorldRay, mut t_max: f32, probe: &mut P, found: Found<'_>) {
    simd.vectorize(
        #[inline(always)]
        || {
            let mut stack = vec![copy.start];
            while let Some(current) = stack.pop() {
                probe.visited(current.bits());
                if current.is_leaf() && visit_leaf(simd, copy, world, current, &mut t_max, probe, found).is_break() {
                    return;
                }
                stack.extend(copy.tree.children_of(current));
            }
        },
    );
}

/// Tests the triangles of a leaf in the world.
#[inline(always)]
fn visit_leaf<S: Simd, P: Probe>(
    simd: S,
    copy: Copy<'_>,
    world: &WorldRay,
    leaf: Child,
    t_max: &mut f32,
    probe: &mut P,
    found: Found<'_>,
) -> ControlFlow<()> {
    let block_ray = BlockRay::new(&world.lanes, 0);
    for block in copy.tree.leaves.blocks(leaf) {
        probe.primitive_test();
        let window = placed(simd, block, copy.place);
        let block = TriangleBlock::<BLOCK> { window: &window, count: block.count };
        let mut flow = ControlFlow::Continue(*t_max);
        block_ray.each_hit(simd, block, &world.ray, *t_max, |hit, index| {
            if let ControlFlow::Continue(end) = flow
                && hit.t <= end
            {
                flow = found(hit, index);
            }
        });
        match flow {
            ControlFlow::Continue(end) => *t_max = end,
            ControlFlow::Break(()) => return ControlFlow::Break(()),
        }
    }
    ControlFlow::Continue(())
}

/// The values of a block whose triangles stand in the world, with [`BLOCK`] numbers in a row: each corner as [`Placement::point`] has it.
#[inline(always)]
pub(super) fn placed<S: Simd>(simd: S, block: TriangleBlock<'_>, place: &Placement) -> [f32; WINDOW] {
    // The first two corners side by side.
    let [x, y, z] = each!(axis => {
        let [a, b, c] = block.corners(simd, 8 * axis as u32);
        (simd.combine_f32x4(a, b), c)
    });
    let mut window = [0.0; WINDOW];
    for axis in 0..3 {
        let [mx, my, mz, translation] = place.rows[axis];
        let row = &mut window[3 * BLOCK * axis..][..3 * BLOCK];
        let two = x.0 * mx + y.0 * my + z.0 * mz + translation;
        let third = x.1 * mx + y.1 * my + z.1 * mz + translation;
        row[..2 * BLOCK].copy_from_slice(two.as_slice());
        row[2 * BLOCK..].copy_from_slice(third.as_slice());
    }
    window[BLOCK * COORDINATES..][..BLOCK].copy_from_slice(block.marks(simd).as_slice());
    window
}
