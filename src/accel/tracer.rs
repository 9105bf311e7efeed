//! The tracer: batches of nearest hits, of shadow rays, and of rays whose work is counted. Pictures and measurements hold a
//! [`Tracer`] and know neither how its trees are made nor what they consist of. It is called once a batch, never once a node.

use fearless_simd::Level;

use bvhscope_engine::SimdLevel;
use bvhscope_engine::geometry::{Hit, Ray};
use bvhscope_engine::query::{self, ClosestPoint};
use bvhscope_engine::tree::traverse::{IndexedTriangles, NoProbe, Probe, StackEntry, TestCounts, Traversal, new_stack};
use bvhscope_engine::wide::AnyWideTree;
use bvhscope_engine::wide::trace::{CacheLines, LineProbe};
use bvhscope_engine::with_tree;
use glam::Vec3;

use super::Accel;

/// Work of a ray that looks for the nearest hit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Counting {
    /// Nothing: the binary tree is traced for its time.
    Nothing,
    /// Tests in the binary tree.
    Tests,
    /// Steps through the wide tree: nodes whose children are tested, and blocks of triangles.
    Steps,
    /// Cache lines of the wide tree, each once a ray: of nodes in place of containers, of triangles in place of primitives.
    Lines,
    /// Containers of the binary tree that the whole ray enters, as if nothing stopped it.
    WholeRay,
    /// Copies of meshes that the ray is carried into, in place of containers; none in a flat scene.
    Copies,
}

/// A query of rays one by one: behind a hit that does not count a ray is traced again, and the work of that is counted too.
#[derive(Clone, Copy)]
pub struct CountedQuery<'a> {
    /// The counted work.
    pub counting: Counting,
    /// The order in which the binary tree is visited.
    pub traversal: Traversal,
    /// Whether rays pass through the triangle of this index.
    pub passes: &'a (dyn Fn(u32) -> bool + Sync),
}

/// Something that finds the hits of rays with the triangles of one scene. All of them find the same.
pub trait Tracer: Send + Sync {
    /// The nearest hits of `rays`, into the first elements of `hits`. Fastest for rays from one point in similar directions.
    fn nearest(&self, rays: &[Ray], hits: &mut [Option<Hit>]);

    /// Whether anything lies on each of `rays`, into the first elements of `blocked`.
    fn blocked(&self, rays: &[Ray], blocked: &mut [bool]);

    /// The nearest hits of `rays` that count, with the work of each, into the first elements of `found`.
    fn counted(&self, rays: &[Ray], query: CountedQuery<'_>, found: &mut [(Option<Hit>, TestCounts)]);

    /// All hits of `ray`, the nearest first, at most `max`, into `hits`. Returns whether there are more.
    fn all_hits(&self, ray: &Ray, max: usize, hits: &mut Vec<Hit>) -> bool;

    /// The work of a query for all hits of `ray`.
    fn all_hits_tests(&self, ray: &Ray) -> TestCounts;

    /// The point of the triangles that is nearest to `point`.
    fn closest_point(&self, point: Vec3) -> Option<ClosestPoint>;

    /// The work of a query for that point.
    fn closest_point_tests(&self, point: Vec3) -> TestCounts;
}

/// The trees of an [`Accel`] over triangles, on the CPU.
pub(super) struct TreeTracer<'a> {
    accel: &'a Accel,
    /// Without it the binary tree gives the same hits, for a first coarse picture that does not wait for it.
    wide: Option<&'a AnyWideTree>,
    level: Level,
}

impl<'a> TreeTracer<'a> {
    pub(super) fn new(accel: &'a Accel, simd: SimdLevel) -> Self {
        Self { accel, wide: accel.known_wide().map(|wide| &wide.tree), level: simd.level() }
    }

    /// The triangles by the indices of the tree: a coarse picture does not wait until they are in leaf order.
    fn indexed<'t>(&'t self, indices: &'t [u32]) -> IndexedTriangles<'t> {
        IndexedTriangles { triangles: &self.accel.scene.triangles, indices }
    }

    /// Traces `rays` through the binary tree with a probe for each.
    fn through_binary<P: Probe + Default>(
        &self,
        rays: &[Ray],
        query: CountedQuery<'_>,
        found: &mut [(Option<Hit>, TestCounts)],
        counts: fn(P) -> TestCounts,
    ) {
        let (tree, triangles) = (&self.accel.tree, self.accel.leaf_triangles());
        let mut stack = new_stack(tree.max_depth());
        count_each(rays, query, found, counts, |ray, probe| {
            tree.closest_hit_with(self.level, triangles, ray, query.traversal, &mut stack, probe)
        });
    }

    /// The nearest hit of a ray through the binary tree, and the number of containers that all of it enters, each once whatever is hidden.
    fn along_whole_ray(&self, ray: &Ray, query: CountedQuery<'_>, stack: &mut [StackEntry]) -> (Option<Hit>, u64) {
        let (tree, triangles) = (&self.accel.tree, self.accel.leaf_triangles());
        let mut entered = Entered(0);
        // Nothing is culled in the paper's order, so that it visits whatever the ray enters.
        let mut hit = tree.closest_hit_with(self.level, triangles, ray, Traversal::Paper, stack, &mut entered);
        if hit.is_some_and(|hit| (query.passes)(hit.primitive_index)) {
            hit = first_that_counts(*ray, query.passes, |ray| {
                tree.closest_hit_with(self.level, triangles, ray, Traversal::Ordered, stack, &mut NoProbe)
            });
        }
        (hit, entered.0)
    }
}

