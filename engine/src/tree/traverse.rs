//! Rays through the binary tree, counting through a [`Probe`] that costs nothing when off.

use std::ops::{ControlFlow, Range};

use fearless_simd::{Level, Simd, dispatch};

use crate::geometry::{Hit, PreparedRay, Ray, Shear, Triangle, TriangleHit};
use crate::tree::{Container, Tree};

/// The order in which a ray visits nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Traversal {
    /// Near child first, culled by the closest hit so far. Makes pictures.
    Ordered,
    /// The paper's Fig. 2 as printed: unordered, no culling by distance.
    Paper,
}

impl Traversal {
    /// Every order of visiting.
    pub const ALL: [Self; 2] = [Self::Ordered, Self::Paper];

    /// The name on the command line and in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ordered => "ordered",
            Self::Paper => "paper",
        }
    }
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

/// Where the triangles of a tree's leaves are found.
pub trait LeafTriangles: Copy {
    /// The triangles in a run of slots of [`Tree::primitive_indices`].
    fn in_slots(&self, slots: Range<usize>) -> impl Iterator<Item = &Triangle>;
}

/// Triangles in leaf order: what many rays are traced with.
impl LeafTriangles for &[Triangle] {
    #[inline(always)]
    fn in_slots(&self, slots: Range<usize>) -> impl Iterator<Item = &Triangle> {
        self[slots].iter()
    }
}

impl LeafTriangles for &Vec<Triangle> {
    #[inline(always)]
    fn in_slots(&self, slots: Range<usize>) -> impl Iterator<Item = &Triangle> {
        self[slots].iter()
    }
}

/// Triangles as the tree's builder got them: for so few rays that bringing them into leaf order takes longer.
#[derive(Debug, Clone, Copy)]
pub struct Unordered<'a> {
    /// The list that the tree was built from.
    pub triangles: &'a [Triangle],
    /// The tree's [`Tree::primitive_indices`].
    pub indices: &'a [u32],
}

impl LeafTriangles for Unordered<'_> {
    #[inline(always)]
    fn in_slots(&self, slots: Range<usize>) -> impl Iterator<Item = &Triangle> {
        self.indices[slots].iter().map(|&index| &self.triangles[index as usize])
    }
}

/// The nearest hit of `ray` with the triangles of `tree`. The result does not depend on `traversal`;
/// equal distances go to the lower primitive index. Where many rays are traced, see [`closest_hit_with`].
#[inline]
pub fn closest_hit<C: Container, P: Probe>(
    tree: &Tree<C>,
    leaf_triangles: impl LeafTriangles,
    ray: &Ray,
    traversal: Traversal,
    probe: &mut P,
) -> Option<Hit> {
    with_stack(
        tree.max_depth,
        |stack| dispatch!(Level::baseline(), simd => closest_hit_with(simd, tree, leaf_triangles, ray, traversal, stack, probe)),
    )
}

/// [`closest_hit`] in the SIMD level of the caller, who keeps the stack from ray to ray.
#[inline(always)]
pub fn closest_hit_with<S: Simd, C: Container, P: Probe>(
    simd: S,
    tree: &Tree<C>,
    leaf_triangles: impl LeafTriangles,
    ray: &Ray,
    traversal: Traversal,
    stack: &mut [Waiting],
    probe: &mut P,
) -> Option<Hit> {
    let ray = PreparedRay::new(*ray);
    let mut nearest = Nearest::new(ray.ray.t_max);
    match traversal {
        Traversal::Ordered => walk::<S, C, P, true, false>(
            simd,
            tree,
            &ray,
            stack,
            probe,
            #[inline(always)]
            |range, shear, probe| {
                nearest.test(tree, leaf_triangles, range, &ray, shear, probe);
                ControlFlow::Continue(nearest.t)
            },
        ),
        Traversal::Paper => walk::<S, C, P, false, false>(
            simd,
            tree,
            &ray,
            stack,
            probe,
            #[inline(always)]
            |range, shear, probe| {
                nearest.test(tree, leaf_triangles, range, &ray, shear, probe);
                ControlFlow::Continue(ray.ray.t_max)
            },
        ),
    }
    nearest.hit()
}

/// Whether anything lies on `ray` between its `t_min` and `t_max`. Looks far away first: near its origin a ray passes what it
/// left.
#[inline]
pub fn any_hit<C: Container>(tree: &Tree<C>, leaf_triangles: impl LeafTriangles, ray: &Ray) -> bool {
    any_hit_with(tree, leaf_triangles, ray, &mut NoProbe)
}

/// [`any_hit`], watched by `probe`.
#[inline]
pub fn any_hit_with<C: Container, P: Probe>(
    tree: &Tree<C>,
    leaf_triangles: impl LeafTriangles,
    ray: &Ray,
    probe: &mut P,
) -> bool {
    let ray = PreparedRay::new(*ray);
    let mut found = false;
    with_stack(tree.max_depth, |stack| {
        let leaf = |range: Range<usize>, shear: &Shear, probe: &mut P| {
            for triangle in leaf_triangles.in_slots(range) {
                probe.primitive_test();
                if triangle.intersect(&ray, shear, ray.ray.t_max).is_some() {
                    found = true;
                    return ControlFlow::Break(());
                }
            }
            ControlFlow::Continue(ray.ray.t_max)
        };
        dispatch!(Level::baseline(), simd => walk::<_, C, P, true, true>(simd, tree, &ray, stack, probe, leaf));
    });
    found
}

/// The nearest hit so far.
#[derive(Clone, Copy)]
pub(crate) struct Nearest {
    t: f32,
    u: f32,
    v: f32,
    primitive_index: u32,
}

