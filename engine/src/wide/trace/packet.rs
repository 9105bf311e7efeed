//! Packets of coherent rays from one point, such as a tile of a camera's rays: nodes and triangles are fetched once for
//! all of them.
//!
//! Each visit tests the eight children of a node against all directions at once, which accepts or rejects most children
//! for the whole packet; only the others are tested against the groups of sixteen rays that reached the node (after
//! Wald, Boulos, Shirley, *Ray Tracing Deformable Scenes Using Dynamic Bounding Volume Hierarchies*, 2007). The hits
//! are those of single rays.

use fearless_simd::{Level, Select, Simd, SimdBase, SimdMask, f32x16, mask32x16, u32x16};
use glam::Vec3;

use crate::geometry::{
    Aabb, EDGE_MAX, EDGE_MIN, ExactPlane, FAR_SLACK, Hit, PreparedRay, Ray, Shear, Triangle, TriangleHit,
};
use crate::kernel::bits::bits;
use crate::kernel::each;
use crate::kernel::simd::dispatch;
use crate::wide::block::TriangleBlock;
use crate::wide::bounds::WideContainer;
use crate::wide::child::Child;
use crate::wide::layout::WIDTH;
use crate::wide::ray_lanes::{RAY_LANES, permuted_axes, transposed};
use crate::wide::trace::beam::{Beam, BeamContainer, GROUP, GROUPS};
use crate::wide::trace::packet_tree::PacketTree;
use crate::wide::trace::stack::Stack;
use crate::wide::trace::stream;
use crate::wide::tree::WideTree;

/// Maximum number of rays in a packet.
pub const MAX_RAYS: usize = GROUP * GROUPS;
/// Fewer rays than this are traced one by one: in a packet, the tests of the others of their group would be wasted.
pub const FEW: usize = GROUP;

/// A child to visit.
#[derive(Debug, Clone, Copy)]
struct Waiting {
    /// Distance of entry.
    entry: f32,
    child: Child,
    /// The groups that enter it.
    groups: u32,
}

/// No triangle and no copy; loses every tie.
const NONE: u32 = u32::MAX;

/// The closest hits of `rays`, the same as for single rays, written to the first elements of `hits`. `packets` is `tree` as packets go
/// through it.
///
/// Fast if the rays come from one point in similar directions and each sixteen consecutive rays are neighbours; correct
/// for any rays.
///
/// # Panics
///
/// If `hits` is shorter than `rays`.
pub(crate) fn closest_hits<'a, C: WideContainer, B: BeamContainer>(
    level: Level,
    tree: &WideTree<C>,
    packets: impl PacketTree<'a, B>,
    rays: &[Ray],
    hits: &mut [Option<Hit>],
) {
    assert!(hits.len() >= rays.len(), "{} hits for {} rays", hits.len(), rays.len());
    // Consecutive incoherent rays are collected, because streams get faster with more rays.
    let mut traced = 0;
    for first in (0..rays.len()).step_by(MAX_RAYS) {
        let end = rays.len().min(first + MAX_RAYS);
        let (rays_before, rays) = rays[traced..end].split_at(first - traced);
        let (hits_before, hits) = hits[traced..end].split_at_mut(first - traced);
        if closest_hits_of_packet(level, packets, rays, hits) {
            dispatch!(level, simd => stream::closest_hits(simd, tree, rays_before, hits_before));
            traced = end;
        }
    }
    dispatch!(level, simd => stream::closest_hits(simd, tree, &rays[traced..], &mut hits[traced..]));
}

/// Traces `rays` as a packet; `false` if they are not coherent enough. Not inlined, as trees of several containers share it.
#[inline(never)]
fn closest_hits_of_packet<'a, C: BeamContainer>(
    level: Level,
    tree: impl PacketTree<'a, C>,
    rays: &[Ray],
    hits: &mut [Option<Hit>],
) -> bool {
    dispatch!(level, simd => {
        let mut packet = Packet::<C>::empty();
        if !packet.set(simd, rays) {
            return false;
        }
        packet.trace(simd, tree, rays);
        for (index, hit) in hits.iter_mut().enumerate() {
            *hit = packet.hits.hit(index);
        }
        true
    })
}

