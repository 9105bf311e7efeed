//! Traversal of wide trees: single rays, packets of coherent rays from one point, and streams of incoherent rays. All
//! find the same hits.

pub(crate) mod all_hits;
pub(crate) mod beam;
mod cache_lines;
pub(crate) mod closest_point;
pub(crate) mod copies;
pub(crate) mod items;
pub mod packet;
pub(crate) mod packet_copies;
mod packet_tree;
pub(crate) mod single;
mod single_copies;
pub(crate) mod stack;
pub(crate) mod stream;
pub(crate) mod stream_copies;
mod walk;

pub(crate) use cache_lines::count_distinct;
pub use cache_lines::{CacheLines, LINE_BYTES, LineProbe};
use fearless_simd::{Level, Simd};
use glam::Vec3;

use crate::geometry::{Aabb, Hit, Ray};
use crate::kernel::simd::{baseline, dispatch};
use crate::query::{ClosestPoint, HitList, HitLists, NearestPoint};
use crate::tree::traverse::{NoProbe, Observer, Probe};
use crate::wide::trace::packet_tree::BoxTree;
use crate::wide::tree::{AnyWideTree, WideTree};
use crate::with_wide_tree;

/// Evaluates an expression at AVX2 or at the level of every machine, and returns its value: for oriented boxes, which are rarely traced
/// and long to compile.
macro_rules! return_at_few_levels {
    ($level:expr, $simd:ident => $body:expr) => {{
        #[cfg(target_arch = "x86_64")]
        if let Some($simd) = $level.as_avx2() {
            return $simd.vectorize(
                #[inline(always)]
                || $body,
            );
        }
        let $simd = baseline();
        return $body;
    }};
}

/// Evaluates an expression for any kind of tree at a SIMD level, for oriented boxes at few.
macro_rules! for_wide_tree {
    ($any:expr, $level:expr, $simd:ident, $tree:ident => $body:expr) => {
        match $any {
            AnyWideTree::Aabb($tree) => dispatch!($level, $simd => $body),
            AnyWideTree::Sphere($tree) => dispatch!($level, $simd => $body),
            AnyWideTree::Dop14($tree) => dispatch!($level, $simd => $body),
            AnyWideTree::Oriented($tree) => return_at_few_levels!($level, $simd => $body),
        }
    };
}

impl AnyWideTree {
    /// The closest hit of a ray: exactly that of the binary tree.
    // Not inlined, like all that follows: it is compiled once, here, instead of by each crate that traces.
    pub fn closest_hit(&self, level: Level, ray: &Ray) -> Option<Hit> {
        self.closest_hit_probed(level, ray, &mut NoProbe)
    }

    /// [`AnyWideTree::closest_hit`] with a `probe`, for which the test of a node's children is one container test and that of a
    /// block one primitive test.
    pub fn closest_hit_with<P: Probe>(&self, level: Level, ray: &Ray, probe: &mut P) -> Option<Hit> {
        self.closest_hit_observed(level, ray, probe.observer())
    }

    fn closest_hit_observed(&self, level: Level, ray: &Ray, observer: Observer<'_>) -> Option<Hit> {
        match observer {
            Observer::Nothing => self.closest_hit(level, ray),
            Observer::Counts(counts) => self.closest_hit_probed(level, ray, counts),
            // The same at every level, and not what one waits for: compiled for the baseline alone.
            Observer::Tests(mut probe) => {
                with_wide_tree!(self, tree => single::closest_hit(baseline(), tree, ray, &mut probe))
            }
            Observer::Events(mut probe) => {
                with_wide_tree!(self, tree => single::closest_hit(baseline(), tree, ray, &mut probe))
            }
        }
    }

    #[inline(always)]
    fn closest_hit_probed<P: Probe>(&self, level: Level, ray: &Ray, probe: &mut P) -> Option<Hit> {
        for_wide_tree!(self, level, simd, tree => single::closest_hit(simd, tree, ray, probe))
    }

    /// Whether anything lies on `ray` between its `t_min` and `t_max`.
    pub fn any_hit(&self, level: Level, ray: &Ray) -> bool {
        self.any_hit_probed(level, ray, &mut NoProbe)
    }

