//! Rays through the binary tree, counting through a [`Probe`] that costs nothing when off.

use std::ops::{ControlFlow, Range};

use serde::{Deserialize, Serialize};

use super::{Container, Tree};
use crate::geometry::{Hit, PreparedRay, Ray, Triangle};

/// The order in which a ray visits nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Traversal {
    /// Near child first, culled by the closest hit so far. Makes pictures.
    Ordered,
    /// The paper's Fig. 2 as printed: unordered, no culling by distance.
    Paper,
}

/// Watches a traversal.
pub trait Probe {
    /// A container was tested.
    fn container_test(&mut self);
    /// A primitive was tested.
    fn primitive_test(&mut self);
}

/// Counts nothing, for nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoProbe;

impl Probe for NoProbe {
    #[inline(always)]
    fn container_test(&mut self) {}
    #[inline(always)]
    fn primitive_test(&mut self) {}
}

/// Counts tests.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct TestCounts {
    /// Containers tested.
    pub containers: u64,
    /// Primitives tested.
    pub primitives: u64,
}

impl Probe for TestCounts {
    #[inline(always)]
    fn container_test(&mut self) {
        self.containers += 1;
    }
    #[inline(always)]
    fn primitive_test(&mut self) {
        self.primitives += 1;
    }
}

/// The nearest hit of `ray` with the triangles of `tree`, given in leaf order. The result does not depend on `traversal`;
/// equal distances go to the lower primitive index.
#[inline]
pub fn closest_hit<C: Container, P: Probe>(
    tree: &Tree<C>,
    leaf_triangles: &[Triangle],
    ray: &Ray,
    traversal: Traversal,
    probe: &mut P,
) -> Option<Hit> {
    let ray = PreparedRay::new(*ray);
    let mut nearest = Nearest::new(ray.ray.t_max);
    with_stack(tree.max_depth, |stack| match traversal {
        Traversal::Ordered => {
            walk::<C, P, true>(tree, &ray, stack, ray.ray.t_max, probe, |range, probe| {
                nearest.test(tree, leaf_triangles, range, &ray, probe);
                ControlFlow::Continue(nearest.t)
            });
        }
        Traversal::Paper => {
            walk::<C, P, false>(tree, &ray, stack, ray.ray.t_max, probe, |range, probe| {
                nearest.test(tree, leaf_triangles, range, &ray, probe);
                ControlFlow::Continue(ray.ray.t_max)
            });
        }
    });
    nearest.hit()
}

/// Whether anything lies on `ray` between its `t_min` and `t_max`.
#[inline]
pub fn any_hit<C: Container>(tree: &Tree<C>, leaf_triangles: &[Triangle], ray: &Ray) -> bool {
    any_hit_with(tree, leaf_triangles, ray, &mut NoProbe)
}

/// [`any_hit`], watched by `probe`.
#[inline]
pub fn any_hit_with<C: Container, P: Probe>(
    tree: &Tree<C>,
    leaf_triangles: &[Triangle],
    ray: &Ray,
    probe: &mut P,
) -> bool {
    let ray = PreparedRay::new(*ray);
    let mut found = false;
    with_stack(tree.max_depth, |stack| {
        walk::<C, P, true>(tree, &ray, stack, ray.ray.t_max, probe, |range, probe| {
            for triangle in &leaf_triangles[range] {
                probe.primitive_test();
                if triangle.intersect(&ray, ray.ray.t_max).is_some() {
                    found = true;
                    return ControlFlow::Break(());
                }
            }
            ControlFlow::Continue(ray.ray.t_max)
        });
    });
    found
}

/// The nearest hit so far.
struct Nearest {
    t: f32,
    u: f32,
    v: f32,
    primitive_index: u32,
}

impl Nearest {
    /// No hit yet. The largest index stands for none: it loses every tie.
    fn new(t_max: f32) -> Self {
        Self { t: t_max, u: 0.0, v: 0.0, primitive_index: u32::MAX }
    }

