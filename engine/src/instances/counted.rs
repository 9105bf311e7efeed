//! Rays through the binary trees of both levels, observed by a probe: for numbers of tests and of visits.

use std::ops::{ControlFlow, Range};

use glam::Vec3;

use super::copies::{MeshCopies, PlacedMesh};
use super::hit::InstanceHit;
use super::unfolded::{Numbers, Unfolded};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{Aabb, CarriedRay, Container as _, PreparedRay, Ray, Shear, Triangle};
use crate::kernel::simd::baseline;
use crate::query::{ClosestPoint, NearestPoint, each_near_leaf};
use crate::tree::Tree;
use crate::tree::traverse::{NoProbe, Observer, Probe, RayEvent, StackEntry, Traversal, walk, with_stack};
use crate::tree::visits::{RayQuery, Visits, count_visits};

/// The trees of both levels: of boxes around the copies, and of the meshes.
#[derive(Debug, Clone, Copy)]
pub struct BinaryLevels<'a> {
    /// The copies and the trees of their meshes.
    pub copies: &'a MeshCopies,
    /// A tree over boxes of the copies, in order, within which they lie: its primitives are the copies.
    pub top: &'a Tree<Aabb>,
    /// The triangles that the tree of each mesh was built from.
    pub triangles: &'a [&'a [Triangle]],
    /// The tree whose nodes and primitives probes are told of, where trees of meshes are unfolded below `top`.
    pub unfolded: Option<&'a Unfolded>,
}

/// A ray in the world, as triangles are tested with it.
struct World {
    ray: PreparedRay,
    shear: Shear,
}

/// A probe of the tree over the copies in the trees below it.
struct Below<'a, P>(&'a mut P);

impl<P: Probe> Probe for Below<'_, P> {
    #[inline(always)]
    fn container_test(&mut self) {
        self.0.container_test();
    }
    #[inline(always)]
    fn primitive_test(&mut self) {
        self.0.primitive_test();
    }
    #[inline(always)]
    fn visited(&mut self, _: u32) {
        self.0.visited_below();
    }
}

/// A probe of the tree of a mesh.
trait ProbeBelow: Probe {
    /// Distances are those of this ray from now on.
    fn carried_as(&mut self, ray: CarriedRay);
}

impl<P: Probe> ProbeBelow for Below<'_, P> {
    fn carried_as(&mut self, _: CarriedRay) {}
}

impl<P: Probe> ProbeBelow for Numbered<'_, P> {
    fn carried_as(&mut self, ray: CarriedRay) {
        self.carried = Some(ray);
    }
}

/// A probe that gets nodes by their numbers in an unfolded tree.
struct Numbered<'a, P> {
    probe: &'a mut P,
    /// The numbers of the nodes; `None` where they have their own.
    nodes: Option<&'a [u32]>,
    /// The number of the first primitive.
    first: u32,
    carried: Option<CarriedRay>,
}

impl<P: Probe> Numbered<'_, P> {
    #[inline(always)]
    fn node(&self, node: u32) -> u32 {
        self.nodes.map_or(node, |nodes| nodes[node as usize])
    }

    #[inline(always)]
    fn distance(&self, distance: f32) -> f32 {
        self.carried.map_or(distance, |carried| carried.distance_in_world(distance))
    }
}

impl<P: Probe> Probe for Numbered<'_, P> {
    const EVENTS: bool = P::EVENTS;

    #[inline(always)]
    fn container_test(&mut self) {
        self.probe.container_test();
    }
    #[inline(always)]
    fn primitive_test(&mut self) {
        self.probe.primitive_test();
    }
    #[inline(always)]
    fn visited(&mut self, node: u32) {
        self.probe.visited(self.node(node));
    }
    #[inline(always)]
    fn event(&mut self, event: RayEvent) {
        match event {
            RayEvent::Visit { node } => self.probe.visited(self.node(node)),
            RayEvent::Enter { node, t } => self.probe.entered(self.node(node), self.distance(t)),
            RayEvent::Miss { node } => self.probe.missed(self.node(node)),
            RayEvent::Cull { node, t } => self.probe.culled(self.node(node), self.distance(t)),
            RayEvent::Push { node } => self.probe.pushed(self.node(node)),
            RayEvent::Pop { node } => self.probe.popped(self.node(node)),
            RayEvent::Triangle { index, t } => self.probe.tested(self.first + index, t),
            RayEvent::Nearer { t } => self.probe.nearer(t),
        }
    }
}