    /// [`AnyWideTree::any_hit`] with a `probe`, for which the test of a node's children is one container test and that of a
    /// block one primitive test.
    pub fn any_hit_with<P: Probe>(&self, level: Level, ray: &Ray, probe: &mut P) -> bool {
        self.any_hit_observed(level, ray, probe.observer())
    }

    fn any_hit_observed(&self, level: Level, ray: &Ray, observer: Observer<'_>) -> bool {
        match observer {
            Observer::Nothing => self.any_hit(level, ray),
            Observer::Counts(counts) => self.any_hit_probed(level, ray, counts),
            Observer::Tests(mut probe) => {
                with_wide_tree!(self, tree => single::any_hit(baseline(), tree, ray, &mut probe))
            }
            Observer::Events(mut probe) => {
                with_wide_tree!(self, tree => single::any_hit(baseline(), tree, ray, &mut probe))
            }
        }
    }

    #[inline(always)]
    fn any_hit_probed<P: Probe>(&self, level: Level, ray: &Ray, probe: &mut P) -> bool {
        for_wide_tree!(self, level, simd, tree => single::any_hit(simd, tree, ray, probe))
    }

    /// For each of `rays` whether anything lies on it, written to the first elements of `blocked`. Faster than ray by
    /// ray, above all for large trees.
    ///
    /// # Panics
    ///
    /// If `blocked` is shorter than `rays`.
    pub fn any_hits(&self, level: Level, rays: &[Ray], blocked: &mut [bool]) {
        assert!(blocked.len() >= rays.len(), "{} results for {} rays", blocked.len(), rays.len());
        for_wide_tree!(self, level, simd, tree => stream::any_hits(simd, tree, rays, blocked));
    }

    /// The closest hits of `rays`, the same as for single rays, written to the first elements of `hits`.
    ///
    /// Fast if the rays come from one point in similar directions and each sixteen consecutive rays are neighbours; correct for any rays.
    ///
    /// # Panics
    ///
    /// If `hits` is shorter than `rays`.
    pub fn closest_hits(&self, level: Level, rays: &[Ray], hits: &mut [Option<Hit>]) {
        if rays.len() < packet::FEW {
            assert!(hits.len() >= rays.len(), "{} hits for {} rays", hits.len(), rays.len());
            rays.iter().zip(hits).for_each(|(ray, hit)| *hit = self.closest_hit(level, ray));
            return;
        }
        match self {
            Self::Aabb(tree) => packet::closest_hits(level, tree, BoxTree::Aabb(tree), rays, hits),
            Self::Sphere(tree) => packet::closest_hits(level, tree, tree, rays, hits),
            Self::Dop14(tree) => packet::closest_hits(level, tree, BoxTree::Dop14(tree), rays, hits),
            // Without packets, which would be compiled for them, too.
            Self::Oriented(tree) => {
                assert!(hits.len() >= rays.len(), "{} hits for {} rays", hits.len(), rays.len());
                return_at_few_levels!(level, simd => stream::closest_hits(simd, tree, rays, hits))
            }
        }
    }

    /// The hits of `ray` into `hits`: each triangle once, by distance, at equal distances by index, at most the `max` nearest. Returns
    /// whether there are more.
    pub fn all_hits(&self, level: Level, ray: &Ray, max: usize, hits: &mut Vec<Hit>) -> bool {
        let mut list = HitList::new(hits, max, ray.t_max);
        self.add_all_hits(level, ray, &mut list);
        list.finish()
    }

    fn add_all_hits(&self, level: Level, ray: &Ray, list: &mut HitList<'_>) {
        with_wide_tree!(self, tree => return_at_few_levels!(level, simd => all_hits::all_hits(simd, tree, ray, list)));
    }

    /// [`AnyWideTree::all_hits`] of each of `rays`, into `lists`. Replaces what they held.
    pub fn hit_lists(&self, level: Level, rays: &[Ray], max: usize, lists: &mut HitLists) {
        lists.clear();
        let mut hits = Vec::new();
        for ray in rays {
            let has_more = self.all_hits(level, ray, max, &mut hits);
            lists.push(&hits, has_more);
        }
    }

