//! Traversal of a tree of any arity, with a [`Probe`] that can count tests or record every step.
//!
//! A visit of an interior node tests the container of each of its children: two tests in a binary tree, eight in a node of
//! eight children. Of those that the ray enters the nearest is visited first, and the others wait on the stack, the farthest
//! below. A tree whose children stick out of their parents is traced as it is, so that rays miss what its containers miss.

use std::ops::{ControlFlow, Range};

use fearless_simd::Simd;

use crate::geometry::Container;
use crate::geometry::{Hit, PreparedRay, Ray, Shear};
use crate::kernel::simd::baseline;
use crate::tree::node::Tree;

mod any_tree;
mod leaf_triangles;
mod nearest;
mod probe;
mod ray_event;
mod ray_log;
mod walk;

pub use leaf_triangles::{IndexedTriangles, LeafTriangles};
pub(crate) use nearest::Nearest;
#[doc(hidden)]
pub use probe::Observer;
pub use probe::{NoProbe, Probe, TestCounts};
pub use ray_event::RayEvent;
pub use ray_log::RayLog;
pub use walk::{StackEntry, new_stack};
pub(crate) use walk::{walk, with_stack};

/// Order in which a ray visits nodes. It changes the number of tests, never the hit.
///
/// ```
/// use bvhscope_engine::Traversal;
/// use bvhscope_engine::glam::Vec3;
/// use bvhscope_engine::{BuildSettings, CancelToken, Ray, Triangle, build};
///
/// let triangles: Vec<_> = (0..64)
///     .map(|i| Vec3::new(0.0, 0.0, i as f32))
///     .map(|a| Triangle { a, b: a + Vec3::X, c: a + Vec3::Y })
///     .collect();
/// let bvh = build(&triangles, &BuildSettings::default(), &CancelToken::new())?;
/// let ray = Ray::new(Vec3::new(0.2, 0.2, -1.0), Vec3::Z);
/// let tests = [Traversal::Ordered, Traversal::Paper]
///     .map(|traversal| bvh.closest_hit_counted(&ray, &triangles, traversal).1.primitives);
/// assert_eq!(tests, [1, 64]);
/// # Ok::<(), bvhscope_engine::BuildError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Traversal {
    /// Near child first, culled by the closest hit so far.
    Ordered,
    /// Figure 2 of the paper (Mahmuda et al.) as printed: unordered, no culling by distance.
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

/// The nearest hit of `ray` with the triangles of `tree`, which may have any arity. Does not depend on `traversal`; equal
/// distances go to the lower primitive index. For many rays, see [`closest_hit_with`].
#[inline]
pub fn closest_hit<C: Container, P: Probe>(
    tree: &Tree<C>,
    leaf_triangles: impl LeafTriangles,
    ray: &Ray,
    traversal: Traversal,
    probe: &mut P,
) -> Option<Hit> {
    with_stack(tree.max_depth, |stack| closest_hit_with(baseline(), tree, leaf_triangles, ray, traversal, stack, probe))
}

/// [`closest_hit`] at the SIMD level of the caller, with a stack of [`new_stack`] that is reused from ray to ray.
#[inline(always)]
pub fn closest_hit_with<S: Simd, C: Container, P: Probe>(
    simd: S,
    tree: &Tree<C>,
    leaf_triangles: impl LeafTriangles,
    ray: &Ray,
    traversal: Traversal,
    stack: &mut [StackEntry],
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
                test_leaf(tree, leaf_triangles, range, &ray, shear, &mut nearest, probe);
                ControlFlow::Continue(nearest.t())
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
                test_leaf(tree, leaf_triangles, range, &ray, shear, &mut nearest, probe);
                ControlFlow::Continue(ray.ray.t_max)
            },
        ),
    }
    nearest.hit()
}

/// Whether anything lies on `ray` between its `t_min` and `t_max`. Visits the farthest child first: near its origin a ray
/// rarely hits the surface that it left.
#[inline]
pub fn any_hit<C: Container>(tree: &Tree<C>, leaf_triangles: impl LeafTriangles, ray: &Ray) -> bool {
    any_hit_with(tree, leaf_triangles, ray, &mut NoProbe)
}

/// [`any_hit`], observed by `probe`.
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
            for (offset, triangle) in leaf_triangles.in_slots(range.clone()).enumerate() {
                probe.primitive_test();
                let hit = triangle.intersect(&ray, shear, ray.ray.t_max);
                if P::EVENTS {
                    probe.tested(tree.primitive_indices[range.start + offset], hit.map(|hit| hit.t));
                }
                if let Some(hit) = hit {
                    if P::EVENTS {
                        probe.nearer(hit.t);
                    }
                    found = true;
                    return ControlFlow::Break(());
                }
            }
            ControlFlow::Continue(ray.ray.t_max)
        };
        walk::<_, C, P, true, true>(baseline(), tree, &ray, stack, probe, leaf);
    });
    found
}

/// Tests `ray` against the primitives in a range of slots.
#[inline(always)]
fn test_leaf<C, P: Probe>(
    tree: &Tree<C>,
    leaf_triangles: impl LeafTriangles,
    slots: Range<usize>,
    ray: &PreparedRay,
    shear: &Shear,
    nearest: &mut Nearest,
    probe: &mut P,
) {
    for (offset, triangle) in leaf_triangles.in_slots(slots.clone()).enumerate() {
        probe.primitive_test();
        let hit = triangle.intersect(ray, shear, nearest.t());
        if P::EVENTS {
            probe.tested(tree.primitive_indices[slots.start + offset], hit.map(|hit| hit.t));
        }
        if let Some(hit) = hit {
            let is_nearer = nearest.offer(hit, tree.primitive_indices[slots.start + offset]);
            if P::EVENTS && is_nearer {
                probe.nearer(hit.t);
            }
        }
    }
}