/// Closest hits so far, by group.
pub(super) struct PacketHits {
    pub(super) t: [[f32; GROUP]; GROUPS],
    u: [[f32; GROUP]; GROUPS],
    v: [[f32; GROUP]; GROUPS],
    primitive: [[u32; GROUP]; GROUPS],
    /// The copies that were hit.
    copies: [[u32; GROUP]; GROUPS],
    /// The largest `t` of each group.
    group_t_max: [f32; GROUPS],
    /// The copy whose triangles are being tested; 0 where there are none.
    pub(super) copy: u32,
}

impl PacketHits {
    pub(super) fn hit(&self, index: usize) -> Option<Hit> {
        let (group, lane) = (index / GROUP, index % GROUP);
        let primitive_index = self.primitive[group][lane];
        (primitive_index != NONE).then(|| Hit {
            t: self.t[group][lane],
            primitive_index,
            u: self.u[group][lane],
            v: self.v[group][lane],
        })
    }

    /// The copy that a ray has hit.
    pub(super) fn hit_copy(&self, index: usize) -> u32 {
        self.copies[index / GROUP][index % GROUP]
    }

    /// Takes the hit of one ray with a triangle if it comes first.
    pub(super) fn offer(&mut self, group: usize, lane: usize, TriangleHit { t, u, v }: TriangleHit, primitive: u32) {
        let best = self.t[group][lane];
        let last = (self.copies[group][lane], self.primitive[group][lane]);
        if t < best || t == best && (self.copy, primitive) < last {
            (self.t[group][lane], self.u[group][lane], self.v[group][lane]) = (t, u, v);
            (self.copies[group][lane], self.primitive[group][lane]) = (self.copy, primitive);
        }
    }

    /// After hits of single rays of a group.
    pub(super) fn update_group(&mut self, group: usize) {
        self.group_t_max[group] = self.t[group].into_iter().fold(f32::NEG_INFINITY, f32::max);
    }
}

/// Rays from one point whose directions have the same signs and the same longest axis.
pub(super) struct Packet<C: BeamContainer> {
    /// Ray data for the tests against containers.
    pub(super) frustum: C::Frustum,
    /// One bit for each group that has rays.
    pub(super) all_groups: u32,
    pub(super) rays: PacketRays,
    pub(super) hits: PacketHits,
}

/// The rays of a packet, prepared for the tests of triangles.
pub(super) struct PacketRays {
    pub(super) beam: Beam,
    /// Axes of the shear; the longest comes last.
    axes: [usize; 3],
    /// Factors of the rows of [`Shear`].
    factors: [[[f32; GROUP]; 3]; GROUPS],
    /// Directions, for needles and for copies.
    pub(super) directions: [[[f32; GROUP]; 3]; GROUPS],
}

impl<C: BeamContainer> Packet<C> {
    /// Without rays. Not a constant, which would be copied.
    #[inline(always)]
    pub(super) fn empty() -> Self {
        Self {
            frustum: C::EMPTY_FRUSTUM,
            all_groups: 0,
            rays: PacketRays {
                beam: Beam {
                    origin: [0.0; 3],
                    plane_origins: [[0.0; 3]; 2],
                    t_min: 0.0,
                    near: [0; 3],
                    range: [[f32::INFINITY, f32::NEG_INFINITY]; 3],
                    inverse: [[[0.0; GROUP]; 3]; GROUPS],
                },
                axes: [0; 3],
                factors: [[[0.0; GROUP]; 3]; GROUPS],
                directions: [[[0.0; GROUP]; 3]; GROUPS],
            },
            hits: PacketHits {
                t: [[0.0; GROUP]; GROUPS],
                u: [[0.0; GROUP]; GROUPS],
                v: [[0.0; GROUP]; GROUPS],
                primitive: [[NONE; GROUP]; GROUPS],
                copies: [[NONE; GROUP]; GROUPS],
                group_t_max: [0.0; GROUPS],
                copy: 0,
            },
        }
    }

