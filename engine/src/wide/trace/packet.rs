//! Packets of coherent rays from one point, such as a tile of a camera's rays: nodes and triangles are fetched once for
//! all of them.
//!
//! Each visit tests the eight children of a node against all directions at once, which accepts or rejects most children
//! for the whole packet; only the others are tested against the groups of sixteen rays that reached the node (after
//! Wald, Boulos, Shirley, *Ray Tracing Deformable Scenes Using Dynamic Bounding Volume Hierarchies*, 2007). The hits
//! are those of single rays.

use fearless_simd::{Level, Select, Simd, SimdBase, SimdMask, f32x16, mask32x16, u32x16};
use glam::Vec3;

use crate::geometry::{EDGE_MAX, EDGE_MIN, ExactPlane, FAR_SLACK, Hit, PreparedRay, Ray, Shear, Triangle};
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

/// No triangle; loses every tie.
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
        let Some(mut packet) = Packet::<C>::new(simd, rays) else { return false };
        packet.trace(simd, tree, rays);
        for (index, hit) in hits.iter_mut().enumerate() {
            *hit = packet.hits.hit(index);
        }
        true
    })
}

/// Closest hits so far, by group.
struct PacketHits {
    t: [[f32; GROUP]; GROUPS],
    u: [[f32; GROUP]; GROUPS],
    v: [[f32; GROUP]; GROUPS],
    primitive: [[u32; GROUP]; GROUPS],
    /// The largest `t` of each group.
    group_t_max: [f32; GROUPS],
}

impl PacketHits {
    fn hit(&self, index: usize) -> Option<Hit> {
        let (group, lane) = (index / GROUP, index % GROUP);
        let primitive_index = self.primitive[group][lane];
        (primitive_index != NONE).then(|| Hit {
            t: self.t[group][lane],
            primitive_index,
            u: self.u[group][lane],
            v: self.v[group][lane],
        })
    }
}

/// Rays from one point whose directions have the same signs and the same longest axis.
struct Packet<C: BeamContainer> {
    beam: Beam,
    /// Ray data for the tests against containers.
    frustum: C::Frustum,
    /// Axes of the shear; the longest comes last.
    axes: [usize; 3],
    /// One bit for each group that has rays.
    all_groups: u32,
    /// Factors of the rows of [`Shear`].
    factors: [[[f32; GROUP]; 3]; GROUPS],
    /// Directions, for needles.
    directions: [[[f32; GROUP]; 3]; GROUPS],
    hits: PacketHits,
}

