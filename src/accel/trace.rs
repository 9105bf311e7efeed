//! Rays through the trees of an [`Accel`], of one level or two.

use bvhscope_engine::tree::traverse::{Probe, Traversal};
use bvhscope_engine::tree::visits::{Visits, measure_weighted_visits};
use bvhscope_engine::with_tree;
use bvhscope_engine::{CancelToken, Cancelled, CopyCosts, Hit, Ray, SimdLevel};

use super::copy_tracer::CopyTracer;
use super::tracer::{Tracer, TreeTracer};
use super::{Accel, WeightedRay};

impl Accel {
    /// The tracer of a SIMD level: the wide tree if it has been made, see [`Accel::widen`], else the binary one; of a scene of copies, both
    /// levels.
    pub fn tracer(&self, simd: SimdLevel) -> Box<dyn Tracer + '_> {
        match self.copy_tracer() {
            Some(tracer) => Box::new(tracer),
            None => Box::new(TreeTracer::new(self, simd)),
        }
    }

    /// The nearest hit, through the wide tree at the best SIMD level of this machine; see [`Bvh::closest_hit`]. [`Accel::wide`]
    /// has the other levels.
    ///
    /// [`Bvh::closest_hit`]: bvhscope_engine::Bvh::closest_hit
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        match self.copy_tracer() {
            Some(tracer) => tracer.nearest_of(ray),
            None => self.wide().closest_hit(ray),
        }
    }

    /// The nearest hits of `rays`, into the first elements of `hits`; see
    /// [`Bvh::closest_hits`](bvhscope_engine::Bvh::closest_hits).
    pub fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        match self.copy_tracer() {
            Some(tracer) => tracer.nearest(rays, hits),
            None => self.wide().closest_hits(rays, hits),
        }
    }

    /// Tells if anything lies on `ray` between its `t_min` and `t_max`.
    pub fn any_hit(&self, ray: &Ray) -> bool {
        match &self.levels {
            Some(levels) => levels.wide().any_hit(ray),
            None => self.wide().any_hit(ray),
        }
    }

    /// Tells if anything lies on each of `rays`, into the first elements of `blocked`; see
    /// [`Bvh::any_hits`](bvhscope_engine::Bvh::any_hits).
    pub fn any_hits(&self, rays: &[Ray], blocked: &mut [bool]) {
        match &self.levels {
            Some(levels) => levels.wide().any_hits(rays, blocked),
            None => self.wide().any_hits(rays, blocked),
        }
    }

    /// The same hit through the tree as it is, in the order of `traversal` and observed by `probe`.
    pub fn closest_hit_with<P: Probe>(&self, ray: &Ray, traversal: Traversal, probe: &mut P) -> Option<Hit> {
        match self.copy_tracer() {
            Some(tracer) => tracer.closest(ray, traversal, probe),
            None => self.tree.closest_hit(self.leaf_triangles(), ray, traversal, probe),
        }
    }

    /// Tells if anything lies on `ray`, through the tree as it is and observed by `probe`.
    pub fn any_hit_with<P: Probe>(&self, ray: &Ray, probe: &mut P) -> bool {
        match self.copy_tracer() {
            Some(tracer) => tracer.binary().any_hit(ray, probe),
            None => self.tree.any_hit(self.leaf_triangles(), ray, probe),
        }
    }

    /// Traces a number of rays through the binary tree and counts the visits of each node, in the calling thread's rayon pool; of a scene of
    /// copies, those of the tree over the copies.
    pub fn visits(&self, count: u32, ray: WeightedRay<'_>, token: &CancelToken) -> Result<Visits, Cancelled> {
        if let Some(tracer) = self.copy_tracer() {
            return tracer.binary().measure_weighted_visits(count, ray, token);
        }
        let triangles = self.compute_leaf_triangles(token)?;
        with_tree!(&self.tree, tree => measure_weighted_visits(tree, triangles, count, ray, token))
    }

    /// The cost of a number of rays in each copy of a scene of two levels, see [`BinaryLevels::costs`](bvhscope_engine::BinaryLevels::costs); `None` of a flat scene.
    pub fn copy_costs(
        &self,
        count: u32,
        ray: WeightedRay<'_>,
        token: &CancelToken,
    ) -> Result<Option<CopyCosts>, Cancelled> {
        self.copy_tracer().map(|tracer| tracer.binary().costs(count, ray, token)).transpose()
    }

    fn copy_tracer(&self) -> Option<CopyTracer<'_>> {
        self.levels.as_ref().map(|levels| CopyTracer::new(levels, &self.tree))
    }
}