    /// Calls `visit` with each item whose box `ray` meets, see [`ItemBvh::visit`](crate::ItemBvh::visit), for a tree over their stand-ins.
    pub(crate) fn visit_items(&self, level: Level, ray: &Ray, visit: items::Visit<'_>) {
        with_wide_tree!(self, tree => {
            return_at_few_levels!(level, simd => items::visit_items(simd, tree, ray, &mut NoProbe, visit))
        });
    }

    /// [`AnyWideTree::visit_items`] observed by `probe`.
    pub(crate) fn visit_items_with<P: Probe>(&self, ray: &Ray, probe: &mut P, visit: items::Visit<'_>) {
        with_wide_tree!(self, tree => items::visit_items(baseline(), tree, ray, probe, visit));
    }

    /// The point of the triangles that is nearest to `point`; `None` where none lies within `radius`, in world units, which may be
    /// infinite. Equal distances go to the lower index.
    pub fn closest_point(&self, level: Level, point: Vec3, radius: f32) -> Option<ClosestPoint> {
        let mut nearest = NearestPoint::new(point, radius)?;
        self.offer_points(level, &mut nearest);
        nearest.found()
    }

    /// [`AnyWideTree::closest_point`] of each of `points`, written to the first elements of `found`. Faster than point by point, above all
    /// where the nearest points of neighbours in the list lie close together.
    ///
    /// # Panics
    ///
    /// If `found` is shorter than `points`.
    pub fn closest_points(&self, level: Level, points: &[Vec3], radius: f32, found: &mut [Option<ClosestPoint>]) {
        assert!(found.len() >= points.len(), "{} results for {} points", found.len(), points.len());
        let mut last = None;
        for (point, found) in points.iter().zip(found) {
            *found = NearestPoint::new(*point, radius).and_then(|mut nearest| {
                // The triangle that is nearest to the point before: as a rule not much farther from this one than the nearest.
                if let Some((triangle, primitive_index)) = &last {
                    nearest.offer(triangle, *primitive_index);
                }
                self.offer_points(level, &mut nearest);
                last = nearest.triangle().or(last);
                nearest.found()
            });
        }
    }

    fn offer_points(&self, level: Level, nearest: &mut NearestPoint) {
        with_wide_tree!(self, tree => return_at_few_levels!(level, simd => closest_point::closest_point(simd, tree, nearest)));
    }
}

/// The nearest hit of a ray through a tree over copies, see [`single_copies::nearest`].
pub(crate) fn nearest_of_copies<'a, const ANY: bool>(
    level: Level,
    top: &WideTree<Aabb>,
    copy_of: impl Fn(u32) -> Option<(u32, copies::Copy<'a>)>,
    ray: &Ray,
) -> Option<copies::HitOfCopy> {
    return_at_few_levels!(level, simd => single_copies::nearest::<_, ANY>(simd, top, copy_of, ray))
}

/// `ray` prepared for [`each_hit_of_copy`]; `None` if it cannot hit anything.
pub(crate) fn world_ray(level: Level, ray: &Ray) -> Option<copies::WorldRay> {
    return_at_few_levels!(level, simd => copies::WorldRay::new(simd, ray))
}

/// The hits of a ray with a copy of a mesh, see [`copies::each_hit`].
pub(crate) fn each_hit_of_copy(
    level: Level,
    copy: copies::Copy<'_>,
    world: &copies::WorldRay,
    t_max: f32,
    found: copies::Found<'_>,
) {
    return_at_few_levels!(level, simd => copies::each_hit(simd, copy, world, t_max, &mut NoProbe, found))
}

/// [`each_hit_of_copy`] observed by `probe`.
pub(crate) fn each_hit_of_copy_with<P: Probe>(
    copy: copies::Copy<'_>,
    world: &copies::WorldRay,
    t_max: f32,
    probe: &mut P,
    found: copies::Found<'_>,
) {
    copies::each_hit(baseline(), copy, world, t_max, probe, found);
}