impl Nearest {
    /// Nothing, and nothing will be.
    pub(crate) const NOTHING: Self = Self { t: 0.0, u: 0.0, v: 0.0, primitive_index: u32::MAX };

    /// No hit yet, and none at an infinite distance. The largest index stands for none: it loses every tie.
    #[inline(always)]
    pub(crate) fn new(t_max: f32) -> Self {
        Self { t: t_max.min(f32::MAX), u: 0.0, v: 0.0, primitive_index: u32::MAX }
    }

    /// How far to look.
    #[inline(always)]
    pub(crate) fn t(&self) -> f32 {
        self.t
    }

    /// Takes a hit that is no farther than [`Nearest::t`]; equal distances go to the lower primitive index.
    #[inline(always)]
    pub(crate) fn offer(&mut self, hit: TriangleHit, primitive_index: u32) {
        if hit.t < self.t || hit.t == self.t && primitive_index < self.primitive_index {
            *self = Self { t: hit.t, u: hit.u, v: hit.v, primitive_index };
        }
    }

    #[inline(always)]
    fn test<C, P: Probe>(
        &mut self,
        tree: &Tree<C>,
        leaf_triangles: impl LeafTriangles,
        range: Range<usize>,
        ray: &PreparedRay,
        shear: &Shear,
        probe: &mut P,
    ) {
        for (offset, triangle) in leaf_triangles.in_slots(range.clone()).enumerate() {
            probe.primitive_test();
            if let Some(hit) = triangle.intersect(ray, shear, self.t) {
                self.offer(hit, tree.primitive_indices[range.start + offset]);
            }
        }
    }

    #[inline(always)]
    pub(crate) fn found(&self) -> bool {
        self.primitive_index != u32::MAX
    }

    #[inline(always)]
    pub(crate) fn hit(&self) -> Option<Hit> {
        self.found().then_some(Hit { t: self.t, primitive_index: self.primitive_index, u: self.u, v: self.v })
    }
}

/// A node that waits, with the distance at which the ray enters it.
#[derive(Debug, Clone, Copy)]
pub struct Waiting {
    node: u32,
    entry: f32,
}

impl Waiting {
    const NONE: Self = Self { node: 0, entry: 0.0 };
}

/// Room for the nodes that wait while a ray goes down a tree whose deepest node has this depth: at most one sibling on
/// each level. Kept from ray to ray, it need not be cleared for each.
pub fn new_stack(max_depth: u32) -> Vec<Waiting> {
    vec![Waiting::NONE; max_depth as usize]
}

/// Visits the leaves that `ray` reaches. `leaf` tests the primitives of a range and returns how far to look from then
/// on. `ORDERED`: the near child first, or with `FARTHEST_FIRST` the far one, skipping what begins beyond that distance;
/// else in the order of the nodes.
#[inline(always)]
fn walk<S: Simd, C: Container, P: Probe, const ORDERED: bool, const FARTHEST_FIRST: bool>(
    simd: S,
    tree: &Tree<C>,
    ray: &PreparedRay,
    stack: &mut [Waiting],
    probe: &mut P,
    mut leaf: impl FnMut(Range<usize>, &Shear, &mut P) -> ControlFlow<(), f32>,
) {
    let nodes = &tree.nodes[..];
    let Some(root) = nodes.first() else { return };
    if !ray.can_hit() {
        return;
    }
    let (t_min, mut t_max) = (ray.ray.t_min, ray.ray.t_max);
    // A lone leaf has nothing to be skipped by: its primitives are tested directly.
    if !root.is_leaf() {
        probe.container_test();
        if root.container.entry(ray, t_min, t_max).is_none() {
            return;
        }
    }
    let mut shear = None;
    let mut node = root;
    let mut top = 0;
    loop {
        if node.is_leaf() {
            let first = node.first as usize;
            let shear = shear.get_or_insert_with(|| Shear::new(ray.ray.direction));
            match leaf(first..first + node.count as usize, shear, probe) {
                ControlFlow::Break(()) => return,
                ControlFlow::Continue(reach) => t_max = reach,
            }
        } else {
            let first = node.first as usize;
            let [left, right] = &nodes[first..first + 2] else { return };
            probe.container_test();
            probe.container_test();
            let pair = C::entry_pair(simd, [&left.container, &right.container], ray, t_min, t_max);
            match pair.hits {
                0 => {}
                1 => {
                    node = left;
                    continue;
                }
                2 => {
                    node = right;
                    continue;
                }
                _ => {
                    let [left_entry, right_entry] = pair.entry;
                    let right_first = if FARTHEST_FIRST { right_entry > left_entry } else { right_entry < left_entry };
                    let swap = ORDERED && right_first;
                    stack[top] = if swap {
                        Waiting { node: first as u32, entry: pair.entry[0] }
                    } else {
                        Waiting { node: first as u32 + 1, entry: pair.entry[1] }
                    };
                    top += 1;
                    node = if swap { right } else { left };
                    continue;
                }
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
                break &nodes[waiting.node as usize];
            }
        };
    }
}

/// Trees up to this depth keep the stack of a single ray off the heap.
const SMALL_STACK: usize = 64;

/// Calls `run` with a stack for a tree of this depth.
#[inline(always)]
fn with_stack<R>(max_depth: u32, run: impl FnOnce(&mut [Waiting]) -> R) -> R {
    if max_depth as usize <= SMALL_STACK {
        run(&mut [Waiting::NONE; SMALL_STACK])
    } else {
        run(&mut vec![Waiting::NONE; max_depth as usize])
    }
}