    #[inline(always)]
    fn test<C, P: Probe>(
        &mut self,
        tree: &Tree<C>,
        leaf_triangles: &[Triangle],
        range: Range<usize>,
        ray: &PreparedRay,
        probe: &mut P,
    ) {
        for (offset, triangle) in leaf_triangles[range.clone()].iter().enumerate() {
            probe.primitive_test();
            if let Some(hit) = triangle.intersect(ray, self.t) {
                let primitive_index = tree.primitive_indices[range.start + offset];
                if hit.t < self.t || primitive_index < self.primitive_index {
                    *self = Self { t: hit.t, u: hit.u, v: hit.v, primitive_index };
                }
            }
        }
    }

    fn hit(&self) -> Option<Hit> {
        (self.primitive_index != u32::MAX).then_some(Hit {
            t: self.t,
            primitive_index: self.primitive_index,
            u: self.u,
            v: self.v,
        })
    }
}

/// A node that waits, with the distance at which the ray enters it.
#[derive(Debug, Clone, Copy)]
struct Waiting {
    node: u32,
    entry: f32,
}

impl Waiting {
    const NONE: Self = Self { node: 0, entry: 0.0 };
}

/// Trees up to this depth keep their stack off the heap.
const SMALL_STACK: usize = 64;

/// Calls `run` with a stack for a tree of this depth: at most one sibling waits on each level.
#[inline(always)]
fn with_stack(max_depth: u32, run: impl FnOnce(&mut [Waiting])) {
    if max_depth as usize <= SMALL_STACK {
        run(&mut [Waiting::NONE; SMALL_STACK]);
    } else {
        run(&mut vec![Waiting::NONE; max_depth as usize]);
    }
}

/// Visits the leaves that `ray` reaches. `leaf` tests the primitives of a range and returns how far to look from then
/// on. `ORDERED`: the near child first, skipping what begins beyond that distance; else in the order of the
/// nodes.
#[inline(always)]
fn walk<C: Container, P: Probe, const ORDERED: bool>(
    tree: &Tree<C>,
    ray: &PreparedRay,
    stack: &mut [Waiting],
    mut t_max: f32,
    probe: &mut P,
    mut leaf: impl FnMut(Range<usize>, &mut P) -> ControlFlow<(), f32>,
) {
    let Some(root) = tree.nodes.first() else { return };
    if !ray.can_hit() {
        return;
    }
    let t_min = ray.ray.t_min;
    // A lone leaf has nothing to be skipped by: its primitives are tested directly.
    if !root.is_leaf() {
        probe.container_test();
        if root.container.entry(ray, t_min, t_max).is_none() {
            return;
        }
    }
    let mut node = root;
    let mut top = 0;
    loop {
        if node.is_leaf() {
            let first = node.first as usize;
            match leaf(first..first + node.count as usize, probe) {
                ControlFlow::Break(()) => return,
                ControlFlow::Continue(reach) => t_max = reach,
            }
        } else {
            let first = node.first as usize;
            let [left, right] = &tree.nodes[first..first + 2] else { return };
            probe.container_test();
            probe.container_test();
            let [left_entry, right_entry] = C::entry_pair([&left.container, &right.container], ray, t_min, t_max);
            match (left_entry < f32::INFINITY, right_entry < f32::INFINITY) {
                (true, true) => {
                    let swap = ORDERED && right_entry < left_entry;
                    stack[top] = if swap {
                        Waiting { node: first as u32, entry: left_entry }
                    } else {
                        Waiting { node: first as u32 + 1, entry: right_entry }
                    };
                    top += 1;
                    node = if swap { right } else { left };
                    continue;
                }
                (true, false) => {
                    node = left;
                    continue;
                }
                (false, true) => {
                    node = right;
                    continue;
                }
                (false, false) => {}
            }
        }
        // Back to the last node that waits and still matters.
        node = loop {
            if top == 0 {
                return;
            }
            top -= 1;
            let waiting = stack[top];
            if !ORDERED || waiting.entry <= t_max {
                break &tree.nodes[waiting.node as usize];
            }
        };
    }
}
