//! Visits and tests of many rays in trees of every arity, against a recursion that says in words what a traversal does.

use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Dop14, PreparedRay, Ray, Shear, Sphere, Triangle};
use bvhscope_engine::tree::traverse::{TestCounts, Traversal, any_hit_with, closest_hit};
use bvhscope_engine::tree::visits::{RayQuery, measure_visits};
use bvhscope_engine::tree::{Container, Tree};
use bvhscope_engine::with_tree;

use super::{ARITIES, irregular, widened};
use crate::trees;

/// One ray through a tree.
struct Recursion<'a, C> {
    tree: &'a Tree<C>,
    leaf_triangles: &'a [Triangle],
    ray: PreparedRay,
    query: RayQuery,
    /// The nearest hit so far.
    t: f32,
    found: bool,
    counts: TestCounts,
    visits: Vec<u32>,
}

impl<'a, C: Container> Recursion<'a, C> {
    fn trace(tree: &'a Tree<C>, leaf_triangles: &'a [Triangle], ray: &Ray, query: RayQuery) -> Self {
        let ray = PreparedRay::new(*ray);
        let t = ray.ray.t_max.min(f32::MAX);
        let (counts, visits) = (TestCounts::default(), Vec::new());
        let mut this = Self { tree, leaf_triangles, ray, query, t, found: false, counts, visits };
        let root = &tree.nodes[0];
        if this.ray.can_hit() && (root.is_leaf() || this.enters(0).is_some()) {
            this.visit(0);
        }
        this
    }

    /// Tests the container of a node up to the nearest hit, in the paper's order and for any hit up to the end of the ray.
    fn enters(&mut self, node: u32) -> Option<f32> {
        self.counts.containers += 1;
        let t_max = if self.query == RayQuery::ClosestHit(Traversal::Ordered) { self.t } else { self.ray.ray.t_max };
        let part = C::ray_part(&self.ray);
        self.tree.nodes[node as usize].container.entry(&self.ray, &part, self.ray.ray.t_min, t_max)
    }

    fn visit(&mut self, node: u32) {
        self.visits.push(node);
        let node = &self.tree.nodes[node as usize];
        for triangle in &self.leaf_triangles[node.slots()] {
            self.counts.primitives += 1;
            let limit = if self.query == RayQuery::AnyHit { self.ray.ray.t_max } else { self.t };
            if let Some(hit) = triangle.intersect(&self.ray, &Shear::new(self.ray.ray.direction), limit) {
                (self.t, self.found) = (hit.t, true);
                if self.query == RayQuery::AnyHit {
                    return;
                }
            }
        }
        let mut children: Vec<(u32, f32)> =
            node.children().filter_map(|child| self.enters(child).map(|t| (child, t))).collect();
        match self.query {
            RayQuery::ClosestHit(Traversal::Ordered) => children.sort_by(|a, b| a.1.total_cmp(&b.1)),
            RayQuery::ClosestHit(Traversal::Paper) => {}
            RayQuery::AnyHit => children.sort_by(|a, b| b.1.total_cmp(&a.1)),
        }
        for (child, t) in children {
            let is_culled = self.query == RayQuery::ClosestHit(Traversal::Ordered) && t > self.t;
            let is_over = self.query == RayQuery::AnyHit && self.found;
            if !is_culled && !is_over {
                self.visit(child);
            }
        }
    }
}

#[test]
fn tests_and_visits_are_those_of_a_recursion() {
    let triangles = trees::soup(400, 0.3, 21);
    let rays = trees::rays(&triangles, 150, 22);
    for binary in [
        trees::halved::<Aabb>(&triangles, 1),
        trees::halved::<Sphere>(&triangles, 4),
        trees::halved::<Dop14>(&triangles, 4),
    ] {
        for arity in ARITIES {
            for tree in [widened(&binary, arity), irregular(&binary, arity, 23)] {
                with_tree!(&tree, tree => check(arity, tree, &triangles, &rays));
            }
        }
    }
}

fn check<C: Container>(arity: usize, tree: &Tree<C>, triangles: &[Triangle], rays: &[Ray]) {
    let leaf_triangles = tree.leaf_triangles(triangles, &CancelToken::new()).unwrap();
    for query in [RayQuery::ClosestHit(Traversal::Ordered), RayQuery::ClosestHit(Traversal::Paper), RayQuery::AnyHit] {
        let mut visits = vec![0_u32; tree.nodes.len()];
        for ray in rays {
            let expected = Recursion::trace(tree, &leaf_triangles, ray, query);
            let mut counts = TestCounts::default();
            let found = match query {
                RayQuery::ClosestHit(traversal) => {
                    closest_hit(tree, &leaf_triangles, ray, traversal, &mut counts).is_some()
                }
                RayQuery::AnyHit => any_hit_with(tree, &leaf_triangles, ray, &mut counts),
            };
            assert_eq!((found, counts), (expected.found, expected.counts), "{arity}, {query:?}, {ray:?}");
            expected.visits.iter().for_each(|&node| visits[node as usize] += 1);
        }
        let count = rays.len() as u32;
        let ray = |index: u32| rays[index as usize];
        let measured = measure_visits(tree, &leaf_triangles, count, ray, query, &CancelToken::new()).unwrap();
        assert_eq!(measured.counts, visits, "{arity}, {query:?}");
    }
}