impl BinaryLevels<'_> {
    /// The nearest hit of `ray`, that of [`Instances::closest_hit`](super::Instances::closest_hit). `probe` gets the tests of both levels,
    /// and visits and events of the upper one and of unfolded copies.
    pub fn closest_hit<P: Probe>(&self, ray: &Ray, traversal: Traversal, probe: &mut P) -> Option<InstanceHit> {
        self.observed(ray, RayQuery::ClosestHit(traversal), probe)
    }

    /// Tells if anything lies on `ray` between its `t_min` and `t_max`, observed as in [`BinaryLevels::closest_hit`].
    pub fn any_hit<P: Probe>(&self, ray: &Ray, probe: &mut P) -> bool {
        self.observed(ray, RayQuery::AnyHit, probe).is_some()
    }

    fn observed<P: Probe>(&self, ray: &Ray, query: RayQuery, probe: &mut P) -> Option<InstanceHit> {
        match probe.observer() {
            Observer::Nothing => self.query(ray, query, &mut NoProbe),
            Observer::Counts(counts) => self.query(ray, query, counts),
            Observer::Tests(mut probe) => self.query(ray, query, &mut probe),
            Observer::Events(mut probe) => self.query(ray, query, &mut probe),
        }
    }

    /// The visits of the nodes of the tree over the copies by rays, or of the unfolded one, see
    /// [`measure_weighted_visits`](crate::tree::visits::measure_weighted_visits).
    pub fn measure_weighted_visits(
        &self,
        ray_count: u32,
        ray: impl Fn(u32) -> (Ray, RayQuery, u32) + Sync,
        token: &CancelToken,
    ) -> Result<Visits, Cancelled> {
        let nodes = self.unfolded.map_or(self.top.nodes.len(), |unfolded| unfolded.origins.len());
        count_visits(nodes, ray_count, ray, token, |ray, query, counter| {
            self.query(ray, query, counter);
        })
    }

    /// The hit that ends a query.
    pub(super) fn query<P: Probe>(&self, ray: &Ray, query: RayQuery, probe: &mut P) -> Option<InstanceHit> {
        match query {
            RayQuery::ClosestHit(Traversal::Ordered) => self.trace::<P, true, false>(ray, probe),
            RayQuery::ClosestHit(Traversal::Paper) => self.trace::<P, false, false>(ray, probe),
            RayQuery::AnyHit => self.trace::<P, true, true>(ray, probe),
        }
    }

    fn trace<P: Probe, const ORDERED: bool, const ANY: bool>(&self, ray: &Ray, probe: &mut P) -> Option<InstanceHit> {
        with_stack(self.top.max_depth, |stack| {
            with_stack(self.copies.depth(), |below| self.trace_with::<P, ORDERED, ANY>(ray, [stack, below], probe))
        })
    }

    /// [`BinaryLevels::trace`] with the stacks of the upper and the lower level.
    fn trace_with<P: Probe, const ORDERED: bool, const ANY: bool>(
        &self,
        ray: &Ray,
        [stack, stack_below]: [&mut [StackEntry]; 2],
        probe: &mut P,
    ) -> Option<InstanceHit> {
        let world = World { ray: PreparedRay::new(*ray), shear: Shear::new(ray.direction) };
        let mut found: Option<InstanceHit> = None;
        let mut above = Numbered { probe, nodes: self.unfolded.map(Unfolded::above), first: 0, carried: None };
        walk::<_, Aabb, _, ORDERED, ANY>(baseline(), self.top, &world.ray, stack, &mut above, |slots, _, above| {
            for &copy in &self.top.primitive_indices[slots] {
                let before = found;
                let numbers = self.unfolded.and_then(|unfolded| unfolded.below(copy));
                above.probe.carried(copy);
                if let Some(Numbers { nodes, first }) = numbers {
                    let probe = Numbered { probe: &mut *above.probe, nodes: Some(nodes), first, carried: None };
                    self.trace_copy::<_, ORDERED, ANY>(copy, &world, stack_below, probe, &mut found);
                } else {
                    let probe = Below(&mut *above.probe);
                    self.trace_copy::<_, ORDERED, ANY>(copy, &world, stack_below, probe, &mut found);
                }
                if P::EVENTS && numbers.is_none() {
                    let nearer = found.filter(|_| found != before);
                    above.tested(copy, nearer.map(|hit| hit.t));
                    if let Some(hit) = nearer {
                        above.nearer(hit.t);
                    }
                }
                if ANY && found.is_some() {
                    return ControlFlow::Break(());
                }
            }
            ControlFlow::Continue(world.end::<ORDERED>(found))
        });
        found
    }

    /// Replaces `found` by the nearest hit with `copy` where that is nearer, or by any.
    fn trace_copy<P: ProbeBelow, const ORDERED: bool, const ANY: bool>(
        &self,
        copy: u32,
        world: &World,
        stack: &mut [StackEntry],
        mut probe: P,
        found: &mut Option<InstanceHit>,
    ) {
        let PlacedMesh { mesh, place } = self.copies.placed(copy);
        let (tree, triangles) = (self.copies.binary_tree(*mesh), self.triangles[*mesh as usize]);
        let carried = place.carry(&Ray { t_max: world.end::<ORDERED>(*found), ..world.ray.ray });
        let mut test = |slots: Range<usize>, probe: &mut P| {
            for &index in &tree.primitive_indices[slots] {
                probe.primitive_test();
                let triangle = place.triangle(&triangles[index as usize]);
                let hit = triangle.intersect(&world.ray, &world.shear, world.end::<true>(*found));
                if P::EVENTS {
                    probe.tested(index, hit.map(|hit| hit.t));
                }
                if let Some(hit) = hit {
                    let before = *found;
                    *found = Some(InstanceHit::new(copy, hit.of(index)).nearer(before));
                    if P::EVENTS && *found != before {
                        probe.nearer(hit.t);
                    }
                    if ANY {
                        return ControlFlow::Break(());
                    }
                }
            }
            ControlFlow::Continue(world.end::<ORDERED>(*found))
        };
        let Some(carried) = carried else {
            // Its coordinates would leave the range of single precision: every triangle is tested, as by the wide tree.
            let _ = test(0..tree.primitive_indices.len(), &mut probe);
            return;
        };
        probe.carried_as(carried);
        let ray = PreparedRay::widened(carried.ray, carried.widening.into());
        walk::<_, Aabb, _, ORDERED, ANY>(baseline(), tree, &ray, stack, &mut probe, |slots, _, probe| {
            test(slots, probe).map_continue(|end| carried.distance(end))
        });
    }

    /// The point of the copies that is nearest to `point`, observed by `probe`. A triangle has the index that `number` gives it by copy and
    /// index in the mesh; of equal distances the lower one is found. `None` without triangles, and where `point` is not finite.
    pub fn closest_point<P: Probe>(
        &self,
        point: Vec3,
        number: impl Fn(u32, u32) -> u32,
        probe: &mut P,
    ) -> Option<ClosestPoint> {
        let mut nearest = NearestPoint::new(point, f32::INFINITY)?;
        let near = |bounds: &Aabb| bounds.distance_squared(point);
        each_near_leaf(self.top, near, &mut nearest, probe, &mut |leaf, nearest, probe| {
            for &copy in &self.top.primitive_indices[leaf.slots()] {
                let PlacedMesh { mesh, place } = self.copies.placed(copy);
                let (tree, triangles) = (self.copies.binary_tree(*mesh), self.triangles[*mesh as usize]);
                probe.carried(copy);
                let near = |bounds: &Aabb| place.bounds(bounds).distance_squared(point);
                each_near_leaf(tree, near, nearest, probe, &mut |leaf, nearest, probe| {
                    for &index in &tree.primitive_indices[leaf.slots()] {
                        probe.primitive_test();
                        nearest.offer(&place.triangle(&triangles[index as usize]), number(copy, index));
                    }
                });
            }
        });
        nearest.found()
    }
}

impl World {
    /// Distance up to which hits are wanted: in the paper's order the whole ray.
    #[inline(always)]
    fn end<const ORDERED: bool>(&self, found: Option<InstanceHit>) -> f32 {
        let whole = self.ray.ray.t_max;
        if ORDERED { found.map_or(whole, |hit| hit.t) } else { whole }
    }
}