    /// Takes rays, in place, as a packet is large; `false` if they are not coherent enough.
    #[inline(always)]
    #[expect(clippy::too_many_lines, reason = "sets each lane of a packet up once")]
    pub(super) fn set<S: Simd>(&mut self, simd: S, rays: &[Ray]) -> bool {
        let Some(first) = rays.first() else { return false };
        let near = each!(axis => usize::from(first.direction[axis] < 0.0));
        let axes = permuted_axes(first.direction);
        let t_min = first.t_min.max(0.0);
        if !first.origin.is_finite() {
            return false;
        }
        let groups = rays.len().div_ceil(GROUP);
        self.all_groups = u32::MAX >> (GROUPS - groups);
        self.rays.axes = axes;
        let beam = &mut self.rays.beam;
        (beam.origin, beam.plane_origins) = (first.origin.to_array(), [first.origin.to_array(); 2]);
        (beam.t_min, beam.near) = (t_min, near);
        let zero = f32x16::splat(simd, 0.0);
        let one = f32x16::splat(simd, 1.0);
        let mut lowest = [f32x16::splat(simd, f32::INFINITY); 3];
        let mut highest = [f32x16::splat(simd, f32::NEG_INFINITY); 3];
        for group in 0..groups {
            // The last ray fills the remaining lanes.
            let rays = &rays[group * GROUP..];
            let others = if rays.len() > RAY_LANES { &rays[RAY_LANES..] } else { &rays[rays.len() - 1..] };
            let (rays, others) = (transposed(simd, rays), transposed(simd, others));
            let row = |index: usize| simd.combine_f32x8(rays[index], others[index]);
            let d = each!(axis => row(3 + axis));
            let (given_t_min, t_max) = (row(6), row(7));
            let same_t_min = if t_min > 0.0 {
                given_t_min.simd_eq(f32x16::splat(simd, t_min))
            } else {
                // NaN counts as 0.
                !given_t_min.simd_gt(zero)
            };
            let same_origin = row(0).simd_eq(f32x16::splat(simd, first.origin.x))
                & row(1).simd_eq(f32x16::splat(simd, first.origin.y))
                & row(2).simd_eq(f32x16::splat(simd, first.origin.z))
                & same_t_min
                & t_max.simd_ge(f32x16::splat(simd, t_min));
            let inverse = each!(axis => one / d[axis]);
            let along = d[axes[2]];
            let longest = along.abs();
            // Of equal axes the first counts as the longest.
            let is_longest = each!(axis => {
                let other = d[axis].abs();
                if axis < axes[2] { longest.simd_gt(other) } else { longest.simd_ge(other) }
            });
            let squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            let mut same_octant = is_longest[axes[0]]
                & is_longest[axes[1]]
                & squared.simd_ge(f32x16::splat(simd, f32::MIN_POSITIVE))
                & squared.simd_le(f32x16::splat(simd, f32::MAX));
            for axis in 0..3 {
                // The same sign as the first ray, not zero, and large enough for a finite inverse.
                let same = if near[axis] == 1 { d[axis].simd_lt(zero) } else { d[axis].simd_gt(zero) };
                same_octant = same_octant & same & inverse[axis].abs().simd_le(f32x16::splat(simd, f32::MAX));
                lowest[axis] = lowest[axis].min(inverse[axis]);
                highest[axis] = highest[axis].max(inverse[axis]);
                self.rays.beam.inverse[group][axis] = inverse[axis].to_array();
            }
            if !(same_origin & same_octant).all_true() {
                return false;
            }
            C::add_group(simd, &mut self.frustum, group, d, axes);
            let factors = [(zero - d[axes[0]]) / along, (zero - d[axes[1]]) / along, inverse[axes[2]]];
            self.rays.factors[group] = each!(index => factors[index].to_array());
            self.rays.directions[group] = each!(axis => d[axis].to_array());
            let t_max = t_max.min(f32x16::splat(simd, f32::MAX));
            self.hits.t[group] = t_max.to_array();
            self.hits.group_t_max[group] = t_max.reduce_max();
        }
        C::finish(&mut self.frustum, &self.rays.beam, axes);
        self.rays.beam.range = each!(axis => [lowest[axis].reduce_min(), highest[axis].reduce_max()]);
        true
    }

