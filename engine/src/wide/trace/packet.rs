//! Tiles of coherent rays from one point, such as a camera's: nodes and triangles are fetched once for all of them.
//!
//! Each visit tests a node's eight children against all directions at once, which most children fail or pass as a whole, and
//! only then those that are unclear against the groups of sixteen rays that reached the node (after Wald, Boulos, Shirley: *Ray
//! Tracing Deformable Scenes Using Dynamic Bounding Volume Hierarchies*, 2007). The hits are those of single rays.

use fearless_simd::{Level, Select, Simd, SimdBase, SimdMask, dispatch, f32x16, mask32x16, u32x16};
use glam::Vec3;

use crate::geometry::{EDGE_MAX, EDGE_MIN, FAR_SLACK, Hit, PreparedRay, Ray, Shear};
use crate::kernel::bits::bits;
use crate::kernel::each;
use crate::wide::block::TriangleBlock;
use crate::wide::block::permuted_axes;
use crate::wide::layout::BLOCK;
use crate::wide::layout::WIDTH;
use crate::wide::ray_lanes::{RAY_LANES, transposed};
use crate::wide::trace::beam::{Beam, BeamContainer, GROUP, GROUPS};
use crate::wide::trace::stack::{Stack, Waiting};
use crate::wide::trace::stream;
use crate::wide::tree::WideTree;

/// Rays that one packet takes.
pub const MAX_RAYS: usize = GROUP * GROUPS;
/// Stands for no triangle: loses every tie.
const NONE: u32 = u32::MAX;

/// The nearest hits of `rays`, exactly those that each ray finds alone, into the first elements of `hits`.
///
/// Fast where the rays come from one point in similar directions, and neighbours stand together in sixteens; right for all.
///
/// # Panics
///
/// Where `hits` is shorter than `rays`.
pub fn closest_hits<C: BeamContainer>(level: Level, tree: &WideTree<C>, rays: &[Ray], hits: &mut [Option<Hit>]) {
    assert!(hits.len() >= rays.len(), "{} hits for {} rays", hits.len(), rays.len());
    // Rays that have little in common go together, the more the better.
    let mut traced = 0;
    for first in (0..rays.len()).step_by(MAX_RAYS) {
        let end = rays.len().min(first + MAX_RAYS);
        let (rays_before, rays) = rays[traced..end].split_at(first - traced);
        let (hits_before, hits) = hits[traced..end].split_at_mut(first - traced);
        if dispatch!(level, simd => closest_hits_of_packet(simd, tree, rays, hits)) {
            dispatch!(level, simd => stream::closest_hits(simd, tree, rays_before, hits_before));
            traced = end;
        }
    }
    dispatch!(level, simd => stream::closest_hits(simd, tree, &rays[traced..], &mut hits[traced..]));
}

/// Whether `rays` are alike enough for a packet; then their hits.
#[inline(always)]
fn closest_hits_of_packet<S: Simd, C: BeamContainer>(
    simd: S,
    tree: &WideTree<C>,
    rays: &[Ray],
    hits: &mut [Option<Hit>],
) -> bool {
    let Some(mut packet) = Packet::<C>::new(simd, rays) else { return false };
    packet.trace(simd, tree, rays);
    for (index, hit) in hits.iter_mut().enumerate() {
        *hit = packet.found.hit(index);
    }
    true
}

/// What the rays have found so far, group by group.
struct Found {
    t: [[f32; GROUP]; GROUPS],
    u: [[f32; GROUP]; GROUPS],
    v: [[f32; GROUP]; GROUPS],
    primitive: [[u32; GROUP]; GROUPS],
    /// The largest `t` of each group.
    limit: [f32; GROUPS],
}