impl Tracer for TreeTracer<'_> {
    fn nearest(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        match self.wide {
            Some(wide) => wide.closest_hits(self.level, rays, hits),
            None => {
                for (hit, ray) in hits.iter_mut().zip(rays) {
                    *hit = self.accel.tree.closest_hit_indexed(&self.accel.scene.triangles, ray);
                }
            }
        }
    }

    fn blocked(&self, rays: &[Ray], blocked: &mut [bool]) {
        match self.wide {
            Some(wide) => wide.any_hits(self.level, rays, blocked),
            None => {
                for (blocked, ray) in blocked.iter_mut().zip(rays) {
                    *blocked = self.accel.tree.any_hit_indexed(&self.accel.scene.triangles, ray);
                }
            }
        }
    }

    fn counted(&self, rays: &[Ray], query: CountedQuery<'_>, found: &mut [(Option<Hit>, TestCounts)]) {
        match query.counting {
            Counting::Nothing | Counting::Copies => {
                self.through_binary(rays, query, found, |_: NoProbe| TestCounts::default());
            }
            Counting::Tests => self.through_binary(rays, query, found, |counts: TestCounts| counts),
            Counting::Steps => {
                let wide = &self.accel.wide().tree;
                for (ray, (hit, counts)) in rays.iter().zip(found) {
                    *counts = TestCounts::default();
                    *hit = first_that_counts(*ray, query.passes, |ray| wide.closest_hit_with(self.level, ray, counts));
                }
            }
            Counting::Lines => {
                let wide = &self.accel.wide().tree;
                let mut probe = LineProbe::new(wide);
                for (ray, found) in rays.iter().zip(found) {
                    let hit =
                        first_that_counts(*ray, query.passes, |ray| wide.closest_hit_with(self.level, ray, &mut probe));
                    let CacheLines { nodes, triangles } = probe.take();
                    *found = (hit, TestCounts { containers: nodes, primitives: triangles });
                }
            }
            Counting::WholeRay => {
                let mut stack = new_stack(self.accel.tree.max_depth());
                for (ray, found) in rays.iter().zip(found) {
                    let (hit, containers) = self.along_whole_ray(ray, query, &mut stack);
                    *found = (hit, TestCounts { containers, primitives: 0 });
                }
            }
        }
    }

    fn all_hits(&self, ray: &Ray, max: usize, hits: &mut Vec<Hit>) -> bool {
        match self.wide {
            Some(wide) => wide.all_hits(self.level, ray, max, hits),
            None => with_tree!(&self.accel.tree, tree => {
                query::all_hits(tree, self.indexed(&tree.primitive_indices), ray, max, hits)
            }),
        }
    }

    fn all_hits_tests(&self, ray: &Ray) -> TestCounts {
        let mut counts = TestCounts::default();
        with_tree!(&self.accel.tree, tree => {
            let triangles = self.accel.leaf_triangles();
            query::all_hits_counted(tree, triangles, ray, usize::MAX, &mut Vec::new(), &mut counts);
        });
        counts
    }

    fn closest_point(&self, point: Vec3) -> Option<ClosestPoint> {
        match self.wide {
            Some(wide) => wide.closest_point(self.level, point, f32::INFINITY),
            None => with_tree!(&self.accel.tree, tree => {
                query::closest_point(tree, self.indexed(&tree.primitive_indices), point, f32::INFINITY, &mut NoProbe)
            }),
        }
    }

    fn closest_point_tests(&self, point: Vec3) -> TestCounts {
        let mut counts = TestCounts::default();
        with_tree!(&self.accel.tree, tree => {
            query::closest_point(tree, self.accel.leaf_triangles(), point, f32::INFINITY, &mut counts)
        });
        counts
    }
}

/// The first hit of `closest` whose triangle the ray does not pass through. Behind others the ray is traced again.
#[inline(always)]
pub fn first_that_counts(
    mut ray: Ray,
    passes: impl Fn(u32) -> bool,
    mut closest: impl FnMut(&Ray) -> Option<Hit>,
) -> Option<Hit> {
    loop {
        let hit = closest(&ray)?;
        if !passes(hit.primitive_index) {
            return Some(hit);
        }
        // The same ray finds the same t on the same triangle again, so the next larger t excludes it.
        ray.t_min = hit.t.next_up();
    }
}

/// Traces `rays` with a probe for each, by `closest`, which finds the nearest hit.
pub(super) fn count_each<P: Probe + Default>(
    rays: &[Ray],
    query: CountedQuery<'_>,
    found: &mut [(Option<Hit>, TestCounts)],
    counts: fn(P) -> TestCounts,
    mut closest: impl FnMut(&Ray, &mut P) -> Option<Hit>,
) {
    for (ray, found) in rays.iter().zip(found) {
        let mut probe = P::default();
        let hit = first_that_counts(*ray, query.passes, |ray| closest(ray, &mut probe));
        *found = (hit, counts(probe));
    }
}

/// Counts the copies that a ray is carried into.
#[derive(Default)]
pub(super) struct Carried(pub(super) u64);

impl Probe for Carried {
    #[inline(always)]
    fn container_test(&mut self) {}
    #[inline(always)]
    fn primitive_test(&mut self) {}
    #[inline(always)]
    fn carried(&mut self, _copy: u32) {
        self.0 += 1;
    }
}

/// Counts the nodes that a ray visits.
pub(super) struct Entered(pub(super) u64);

impl Probe for Entered {
    #[inline(always)]
    fn container_test(&mut self) {}
    #[inline(always)]
    fn primitive_test(&mut self) {}
    #[inline(always)]
    fn visited(&mut self, _node: u32) {
        self.0 += 1;
    }
    #[inline(always)]
    fn visited_below(&mut self) {
        self.0 += 1;
    }
}