    #[inline(always)]
    fn trace<'a, S: Simd>(&mut self, simd: S, tree: impl PacketTree<'a, C>, rays: &[Ray]) {
        let Some(root) = tree.root() else { return };
        let Self { frustum, all_groups, rays: prepared, hits } = self;
        let walk = Walk { start: root, groups: *all_groups, beam: &prepared.beam, frustum };
        walk.each_leaf(
            simd,
            tree,
            hits,
            #[inline(always)]
            |hits, leaf, active| {
                for block in tree.leaves().blocks(leaf) {
                    prepared.test_block(simd, block, active, rays, hits);
                }
            },
        );
    }
}

/// A walk of a packet through a tree.
pub(super) struct Walk<'a, C: BeamContainer> {
    /// Where it begins.
    pub(super) start: Child,
    /// The groups that take part.
    pub(super) groups: u32,
    /// Their rays, in the coordinates of the tree.
    pub(super) beam: &'a Beam,
    pub(super) frustum: &'a C::Frustum,
}

impl<C: BeamContainer> Walk<'_, C> {
    /// Calls `visit` with each leaf that rays enter before their hits, and their groups.
    #[inline(always)]
    pub(super) fn each_leaf<'a, S: Simd>(
        &self,
        simd: S,
        tree: impl PacketTree<'a, C>,
        hits: &mut PacketHits,
        mut visit: impl FnMut(&mut PacketHits, Child, u32),
    ) {
        let mut stack = Stack::new();
        stack.push(Waiting { entry: self.beam.t_min, child: self.start, groups: self.groups });
        while let Some(Waiting { entry, child, groups }) = stack.pop() {
            // Skip groups in which every ray has a closer hit.
            let group_t_max = f32x16::load_array_ref(simd, &hits.group_t_max);
            let open =
                group_t_max.simd_ge(f32x16::splat(simd, entry)) & mask32x16::from_bitmask(simd, u64::from(groups));
            let active = open.to_bitmask() as u32;
            if active == 0 {
                continue;
            }
            let t_max = open.select(group_t_max, f32x16::splat(simd, f32::NEG_INFINITY)).reduce_max();
            if child.is_leaf() {
                visit(hits, child, active);
                continue;
            }
            let mut space = None;
            let (bounds, children) = tree.unpack(simd, child, &mut space);
            let beam_hits = C::intersect_beam(simd, bounds, self.beam, self.frustum, t_max);
            let mark = stack.reserve();
            for lane in bits(u64::from(beam_hits.some)) {
                let lane = lane % WIDTH;
                let groups = if beam_hits.all >> lane & 1 != 0 {
                    active
                } else {
                    let child = C::splat_offset(simd, &beam_hits.offsets, lane);
                    self.entering_groups(simd, &child, active, hits)
                };
                if groups != 0 {
                    tree.prefetch(children[lane]);
                    stack.push(Waiting { entry: beam_hits.entry[lane], child: children[lane], groups });
                    stack.sort_last(mark, |a, b| a.entry < b.entry);
                }
            }
        }
    }

    /// The groups out of `active` in which any ray enters a container.
    #[inline(always)]
    pub(super) fn entering_groups<S: Simd>(
        &self,
        simd: S,
        container: &C::Offset<S>,
        active: u32,
        hits: &PacketHits,
    ) -> u32 {
        let mut entering = 0;
        for group in bits(u64::from(active)) {
            let t = f32x16::load_array_ref(simd, &hits.t[group % GROUPS]);
            let enters = C::intersect_group(simd, container, self.beam, self.frustum, group % GROUPS, t);
            entering |= u32::from(enters.any_true()) << group;
        }
        entering
    }
}

