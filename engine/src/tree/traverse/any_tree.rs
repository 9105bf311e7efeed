//! Traversal of a tree whose container is known only when it runs. Compiled once, here, whatever observes it and whichever crate
//! traces.

use fearless_simd::Level;

use super::walk::with_stack;
use super::{IndexedTriangles, NoProbe, Observer, Probe, StackEntry, Traversal};
use crate::geometry::{Hit, Ray, Triangle};
use crate::kernel::simd::{baseline, dispatch_plain};
use crate::tree::node::AnyTree;
use crate::with_tree;

impl AnyTree {
    /// The nearest hit of `ray`; see [`closest_hit`](super::closest_hit). `leaf_triangles` are those of
    /// [`AnyTree::leaf_triangles`].
    pub fn closest_hit<P: Probe>(
        &self,
        leaf_triangles: &[Triangle],
        ray: &Ray,
        traversal: Traversal,
        probe: &mut P,
    ) -> Option<Hit> {
        with_stack(self.max_depth(), |stack| {
            self.closest_hit_with(Level::baseline(), leaf_triangles, ray, traversal, stack, probe)
        })
    }

    /// [`AnyTree::closest_hit`] at a SIMD level, with a stack of [`new_stack`](super::new_stack) that is reused from ray to ray.
    pub fn closest_hit_with<P: Probe>(
        &self,
        level: Level,
        leaf_triangles: &[Triangle],
        ray: &Ray,
        traversal: Traversal,
        stack: &mut [StackEntry],
        probe: &mut P,
    ) -> Option<Hit> {
        self.closest_hit_observed(level, leaf_triangles, ray, traversal, stack, probe.observer())
    }

    fn closest_hit_observed(
        &self,
        level: Level,
        triangles: &[Triangle],
        ray: &Ray,
        traversal: Traversal,
        stack: &mut [StackEntry],
        observer: Observer<'_>,
    ) -> Option<Hit> {
        match observer {
            Observer::Nothing => self.closest_hit_probed(level, triangles, ray, traversal, stack, &mut NoProbe),
            Observer::Counts(counts) => self.closest_hit_probed(level, triangles, ray, traversal, stack, counts),
            // Only traversals that are timed run at the given level.
            Observer::Tests(mut probe) => with_tree!(self, tree =>
                super::closest_hit_with(baseline(), tree, triangles, ray, traversal, stack, &mut probe)),
            Observer::Events(mut probe) => with_tree!(self, tree =>
                super::closest_hit_with(baseline(), tree, triangles, ray, traversal, stack, &mut probe)),
        }
    }

    #[inline(always)]
    fn closest_hit_probed<P: Probe>(
        &self,
        level: Level,
        triangles: &[Triangle],
        ray: &Ray,
        traversal: Traversal,
        stack: &mut [StackEntry],
        probe: &mut P,
    ) -> Option<Hit> {
        match self {
            Self::Aabb(tree) => {
                dispatch_plain!(level, simd => super::closest_hit_with(simd, tree, triangles, ray, traversal, stack, probe))
            }
            Self::Sphere(tree) => {
                dispatch_plain!(level, simd => super::closest_hit_with(simd, tree, triangles, ray, traversal, stack, probe))
            }
            // The tests of polytopes and of oriented boxes take four lanes on every machine.
            Self::Dop14(tree) => super::closest_hit_with(baseline(), tree, triangles, ray, traversal, stack, probe),
            Self::Oriented(tree) => super::closest_hit_with(baseline(), tree, triangles, ray, traversal, stack, probe),
        }
    }

    /// Whether anything lies on `ray`; see [`any_hit`](super::any_hit). `leaf_triangles` are those of
    /// [`AnyTree::leaf_triangles`].
    pub fn any_hit<P: Probe>(&self, leaf_triangles: &[Triangle], ray: &Ray, probe: &mut P) -> bool {
        self.any_hit_observed(leaf_triangles, ray, probe.observer())
    }

    fn any_hit_observed(&self, triangles: &[Triangle], ray: &Ray, observer: Observer<'_>) -> bool {
        with_tree!(self, tree => match observer {
            Observer::Nothing => super::any_hit(tree, triangles, ray),
            Observer::Counts(counts) => super::any_hit_with(tree, triangles, ray, counts),
            Observer::Tests(mut probe) => super::any_hit_with(tree, triangles, ray, &mut probe),
            Observer::Events(mut probe) => super::any_hit_with(tree, triangles, ray, &mut probe),
        })
    }

    /// The nearest hit of one of few rays, for which bringing the triangles into leaf order would take longer. `triangles` is the
    /// list that the tree was built from.
    pub fn closest_hit_indexed(&self, triangles: &[Triangle], ray: &Ray) -> Option<Hit> {
        with_tree!(self, tree => super::closest_hit(
            tree,
            IndexedTriangles { triangles, indices: &tree.primitive_indices },
            ray,
            Traversal::Ordered,
            &mut NoProbe,
        ))
    }

    /// [`AnyTree::any_hit`] with the triangles of [`AnyTree::closest_hit_indexed`].
    pub fn any_hit_indexed(&self, triangles: &[Triangle], ray: &Ray) -> bool {
        with_tree!(self, tree => super::any_hit(tree, IndexedTriangles { triangles, indices: &tree.primitive_indices }, ray))
    }
}
