//! Blocks of up to four triangles, intersected side by side with the same result as [`Triangle::intersect`].

use fearless_simd::{Select, Simd, SimdBase, SimdMask, f32x4, mask32x4};
use glam::Vec3;

use crate::geometry::{EDGE_MAX, EDGE_MIN, ExactPlane, FAR_SLACK, PreparedRay, Ray, Shear, Triangle, TriangleHit};
use crate::kernel::bits::bits;
use crate::kernel::each;
use crate::tree::traverse::Nearest;
use crate::wide::layout::{BLOCK, COORDINATES, INDEX_MARK, NEEDLE_MARK, WINDOW};
use crate::wide::needles::are_needles;
use crate::wide::ray_lanes::TriangleLanes;

/// One to four triangles of a leaf, which are tested side by side. With `STRIDE` a row has as many numbers whatever there are triangles, as
/// of triangles that were moved from a block to where a copy stands.
#[derive(Debug, Clone, Copy)]
pub struct TriangleBlock<'a, const STRIDE: usize = 0> {
    /// For each axis and corner the coordinate of each triangle, then the indices of the triangles, and what follows.
    pub(crate) window: &'a [f32; WINDOW],
    /// Number of triangles.
    pub(crate) count: usize,
}

impl<const STRIDE: usize> TriangleBlock<'_, STRIDE> {
    /// Number of triangles, one to four.
    #[inline(always)]
    pub fn count(&self) -> usize {
        self.count & 7
    }

    /// Numbers in a row.
    #[inline(always)]
    fn stride(&self) -> usize {
        if STRIDE == 0 { self.count() } else { STRIDE }
    }

    /// One bit for each triangle.
    #[inline(always)]
    pub(crate) fn lanes(&self) -> u32 {
        (1 << self.count()) - 1
    }

    /// Index of a lane's triangle in the list that the tree was built from.
    #[inline(always)]
    pub fn primitive_index(&self, lane: usize) -> u32 {
        self.window[(self.stride() * COORDINATES + lane) & 63].to_bits() & !(INDEX_MARK | NEEDLE_MARK)
    }

    /// Whether a lane's triangle is a needle: long and thin, with distances of hits taken from its plane.
    #[inline(always)]
    pub(crate) fn is_needle(&self, lane: usize) -> bool {
        if STRIDE == 0 {
            self.window[(self.count() * COORDINATES + lane) & 63].to_bits() & NEEDLE_MARK != 0
        } else {
            self.triangle(lane).is_needle()
        }
    }

    /// Replaces the distances in `lanes`, of needles, by those of the planes along `ray`.
    #[inline(always)]
    fn plane_distances(&self, lanes: u32, ray: &Ray, distances: &mut [f32; BLOCK]) {
        for lane in bits(u64::from(lanes)) {
            let distance = &mut distances[lane % BLOCK];
            *distance = ExactPlane::new(&self.triangle(lane), ray.origin).distance(ray.direction, *distance);
        }
    }

    /// A number for each triangle, above 1, or negative where it is a needle: its marked index. With a `STRIDE` the marks are those of the
    /// triangles where they were before, and needles are found here: few rays get so far.
    #[inline(always)]
    pub(crate) fn marks<S: Simd>(&self, simd: S) -> f32x4<S> {
        let marks = f32x4::from_slice(simd, &self.window[(self.stride() * COORDINATES) & 63..][..BLOCK]);
        if STRIDE == 0 {
            return marks;
        }
        let [x, y, z] = each!(axis => self.corners(simd, 8 * axis as u32));
        let needles = are_needles(simd, each!(corner => [x[corner], y[corner], z[corner]]));
        let marks = marks.abs();
        needles.select(-marks, marks)
    }

    /// The first row of each axis, one in each byte.
    #[inline(always)]
    fn starts(&self) -> u32 {
        self.stride() as u32 * 0x06_03_00
    }

    /// A coordinate of the triangle in a lane.
    #[inline(always)]
    pub(crate) fn coordinate(&self, corner: usize, axis: usize, lane: usize) -> f32 {
        self.window[(self.stride() * (3 * axis + corner) + lane) & 63]
    }

    /// The triangle in a lane.
    #[inline]
    pub fn triangle(&self, lane: usize) -> Triangle {
        let corner = |corner: usize| Vec3::from_array(each!(axis => self.coordinate(corner, axis, lane)));
        Triangle { a: corner(0), b: corner(1), c: corner(2) }
    }

    /// Square of the distance from a point, whose coordinates are in all lanes, to the box of each triangle; see
    /// [`Container::distance_squared`](crate::tree::Container::distance_squared). Lanes without a triangle have any number.
    #[inline(always)]
    pub(crate) fn distances_squared<S: Simd>(&self, simd: S, point: [f32x4<S>; 3]) -> f32x4<S> {
        let zero = f32x4::splat(simd, 0.0);
        let outside = each!(axis => {
            let [a, b, c] = self.corners(simd, 8 * axis as u32);
            (a.min(b).min(c) - point[axis]).max(point[axis] - a.max(b).max(c)).max(zero)
        });
        outside[0] * outside[0] + outside[1] * outside[1] + outside[2] * outside[2]
    }

    /// Coordinates of the three corners on an axis; `shift` is eight times its number.
    #[inline(always)]
    pub(crate) fn corners<S: Simd>(&self, simd: S, shift: u32) -> [f32x4<S>; 3] {
        let stride = self.stride();
        // A shift takes less time than a multiplication. At most 24; by the mask the compiler sees that the window is never left.
        let start = (self.starts() >> (shift & 31) & 31) as usize;
        each!(corner => f32x4::from_slice(simd, &self.window[start + corner * stride..][..BLOCK]))
    }
}