impl PacketRays {
    /// Tests the triangles of a block against the `active` groups.
    #[inline(always)]
    pub(super) fn test_block<S: Simd, const STRIDE: usize>(
        &self,
        simd: S,
        block: TriangleBlock<'_, STRIDE>,
        active: u32,
        rays: &[Ray],
        hits: &mut PacketHits,
    ) {
        for lane in 0..block.count() {
            let [corner_x, corner_y, corner_z] = each!(index => each!(corner => {
                let axis = self.axes[index];
                f32x16::splat(simd, block.coordinate(corner, axis, lane) - self.beam.origin[axis])
            }));
            for group in bits(u64::from(active)) {
                let group = group % GROUPS;
                let factors = &self.factors[group];
                let factors = each!(index => f32x16::load_array_ref(simd, &factors[index]));
                let x = each!(corner => corner_z[corner] * factors[0] + corner_x[corner]);
                let y = each!(corner => corner_z[corner] * factors[1] + corner_y[corner]);
                let edges = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
                let min_edge = edges[0].min(edges[1]).min(edges[2]);
                let max_edge = edges[0].max(edges[1]).max(edges[2]);
                let candidates =
                    !(min_edge.simd_lt(f32x16::splat(simd, 0.0)) & max_edge.simd_gt(f32x16::splat(simd, 0.0)));
                if candidates.any_true() {
                    let depth = each!(corner => corner_z[corner] * factors[2]);
                    self.accept_hits(
                        simd,
                        block,
                        lane,
                        group,
                        edges,
                        depth,
                        candidates.to_bitmask() as u32,
                        rays,
                        hits,
                    );
                }
            }
        }
    }

    /// Where the rays of a group enter and leave a box, with `t_min` and [`FAR_SLACK`].
    #[inline(always)]
    fn bounds_distances<S: Simd>(&self, simd: S, bounds: &Aabb, group: usize) -> (f32x16<S>, f32x16<S>) {
        let Beam { origin, t_min, near, inverse, .. } = &self.beam;
        let planes = [bounds.min, bounds.max];
        let inverse = each!(axis => f32x16::load_array_ref(simd, &inverse[group % GROUPS][axis]));
        let distance =
            |axis: usize, side: usize| f32x16::splat(simd, planes[side & 1][axis] - origin[axis]) * inverse[axis];
        let near_t = each!(axis => distance(axis, near[axis]));
        let far_t = each!(axis => distance(axis, near[axis] ^ 1));
        let entry = near_t[0].max(near_t[1]).max(near_t[2].max(f32x16::splat(simd, *t_min)));
        (entry, far_t[0].min(far_t[1]).min(far_t[2]) * FAR_SLACK)
    }

