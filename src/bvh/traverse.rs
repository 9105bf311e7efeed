//! Rays through the binary tree, counting through a [`Probe`] that costs nothing when off.

use serde::{Deserialize, Serialize};

use super::{Container, Tree};
use crate::geometry::{Hit, Ray, Triangle};

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
pub fn closest_hit<C: Container, P: Probe>(
    _tree: &Tree<C>,
    _leaf_triangles: &[Triangle],
    _ray: &Ray,
    _traversal: Traversal,
    _probe: &mut P,
) -> Option<Hit> {
    todo!("bvh")
}

/// Whether anything lies on `ray` between its `t_min` and `t_max`.
pub fn any_hit<C: Container>(_tree: &Tree<C>, _leaf_triangles: &[Triangle], _ray: &Ray) -> bool {
    todo!("bvh")
}