/// A ray prepared for tests against blocks.
#[derive(Clone, Copy)]
pub(crate) struct BlockRay<'a, const N: usize> {
    rays: &'a TriangleLanes<N>,
    /// Index of the ray in `rays`.
    index: usize,
}

impl<'a, const N: usize> BlockRay<'a, N> {
    /// Ray `index` of `rays`.
    #[inline(always)]
    pub(crate) fn new(rays: &'a TriangleLanes<N>, index: usize) -> Self {
        Self { rays, index: index % N }
    }

    /// The ray's number in a row of `rays`, in all lanes.
    #[inline(always)]
    fn splat<S: Simd>(self, simd: S, row: &[f32; N]) -> f32x4<S> {
        f32x4::splat(simd, row[self.index])
    }

    /// Offers the hit with each triangle of `block` to `nearest`. `ray` is the ray that `self` was prepared from.
    #[inline(always)]
    pub(crate) fn closest_hit<S: Simd>(self, simd: S, block: TriangleBlock<'_>, ray: &Ray, nearest: &mut Nearest) {
        let t_max = nearest.t();
        let offer = |hit, primitive_index| {
            nearest.offer(hit, primitive_index);
        };
        self.each_hit(simd, block, ray, t_max, offer);
    }

    /// Calls `found` with the hit of each triangle of `block` up to `t_max`, and the triangle's index. `ray` is the ray that `self` was
    /// prepared from.
    #[inline(always)]
    pub(crate) fn each_hit<S: Simd, const STRIDE: usize>(
        self,
        simd: S,
        block: TriangleBlock<'_, STRIDE>,
        ray: &Ray,
        t_max: f32,
        mut found: impl FnMut(TriangleHit, u32),
    ) {
        let mut uncertain = self.each_certain_hit::<S, STRIDE, false>(simd, block, ray, t_max, &mut found);
        while uncertain != 0 {
            let lane = uncertain.trailing_zeros() as usize % BLOCK;
            uncertain &= uncertain - 1;
            if let Some(hit) = exact_hit(block, lane, ray, t_max) {
                found(hit, block.primitive_index(lane));
            }
        }
    }

    /// [`BlockRay::closest_hit`] without the triangles that take double precision, which it returns, one bit each.
    #[inline(always)]
    pub(crate) fn closest_certain_hit<S: Simd, const INLINE: bool>(
        self,
        simd: S,
        block: TriangleBlock<'_>,
        ray: &Ray,
        nearest: &mut Nearest,
    ) -> u32 {
        let t_max = nearest.t();
        let mut offer = |hit, primitive_index| {
            nearest.offer(hit, primitive_index);
        };
        self.each_certain_hit::<S, 0, INLINE>(simd, block, ray, t_max, &mut offer)
    }

    /// [`BlockRay::each_hit`] without the triangles that take double precision, which it returns, one bit each.
    #[inline(always)]
    fn each_certain_hit<S: Simd, const STRIDE: usize, const INLINE: bool>(
        self,
        simd: S,
        block: TriangleBlock<'_, STRIDE>,
        ray: &Ray,
        t_max: f32,
        found: &mut impl FnMut(TriangleHit, u32),
    ) -> u32 {
        let Some(plane_hits) = self.intersect_planes::<S, STRIDE, false, INLINE>(simd, block, ray, t_max) else {
            return 0;
        };
        let (entered, entry) = self.intersect_bounds(simd, block, t_max);
        let mut hits = plane_hits.hits & entered.to_bitmask() as u32;
        if hits != 0 {
            let t = plane_hits.t.max(entry).to_array();
            let [u, v] = [plane_hits.barycentrics[1].to_array(), plane_hits.barycentrics[2].to_array()];
            while hits != 0 {
                let lane = hits.trailing_zeros() as usize % BLOCK;
                hits &= hits - 1;
                found(TriangleHit { t: t[lane], u: u[lane], v: v[lane] }, block.primitive_index(lane));
            }
        }
        plane_hits.uncertain
    }