    /// Accepts the hits of a triangle with the rays of a group that passed the sign test, `candidates`.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "the second half of `test_block`, cut where it gets rare")]
    fn accept_hits<S: Simd, const STRIDE: usize>(
        &self,
        simd: S,
        block: TriangleBlock<'_, STRIDE>,
        lane: usize,
        group: usize,
        edges: [f32x16<S>; 3],
        depth: [f32x16<S>; 3],
        candidates: u32,
        rays: &[Ray],
        hits: &mut PacketHits,
    ) {
        let size = each!(corner => edges[corner].abs());
        let exact = size[0].min(size[1]).min(size[2]).simd_gt(f32x16::splat(simd, EDGE_MIN))
            & size[0].max(size[1]).max(size[2]).simd_lt(f32x16::splat(simd, EDGE_MAX));
        let scale = f32x16::splat(simd, 1.0) / (edges[0] + edges[1] + edges[2]);
        let barycentrics = each!(corner => edges[corner] * scale);
        let t = barycentrics[0] * depth[0] + barycentrics[1] * depth[1] + barycentrics[2] * depth[2];
        let best = f32x16::load_array_ref(simd, &hits.t[group]);
        let t_min = f32x16::splat(simd, self.beam.t_min);
        let t = if block.is_needle(lane) {
            let low = depth[0].min(depth[1]).min(depth[2]);
            let high = depth[0].max(depth[1]).max(depth[2]);
            let reached = low.simd_le(best) & high.simd_ge(t_min);
            let mut distances = t;
            if candidates & reached.to_bitmask() as u32 != 0 {
                let mut lanes = t.to_array();
                let origin = Vec3::from_array(self.beam.origin);
                plane_distances(simd, &block.triangle(lane), origin, &self.directions[group], &mut lanes);
                distances = f32x16::load_array(simd, lanes);
            }
            distances.max(low).min(high)
        } else {
            t
        };
        let within = exact & t.simd_ge(t_min) & t.simd_le(best);
        let uncertain = candidates & !(exact.to_bitmask() as u32);
        if candidates & within.to_bitmask() as u32 != 0 {
            let (entry, exit) = self.bounds_distances(simd, &block.triangle(lane).bounds(), group);
            let t = t.max(entry);
            let primitive = u32x16::splat(simd, block.primitive_index(lane));
            let best_primitive = u32x16::load_array_ref(simd, &hits.primitive[group]);
            let copy = u32x16::splat(simd, hits.copy);
            let best_copy = u32x16::load_array_ref(simd, &hits.copies[group]);
            let lower = copy.simd_lt(best_copy) | (copy.simd_eq(best_copy) & primitive.simd_lt(best_primitive));
            let nearer = t.simd_lt(best) | (t.simd_eq(best) & lower);
            // Rays that passed the sign test.
            let allowed = mask32x16::from_bitmask(simd, u64::from(candidates));
            let hit = allowed & within & entry.simd_le(exit) & entry.simd_le(best) & nearer;
            if hit.any_true() {
                let new_t = hit.select(t, best);
                let best_u = f32x16::load_array_ref(simd, &hits.u[group]);
                let best_v = f32x16::load_array_ref(simd, &hits.v[group]);
                hits.primitive[group] = hit.select(primitive, best_primitive).to_array();
                hits.copies[group] = hit.select(copy, best_copy).to_array();
                hits.t[group] = new_t.to_array();
                // After other stores: next to their loads, compilers would make these masked stores, which are slow on
                // AMD with AVX2.
                hits.u[group] = hit.select(barycentrics[1], best_u).to_array();
                hits.v[group] = hit.select(barycentrics[2], best_v).to_array();
                hits.group_t_max[group] = new_t.reduce_max();
            }
        }
        if uncertain != 0 {
            accept_uncertain(block, lane, group, uncertain, rays, hits);
        }
    }
}

/// Tests in double precision the rays that pass too close to an edge for single precision.
#[cold]
fn accept_uncertain<const STRIDE: usize>(
    block: TriangleBlock<'_, STRIDE>,
    lane: usize,
    group: usize,
    uncertain: u32,
    rays: &[Ray],
    hits: &mut PacketHits,
) {
    let (triangle, primitive) = (block.triangle(lane), block.primitive_index(lane));
    for ray_lane in bits(u64::from(uncertain)) {
        let ray = rays[(group * GROUP + ray_lane).min(rays.len() - 1)];
        let best = hits.t[group][ray_lane];
        if let Some(hit) = triangle.intersect(&PreparedRay::new(ray), &Shear::new(ray.direction), best) {
            hits.offer(group, ray_lane, hit, primitive);
        }
    }
    hits.update_group(group);
}

/// Distances `t` of a needle along sixteen rays, taken from its plane. Apart, because few triangles are needles.
#[cold]
#[inline(never)]
fn plane_distances<S: Simd>(
    simd: S,
    needle: &Triangle,
    origin: Vec3,
    directions: &[[f32; GROUP]; 3],
    t: &mut [f32; GROUP],
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let directions = each!(axis => f32x16::load_array_ref(simd, &directions[axis]));
            let approximate = f32x16::load_array_ref(simd, t);
            *t = ExactPlane::new(needle, origin).distances(simd, directions, approximate).to_array();
        },
    );
}