impl<C: BeamContainer> Packet<C> {
    /// Prepares rays; `None` if they are not coherent enough.
    #[inline(always)]
    #[expect(clippy::too_many_lines, reason = "sets each lane of a packet up once")]
    fn new<S: Simd>(simd: S, rays: &[Ray]) -> Option<Self> {
        let first = rays.first()?;
        let near = each!(axis => usize::from(first.direction[axis] < 0.0));
        let axes = permuted_axes(first.direction);
        let t_min = first.t_min.max(0.0);
        if !first.origin.is_finite() {
            return None;
        }
        let groups = rays.len().div_ceil(GROUP);
        let mut packet = Self {
            beam: Beam {
                origin: first.origin.to_array(),
                t_min,
                near,
                range: [[f32::INFINITY, f32::NEG_INFINITY]; 3],
                inverse: [[[0.0; GROUP]; 3]; GROUPS],
            },
            frustum: C::EMPTY_FRUSTUM,
            axes,
            all_groups: u32::MAX >> (GROUPS - groups),
            factors: [[[0.0; GROUP]; 3]; GROUPS],
            directions: [[[0.0; GROUP]; 3]; GROUPS],
            hits: PacketHits {
                t: [[0.0; GROUP]; GROUPS],
                u: [[0.0; GROUP]; GROUPS],
                v: [[0.0; GROUP]; GROUPS],
                primitive: [[NONE; GROUP]; GROUPS],
                group_t_max: [0.0; GROUPS],
            },
        };
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
                packet.beam.inverse[group][axis] = inverse[axis].to_array();
            }
            if !(same_origin & same_octant).all_true() {
                return None;
            }
            C::add_group(simd, &mut packet.frustum, group, d, axes);
            let factors = [(zero - d[axes[0]]) / along, (zero - d[axes[1]]) / along, inverse[axes[2]]];
            packet.factors[group] = each!(index => factors[index].to_array());
            packet.directions[group] = each!(axis => d[axis].to_array());
            let t_max = t_max.min(f32x16::splat(simd, f32::MAX));
            packet.hits.t[group] = t_max.to_array();
            packet.hits.group_t_max[group] = t_max.reduce_max();
        }
        C::finish(&mut packet.frustum, &packet.beam, axes);
        packet.beam.range = each!(axis => [lowest[axis].reduce_min(), highest[axis].reduce_max()]);
        Some(packet)
    }

    #[inline(always)]
    fn trace<'a, S: Simd>(&mut self, simd: S, tree: impl PacketTree<'a, C>, rays: &[Ray]) {
        let Some(root) = tree.root() else { return };
        let mut stack = Stack::new();
        stack.push(Waiting { entry: self.beam.t_min, child: root, groups: self.all_groups });
        while let Some(Waiting { entry, child, groups }) = stack.pop() {
            // Skip groups in which every ray has a closer hit.
            let group_t_max = f32x16::load_array_ref(simd, &self.hits.group_t_max);
            let open =
                group_t_max.simd_ge(f32x16::splat(simd, entry)) & mask32x16::from_bitmask(simd, u64::from(groups));
            let active = open.to_bitmask() as u32;
            if active == 0 {
                continue;
            }
            let t_max = open.select(group_t_max, f32x16::splat(simd, f32::NEG_INFINITY)).reduce_max();
            if child.is_leaf() {
                for block in tree.leaves().blocks(child) {
                    self.test_block(simd, block, active, rays);
                }
                continue;
            }
            let mut space = None;
            let (bounds, children) = tree.unpack(simd, child, &mut space);
            let beam_hits = C::intersect_beam(simd, bounds, &self.beam, &self.frustum, t_max);
            let mark = stack.reserve();
            for lane in bits(u64::from(beam_hits.some)) {
                let lane = lane % WIDTH;
                let groups = if beam_hits.all >> lane & 1 != 0 {
                    active
                } else {
                    self.entering_groups(simd, &beam_hits.offsets, lane, active)
                };
                if groups != 0 {
                    tree.prefetch(children[lane]);
                    stack.push(Waiting { entry: beam_hits.entry[lane], child: children[lane], groups });
                    stack.sort_last(mark, |a, b| a.entry < b.entry);
                }
            }
        }
    }

    /// The groups out of `active` in which any ray enters the child in a lane.
    #[inline(always)]
    fn entering_groups<S: Simd>(&self, simd: S, offsets: &C::Offsets, lane: usize, active: u32) -> u32 {
        let child = C::splat_offset(simd, offsets, lane);
        let mut entering = 0;
        for group in bits(u64::from(active)) {
            let t = f32x16::load_array_ref(simd, &self.hits.t[group % GROUPS]);
            let enters = C::intersect_group(simd, &child, &self.beam, &self.frustum, group % GROUPS, t);
            entering |= u32::from(enters.any_true()) << group;
        }
        entering
    }

    /// Tests the triangles of a block against the `active` groups.
    #[inline(always)]
    fn test_block<S: Simd>(&mut self, simd: S, block: TriangleBlock<'_>, active: u32, rays: &[Ray]) {
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
                    self.accept_hits(simd, block, lane, group, edges, depth, candidates.to_bitmask() as u32, rays);
                }
            }
        }
    }

    /// Accepts the hits of a triangle with the rays of a group that passed the sign test, `candidates`.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "the second half of `test_block`, cut where it gets rare")]
    fn accept_hits<S: Simd>(
        &mut self,
        simd: S,
        block: TriangleBlock<'_>,
        lane: usize,
        group: usize,
        edges: [f32x16<S>; 3],
        depth: [f32x16<S>; 3],
        candidates: u32,
        rays: &[Ray],
    ) {
        let size = each!(corner => edges[corner].abs());
        let exact = size[0].min(size[1]).min(size[2]).simd_gt(f32x16::splat(simd, EDGE_MIN))
            & size[0].max(size[1]).max(size[2]).simd_lt(f32x16::splat(simd, EDGE_MAX));
        let scale = f32x16::splat(simd, 1.0) / (edges[0] + edges[1] + edges[2]);
        let barycentrics = each!(corner => edges[corner] * scale);
        let t = barycentrics[0] * depth[0] + barycentrics[1] * depth[1] + barycentrics[2] * depth[2];
        let best = f32x16::load_array_ref(simd, &self.hits.t[group]);
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
            let triangle = block.triangle(lane);
            let bounds = triangle.bounds();
            let planes = [bounds.min, bounds.max];
            let origin = Vec3::from_array(self.beam.origin);
            let inverse = &self.beam.inverse[group];
            let inverse = each!(axis => f32x16::load_array_ref(simd, &inverse[axis]));
            let near = each!(axis => {
                f32x16::splat(simd, planes[self.beam.near[axis] & 1][axis] - origin[axis]) * inverse[axis]
            });
            let far = each!(axis => {
                f32x16::splat(simd, planes[self.beam.near[axis] & 1 ^ 1][axis] - origin[axis]) * inverse[axis]
            });
            let entry = near[0].max(near[1]).max(near[2].max(t_min));
            let exit = far[0].min(far[1]).min(far[2]) * FAR_SLACK;
            let t = t.max(entry);
            let primitive = u32x16::splat(simd, block.primitive_index(lane));
            let best_primitive = u32x16::load_array_ref(simd, &self.hits.primitive[group]);
            let nearer = t.simd_lt(best) | (t.simd_eq(best) & primitive.simd_lt(best_primitive));
            // Rays that passed the sign test.
            let allowed = mask32x16::from_bitmask(simd, u64::from(candidates));
            let hit = allowed & within & entry.simd_le(exit) & entry.simd_le(best) & nearer;
            if hit.any_true() {
                let new_t = hit.select(t, best);
                let best_u = f32x16::load_array_ref(simd, &self.hits.u[group]);
                let best_v = f32x16::load_array_ref(simd, &self.hits.v[group]);
                self.hits.primitive[group] = hit.select(primitive, best_primitive).to_array();
                self.hits.t[group] = new_t.to_array();
                // After other stores: next to their loads, compilers would make these masked stores, which are slow on
                // AMD with AVX2.
                self.hits.u[group] = hit.select(barycentrics[1], best_u).to_array();
                self.hits.v[group] = hit.select(barycentrics[2], best_v).to_array();
                self.hits.group_t_max[group] = new_t.reduce_max();
            }
        }
        if uncertain != 0 {
            self.accept_uncertain(block, lane, group, uncertain, rays);
        }
    }

    /// Tests in double precision the rays that pass too close to an edge for single precision.
    #[cold]
    fn accept_uncertain(&mut self, block: TriangleBlock<'_>, lane: usize, group: usize, uncertain: u32, rays: &[Ray]) {
        let (triangle, primitive) = (block.triangle(lane), block.primitive_index(lane));
        for ray_lane in bits(u64::from(uncertain)) {
            let ray = rays[(group * GROUP + ray_lane).min(rays.len() - 1)];
            let best = self.hits.t[group][ray_lane];
            let hit = triangle.intersect(&PreparedRay::new(ray), &Shear::new(ray.direction), best);
            if let Some(hit) = hit
                && (hit.t < best || hit.t == best && primitive < self.hits.primitive[group][ray_lane])
            {
                self.hits.t[group][ray_lane] = hit.t;
                self.hits.u[group][ray_lane] = hit.u;
                self.hits.v[group][ray_lane] = hit.v;
                self.hits.primitive[group][ray_lane] = primitive;
            }
        }
        self.hits.group_t_max[group] = self.hits.t[group].into_iter().fold(f32::NEG_INFINITY, f32::max);
    }
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