impl Found {
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

/// Rays from one point whose directions agree in all signs and in their longest axis.
struct Packet<C: BeamContainer> {
    beam: Beam,
    /// What tests against the containers need on top.
    more: C::More,
    /// The axes of the shear, the longest last.
    axes: [usize; 3],
    /// One bit for each group with rays.
    all_groups: u32,
    /// The factors of [`Shear`]'s rows.
    factors: [[[f32; GROUP]; 3]; GROUPS],
    found: Found,
}

impl<C: BeamContainer> Packet<C> {
    /// Prepares rays; `None` where they are not alike enough.
    #[inline(always)]
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
            more: C::NO_RAYS,
            axes,
            all_groups: u32::MAX >> (GROUPS - groups),
            factors: [[[0.0; GROUP]; 3]; GROUPS],
            found: Found {
                t: [[0.0; GROUP]; GROUPS],
                u: [[0.0; GROUP]; GROUPS],
                v: [[0.0; GROUP]; GROUPS],
                primitive: [[NONE; GROUP]; GROUPS],
                limit: [0.0; GROUPS],
            },
        };
        let zero = f32x16::splat(simd, 0.0);
        let one = f32x16::splat(simd, 1.0);
        let mut lowest = [f32x16::splat(simd, f32::INFINITY); 3];
        let mut highest = [f32x16::splat(simd, f32::NEG_INFINITY); 3];
        for group in 0..groups {
            // The last ray fills the lanes that follow.
            let rays = &rays[group * GROUP..];
            let others = if rays.len() > RAY_LANES { &rays[RAY_LANES..] } else { &rays[rays.len() - 1..] };
            let (rays, others) = (transposed(simd, rays), transposed(simd, others));
            let number = |part: usize| simd.combine_f32x8(rays[part], others[part]);
            let d = each!(axis => number(3 + axis));
            let (given_t_min, t_max) = (number(6), number(7));
            let is_own_t_min = if t_min > 0.0 {
                given_t_min.simd_eq(f32x16::splat(simd, t_min))
            } else {
                // A NaN counts as 0.
                !given_t_min.simd_gt(zero)
            };
            let alike = number(0).simd_eq(f32x16::splat(simd, first.origin.x))
                & number(1).simd_eq(f32x16::splat(simd, first.origin.y))
                & number(2).simd_eq(f32x16::splat(simd, first.origin.z))
                & is_own_t_min
                & t_max.simd_ge(f32x16::splat(simd, t_min));
            let inverse = each!(axis => one / d[axis]);
            let along = d[axes[2]];
            let longest = along.abs();
            // The first of equal axes is the longest one.
            let is_longest = each!(axis => {
                let other = d[axis].abs();
                if axis < axes[2] { longest.simd_gt(other) } else { longest.simd_ge(other) }
            });
            let squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            let mut good = is_longest[axes[0]]
                & is_longest[axes[1]]
                & squared.simd_ge(f32x16::splat(simd, f32::MIN_POSITIVE))
                & squared.simd_le(f32x16::splat(simd, f32::MAX));
            for axis in 0..3 {
                // The same sign as the first, not zero, and not so small that its inverse overflows.
                let same = if near[axis] == 1 { d[axis].simd_lt(zero) } else { d[axis].simd_gt(zero) };
                good = good & same & inverse[axis].abs().simd_le(f32x16::splat(simd, f32::MAX));
                lowest[axis] = lowest[axis].min(inverse[axis]);
                highest[axis] = highest[axis].max(inverse[axis]);
                packet.beam.inverse[group][axis] = inverse[axis].to_array();
            }
            if !(alike & good).all_true() {
                return None;
            }
            C::add_rays(simd, &mut packet.more, group, d, axes);
            let factors = [(zero - d[axes[0]]) / along, (zero - d[axes[1]]) / along, inverse[axes[2]]];
            packet.factors[group] = each!(part => factors[part].to_array());
            let t_max = t_max.min(f32x16::splat(simd, f32::MAX));
            packet.found.t[group] = t_max.to_array();
            packet.found.limit[group] = t_max.reduce_max();
        }
        C::enclose(&mut packet.more, &packet.beam, axes);
        packet.beam.range = each!(axis => [lowest[axis].reduce_min(), highest[axis].reduce_max()]);
        Some(packet)
    }

    #[inline(always)]
    fn trace<S: Simd>(&mut self, simd: S, tree: &WideTree<C>, rays: &[Ray]) {
        let Some(root) = tree.root else { return };
        let mut stack = Stack::default();
        stack.push(Waiting { entry: self.beam.t_min, child: root, groups: self.all_groups });
        while let Some(Waiting { entry, child, groups }) = stack.pop() {
            // Groups whose rays have all found something nearer are done.
            let limits = f32x16::load_array_ref(simd, &self.found.limit);
            let open = limits.simd_ge(f32x16::splat(simd, entry)) & mask32x16::from_bitmask(simd, u64::from(groups));
            let active = open.to_bitmask() as u32;
            if active == 0 {
                continue;
            }
            let reach = open.select(limits, f32x16::splat(simd, f32::NEG_INFINITY)).reduce_max();
            if child.is_leaf() {
                for block in &tree.blocks[child.index()..] {
                    self.test_block(simd, block, active, rays);
                    if block.is_last() {
                        break;
                    }
                }
                continue;
            }
            let node = &tree.nodes[child.index()];
            let interval = C::interval(simd, &node.bounds, &self.beam, &self.more, reach);
            let mark = stack.mark();
            for lane in bits(u64::from(interval.some)) {
                let lane = lane % WIDTH;
                let groups = if interval.all >> lane & 1 != 0 {
                    active
                } else {
                    self.groups_that_enter(simd, &interval.offsets, lane, active)
                };
                if groups != 0 {
                    tree.prefetch(node.children[lane]);
                    stack.push(Waiting { entry: interval.entry[lane], child: node.children[lane], groups });
                    stack.sort_last(mark);
                }
            }
        }
    }

    /// Those of the `active` groups of which some ray enters the child in a lane.
    #[inline(always)]
    fn groups_that_enter<S: Simd>(&self, simd: S, offsets: &C::Offsets, lane: usize, active: u32) -> u32 {
        let child = C::spread(simd, offsets, lane);
        let mut entering = 0;
        for group in bits(u64::from(active)) {
            let t = f32x16::load_array_ref(simd, &self.found.t[group % GROUPS]);
            let enters = C::enters(simd, &child, &self.beam, &self.more, group % GROUPS, t);
            entering |= u32::from(enters.any_true()) << group;
        }
        entering
    }

    /// Tests the triangles of a block against the `active` groups.
    #[inline(always)]
    fn test_block<S: Simd>(&mut self, simd: S, block: &TriangleBlock, active: u32, rays: &[Ray]) {
        for lane in 0..BLOCK {
            let primitive = block.primitive_index(lane);
            // The last triangle fills the last block of a leaf, and fragments of one can follow one another anywhere.
            if lane > 0 && primitive == block.primitive_index(lane - 1) {
                continue;
            }
            let [corner_x, corner_y, corner_z] = each!(part => each!(corner => {
                let axis = self.axes[part];
                f32x16::splat(simd, block.corners[corner][axis][lane] - self.beam.origin[axis])
            }));
            for group in bits(u64::from(active)) {
                let group = group % GROUPS;
                let factors = &self.factors[group];
                let factors = each!(part => f32x16::load_array_ref(simd, &factors[part]));
                let x = each!(corner => corner_z[corner] * factors[0] + corner_x[corner]);
                let y = each!(corner => corner_z[corner] * factors[1] + corner_y[corner]);
                let weights = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
                let least = weights[0].min(weights[1]).min(weights[2]);
                let most = weights[0].max(weights[1]).max(weights[2]);
                let candidates = !(least.simd_lt(f32x16::splat(simd, 0.0)) & most.simd_gt(f32x16::splat(simd, 0.0)));
                if candidates.any_true() {
                    let depth = each!(corner => corner_z[corner] * factors[2]);
                    self.take(simd, block, lane, group, weights, depth, candidates.to_bitmask() as u32, rays);
                }
            }
        }
    }

    /// Takes the hits of a triangle with a group's rays, of which only the `candidates` can be some.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "the second half of `test_block`, cut where it gets rare")]
    fn take<S: Simd>(
        &mut self,
        simd: S,
        block: &TriangleBlock,
        lane: usize,
        group: usize,
        weights: [f32x16<S>; 3],
        depth: [f32x16<S>; 3],
        candidates: u32,
        rays: &[Ray],
    ) {
        let size = each!(corner => weights[corner].abs());
        let exact = size[0].min(size[1]).min(size[2]).simd_gt(f32x16::splat(simd, EDGE_MIN))
            & size[0].max(size[1]).max(size[2]).simd_lt(f32x16::splat(simd, EDGE_MAX));
        let scale = f32x16::splat(simd, 1.0) / (weights[0] + weights[1] + weights[2]);
        let shares = each!(corner => weights[corner] * scale);
        let t = shares[0] * depth[0] + shares[1] * depth[1] + shares[2] * depth[2];
        let best = f32x16::load_array_ref(simd, &self.found.t[group]);
        let t_min = f32x16::splat(simd, self.beam.t_min);
        let within = exact & t.simd_ge(t_min) & t.simd_le(best);
        let unclear = candidates & !(exact.to_bitmask() as u32);
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
            let best_primitive = u32x16::load_array_ref(simd, &self.found.primitive[group]);
            let nearer = t.simd_lt(best) | (t.simd_eq(best) & primitive.simd_lt(best_primitive));
            // A mask of lanes from the bits that remain after the sign test.
            let allowed = mask32x16::from_bitmask(simd, u64::from(candidates));
            let hit = allowed & within & entry.simd_le(exit) & entry.simd_le(best) & nearer;
            if hit.any_true() {
                let new_t = hit.select(t, best);
                let best_u = f32x16::load_array_ref(simd, &self.found.u[group]);
                let best_v = f32x16::load_array_ref(simd, &self.found.v[group]);
                self.found.primitive[group] = hit.select(primitive, best_primitive).to_array();
                self.found.t[group] = new_t.to_array();
                // After other stores: next to their loads, compilers would make these masked stores, slow on AMD under AVX2.
                self.found.u[group] = hit.select(shares[1], best_u).to_array();
                self.found.v[group] = hit.select(shares[2], best_v).to_array();
                self.found.limit[group] = new_t.reduce_max();
            }
        }
        if unclear != 0 {
            self.take_unclear(block, lane, group, unclear, rays);
        }
    }

    /// The rays that pass so near an edge that single precision cannot tell on which side.
    #[cold]
    fn take_unclear(&mut self, block: &TriangleBlock, lane: usize, group: usize, unclear: u32, rays: &[Ray]) {
        let (triangle, primitive) = (block.triangle(lane), block.primitive_index(lane));
        for ray_lane in bits(u64::from(unclear)) {
            let ray = rays[(group * GROUP + ray_lane).min(rays.len() - 1)];
            let best = self.found.t[group][ray_lane];
            let hit = triangle.intersect(&PreparedRay::new(ray), &Shear::new(ray.direction), best);
            if let Some(hit) = hit
                && (hit.t < best || hit.t == best && primitive < self.found.primitive[group][ray_lane])
            {
                self.found.t[group][ray_lane] = hit.t;
                self.found.u[group][ray_lane] = hit.u;
                self.found.v[group][ray_lane] = hit.v;
                self.found.primitive[group][ray_lane] = primitive;
            }
        }
        self.found.limit[group] = self.found.t[group].into_iter().fold(f32::NEG_INFINITY, f32::max);
    }
}