    /// One bit for each triangle of `block` whose box the ray enters up to `t_max`, and where it enters.
    #[inline(always)]
    pub(crate) fn entered<S: Simd>(self, simd: S, block: TriangleBlock<'_>, t_max: f32) -> (u32, [f32; BLOCK]) {
        let (entered, entry) = self.intersect_bounds(simd, block, t_max);
        (entered.to_bitmask() as u32 & block.lanes(), entry.to_array())
    }

    /// Whether the ray hits any triangle of `block` up to `t_max`; `self` was prepared from `ray`.
    #[inline(always)]
    pub(crate) fn any_hit<S: Simd, const STRIDE: usize>(
        self,
        simd: S,
        block: TriangleBlock<'_, STRIDE>,
        ray: &Ray,
        t_max: f32,
    ) -> bool {
        let (is_hit, uncertain) = self.any_certain_hit(simd, block, ray, t_max);
        is_hit
            || uncertain != 0
                && (0..BLOCK).any(|lane| uncertain >> lane & 1 != 0 && exact_hit(block, lane, ray, t_max).is_some())
    }

    /// [`BlockRay::any_hit`] without the triangles that take double precision, which it returns, one bit each.
    #[inline(always)]
    pub(crate) fn any_certain_hit<S: Simd, const STRIDE: usize>(
        self,
        simd: S,
        block: TriangleBlock<'_, STRIDE>,
        ray: &Ray,
        t_max: f32,
    ) -> (bool, u32) {
        let Some(plane_hits) = self.intersect_planes::<S, STRIDE, true, false>(simd, block, ray, t_max) else {
            return (false, 0);
        };
        let entered = self.intersect_bounds(simd, block, t_max).0.to_bitmask() as u32;
        (plane_hits.hits & entered != 0, plane_hits.uncertain)
    }

    /// Intersects the planes of the triangles; `None` if the ray misses all triangles.
    #[inline(always)]
    fn intersect_planes<S: Simd, const STRIDE: usize, const ANY: bool, const INLINE: bool>(
        self,
        simd: S,
        block: TriangleBlock<'_, STRIDE>,
        ray: &Ray,
        t_max: f32,
    ) -> Option<PlaneHits<S>> {
        let splat = |value| f32x4::splat(simd, value);
        let [x, y, z] = each!(part => {
            let corners = block.corners(simd, self.rays.axes[part][self.index]);
            let origin = self.splat(simd, &self.rays.sheared_origin[part]);
            each!(corner => corners[corner] - origin)
        });
        let factors = each!(part => self.splat(simd, &self.rays.factors[part]));
        let x = each!(corner => z[corner] * factors[0] + x[corner]);
        let y = each!(corner => z[corner] * factors[1] + y[corner]);
        let edges = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
        let min_edge = edges[0].min(edges[1]).min(edges[2]);
        let max_edge = edges[0].max(edges[1]).max(edges[2]);
        let missed = min_edge.simd_lt(splat(0.0)) & max_edge.simd_gt(splat(0.0));
        if !(missed.to_bitmask() as u32) & block.lanes() == 0 {
            return None;
        }
        // The edges of a candidate have the same sign, so that the smallest and the largest are also those by absolute value.
        let (smallest, largest) = (min_edge.abs().min(max_edge.abs()), min_edge.abs().max(max_edge.abs()));
        // The same comparison separates needles from all others.
        let plain = smallest.min(block.marks(simd)).simd_gt(splat(EDGE_MIN)) & largest.simd_lt(splat(EDGE_MAX));
        let scale = splat(1.0) / (edges[0] + edges[1] + edges[2]);
        let barycentrics = each!(corner => edges[corner] * scale);
        let depth = each!(corner => z[corner] * factors[2]);
        let t = barycentrics[0] * depth[0] + barycentrics[1] * depth[1] + barycentrics[2] * depth[2];
        let candidates = !(missed.to_bitmask() as u32) & block.lanes();
        let t_min = self.splat(simd, &self.rays.t_min);
        let (mut t, mut exact) = (t, plain);
        if candidates & !(plain.to_bitmask() as u32) != 0 {
            exact = smallest.simd_gt(splat(EDGE_MIN)) & largest.simd_lt(splat(EDGE_MAX));
            let low = depth[0].min(depth[1]).min(depth[2]);
            let high = depth[0].max(depth[1]).max(depth[2]);
            let needles = exact & !plain & !missed;
            t = self.needle_distances::<S, STRIDE, ANY, INLINE>(simd, block, ray, t_max, needles, [t, low, high]);
        }
        let within = t.simd_ge(t_min) & t.simd_le(splat(t_max));
        // Of half the blocks that get here (bunny) no plane is hit within the interval: they need no test of their boxes.
        let missed = missed | exact & !within;
        let candidates = !(missed.to_bitmask() as u32) & block.lanes();
        (candidates != 0).then(|| PlaneHits {
            t,
            barycentrics,
            hits: candidates & exact.to_bitmask() as u32,
            uncertain: candidates & !(exact.to_bitmask() as u32),
        })
    }

