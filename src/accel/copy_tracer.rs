//! The tracer through both levels of a scene of copies.

use bvhscope_engine::geometry::{Aabb, Hit, Ray, Triangle};
use bvhscope_engine::query::ClosestPoint;
use bvhscope_engine::tree::Tree;
use bvhscope_engine::tree::traverse::{NoProbe, Probe, TestCounts, Traversal};
use bvhscope_engine::wide::trace::{CacheLines, LineProbe};
use bvhscope_engine::{AnyTree, BinaryLevels, InstanceHit, Unfolded};
use glam::Vec3;

use super::tracer::{Carried, CountedQuery, Counting, Entered, Tracer, count_each, first_that_counts};
use super::two_levels::{TwoLevels, boxes};

/// Rays through both levels, of which `top` is the tree over the copies.
pub(super) struct CopyTracer<'a> {
    levels: &'a TwoLevels,
    top: &'a Tree<Aabb>,
    /// The triangles of each mesh.
    triangles: Vec<&'a [Triangle]>,
    /// The nodes that probes are told of, where meshes are unfolded.
    unfolded: Option<&'a Unfolded>,
}

impl<'a> CopyTracer<'a> {
    pub(super) fn new(levels: &'a TwoLevels, shown: &'a AnyTree) -> Self {
        let (top, unfolded) = (boxes(levels.top(shown)), levels.unfolded());
        let meshes = 0..levels.scene.mesh_count() as u32;
        let triangles = meshes.map(|mesh| levels.scene.mesh(mesh)).collect();
        Self { levels, top, triangles, unfolded }
    }

    /// The binary trees.
    pub(super) fn binary(&self) -> BinaryLevels<'_> {
        let (copies, triangles) = (self.levels.wide.copies(), &self.triangles[..]);
        BinaryLevels { copies, top: self.top, triangles, unfolded: self.unfolded }
    }

    /// A hit by the number of its triangle in the flat scene.
    fn numbered(&self, hit: InstanceHit) -> Hit {
        Hit { t: hit.t, primitive_index: self.levels.number(&hit), u: hit.u, v: hit.v }
    }

    /// The nearest hit through the wide trees.
    pub(super) fn nearest_of(&self, ray: &Ray) -> Option<Hit> {
        self.levels.wide.closest_hit(ray).map(|hit| self.numbered(hit))
    }

    /// The same hit through the binary ones.
    pub(super) fn closest<P: Probe>(&self, ray: &Ray, traversal: Traversal, probe: &mut P) -> Option<Hit> {
        self.binary().closest_hit(ray, traversal, probe).map(|hit| self.numbered(hit))
    }

    /// The nearest hit of a ray, and the number of containers of both levels that all of it enters.
    fn along_whole_ray(&self, ray: &Ray, query: CountedQuery<'_>) -> (Option<Hit>, u64) {
        let mut entered = Entered(0);
        let mut hit = self.closest(ray, Traversal::Paper, &mut entered);
        if hit.is_some_and(|hit| (query.passes)(hit.primitive_index)) {
            hit = first_that_counts(*ray, query.passes, |ray| self.closest(ray, Traversal::Ordered, &mut NoProbe));
        }
        (hit, entered.0)
    }

    /// Traces `rays` through the binary trees with a probe for each.
    fn through_binary<P: Probe + Default>(
        &self,
        rays: &[Ray],
        query: CountedQuery<'_>,
        found: &mut [(Option<Hit>, TestCounts)],
        counts: fn(P) -> TestCounts,
    ) {
        count_each(rays, query, found, counts, |ray, probe| self.closest(ray, query.traversal, probe));
    }

    /// Traces `rays` through wide trees, of which each has a probe; `take` gives and forgets what one has counted.
    fn through_wide<P: Probe>(
        &self,
        rays: &[Ray],
        query: CountedQuery<'_>,
        found: &mut [(Option<Hit>, TestCounts)],
        (top, meshes): (&mut P, &mut [P]),
        take: fn(&mut P) -> TestCounts,
    ) {
        for (ray, found) in rays.iter().zip(found) {
            let hit = first_that_counts(*ray, query.passes, |ray| {
                self.levels.wide.closest_hit_with(ray, top, meshes).map(|hit| self.numbered(hit))
            });
            *found = (hit, take(top) + meshes.iter_mut().map(take).sum());
        }
    }
}

impl Tracer for CopyTracer<'_> {
    fn nearest(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        let mut found = vec![None; rays.len()];
        self.levels.wide.closest_hits(rays, &mut found);
        for (hit, found) in hits.iter_mut().zip(found) {
            *hit = found.map(|hit| self.numbered(hit));
        }
    }

    fn blocked(&self, rays: &[Ray], blocked: &mut [bool]) {
        self.levels.wide.any_hits(rays, blocked);
    }

    fn counted(&self, rays: &[Ray], query: CountedQuery<'_>, found: &mut [(Option<Hit>, TestCounts)]) {
        match query.counting {
            Counting::Nothing => self.through_binary(rays, query, found, |_: NoProbe| TestCounts::default()),
            Counting::Tests => self.through_binary(rays, query, found, |counts: TestCounts| counts),
            Counting::Copies => {
                let counts = |Carried(containers): Carried| TestCounts { containers, primitives: 0 };
                self.through_binary(rays, query, found, counts);
            }
            Counting::WholeRay => {
                for (ray, found) in rays.iter().zip(found) {
                    let (hit, containers) = self.along_whole_ray(ray, query);
                    *found = (hit, TestCounts { containers, primitives: 0 });
                }
            }
            Counting::Steps => {
                let mut probes = vec![TestCounts::default(); self.triangles.len()];
                let probes = (&mut TestCounts::default(), &mut probes[..]);
                self.through_wide(rays, query, found, probes, std::mem::take);
            }
            Counting::Lines => {
                let mut probes: Vec<LineProbe> =
                    self.levels.wide.copies().meshes().iter().map(|mesh| LineProbe::new(&mesh.wide().tree)).collect();
                let lines = |probe: &mut LineProbe<'_>| {
                    let CacheLines { nodes, triangles } = probe.take();
                    TestCounts { containers: nodes, primitives: triangles }
                };
                let probes = (&mut LineProbe::new(&self.levels.wide.top().tree), &mut probes[..]);
                self.through_wide(rays, query, found, probes, lines);
            }
        }
    }

    fn all_hits(&self, ray: &Ray, max: usize, hits: &mut Vec<Hit>) -> bool {
        let mut found = Vec::new();
        let has_more = self.levels.wide.all_hits(ray, max, &mut found);
        hits.clear();
        hits.extend(found.into_iter().map(|hit| self.numbered(hit)));
        has_more
    }

    fn all_hits_tests(&self, ray: &Ray) -> TestCounts {
        // In the paper's order nothing is culled: every container that the ray enters is tested, as for all hits.
        let mut counts = TestCounts::default();
        self.closest(ray, Traversal::Paper, &mut counts);
        counts
    }

    fn closest_point(&self, point: Vec3) -> Option<ClosestPoint> {
        self.binary().closest_point(point, |copy, triangle| self.levels.scene.number(copy, triangle), &mut NoProbe)
    }

    fn closest_point_tests(&self, point: Vec3) -> TestCounts {
        let mut counts = TestCounts::default();
        self.binary().closest_point(point, |copy, triangle| self.levels.scene.number(copy, triangle), &mut counts);
        counts
    }
}