    /// The distances `t`, those of `needles` taken from their planes but no nearer than `low` and no farther than `high`. With `ANY`
    /// only where that decides on a hit.
    #[inline(always)]
    fn needle_distances<S: Simd, const STRIDE: usize, const ANY: bool, const INLINE: bool>(
        self,
        simd: S,
        block: TriangleBlock<'_, STRIDE>,
        ray: &Ray,
        t_max: f32,
        needles: mask32x4<S>,
        [t, low, high]: [f32x4<S>; 3],
    ) -> f32x4<S> {
        let (t_min, t_max) = (self.splat(simd, &self.rays.t_min), f32x4::splat(simd, t_max));
        let mut open = needles & low.simd_le(t_max) & high.simd_ge(t_min);
        if ANY {
            // It is enough that all of the triangle lies within the interval.
            open &= !(low.simd_ge(t_min) & high.simd_le(t_max));
        }
        let open = open.to_bitmask() as u32 & block.lanes();
        let mut distances = t;
        if open != 0 {
            let mut lanes = t.to_array();
            if INLINE {
                block.plane_distances(open, ray, &mut lanes);
            } else {
                plane_distances_outlined(block, open, ray, &mut lanes);
            }
            distances = f32x4::load_array(simd, lanes);
        }
        needles.select(distances.max(low).min(high), t)
    }

    /// Intersects the bounding box of each triangle up to `t_max`, as [`Triangle::hit_in_box`] does: whether and where
    /// the ray enters.
    #[inline(always)]
    fn intersect_bounds<S: Simd, const STRIDE: usize>(
        self,
        simd: S,
        block: TriangleBlock<'_, STRIDE>,
        t_max: f32,
    ) -> (mask32x4<S>, f32x4<S>) {
        let splat = |value| f32x4::splat(simd, value);
        let corners = each!(axis => block.corners(simd, 8 * axis as u32));
        let low = each!(axis => {
            let low_plane = corners[axis][0].min(corners[axis][1]).min(corners[axis][2]);
            (self.splat(simd, &self.rays.origin_low[axis]) - low_plane) * self.splat(simd, &self.rays.negative_inverse[axis])
        });
        let high = each!(axis => {
            let high_plane = corners[axis][0].max(corners[axis][1]).max(corners[axis][2]);
            (self.splat(simd, &self.rays.origin_high[axis]) - high_plane) * self.splat(simd, &self.rays.negative_inverse[axis])
        });
        let near = each!(axis => low[axis].min(high[axis]));
        let far = each!(axis => low[axis].max(high[axis]));
        let entry = near[0].max(near[1]).max(near[2].max(self.splat(simd, &self.rays.t_min)));
        let exit = far[0].min(far[1]).min(far[2]) * FAR_SLACK;
        (entry.simd_le(exit.min(splat(t_max))), entry)
    }
}

/// Intersections of a ray with the planes of a block's triangles, one per lane.
struct PlaneHits<S: Simd> {
    /// Distance along the ray.
    t: f32x4<S>,
    /// Barycentric coordinates, one for each corner.
    barycentrics: [f32x4<S>; 3],
    /// One bit for each triangle that the ray hits between `t_min` and `t_max`.
    hits: u32,
    /// One bit for each that single precision cannot decide: the ray passes too close to an edge.
    uncertain: u32,
}

/// [`TriangleBlock::plane_distances`] in a function of its own, where its registers would be missed in a loop.
#[cold]
#[inline(never)]
fn plane_distances_outlined<const STRIDE: usize>(
    block: TriangleBlock<'_, STRIDE>,
    lanes: u32,
    ray: &Ray,
    distances: &mut [f32; BLOCK],
) {
    block.plane_distances(lanes, ray, distances);
}

/// Intersection with a single triangle in double precision.
#[cold]
#[inline(never)]
fn exact_hit<const STRIDE: usize>(
    block: TriangleBlock<'_, STRIDE>,
    lane: usize,
    ray: &Ray,
    t_max: f32,
) -> Option<TriangleHit> {
    block.triangle(lane).intersect(&PreparedRay::new(*ray), &Shear::new(ray.direction), t_max)
}
