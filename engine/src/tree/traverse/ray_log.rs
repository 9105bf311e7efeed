//! All that a traversal did for one ray, in order.

use super::probe::{Probe, TestCounts};
use super::ray_event::RayEvent;

/// Records the steps of the traversal of one ray, and counts the tests.
///
/// ```
/// use bvhscope_engine::glam::Vec3;
/// use bvhscope_engine::tree::traverse::{RayEvent, RayLog, closest_hit};
/// use bvhscope_engine::{AnyTree, BuildSettings, CancelToken, Ray, Traversal, Triangle, build};
///
/// let at = |x: f32| Triangle { a: Vec3::X * x, b: Vec3::X * x + Vec3::Y, c: Vec3::X * x + Vec3::Z };
/// let triangles = [at(1.0), at(2.0)];
/// let bvh = build(&triangles, &BuildSettings::default(), &CancelToken::new())?;
/// let AnyTree::Aabb(tree) = bvh.tree() else { unreachable!("boxes are the default") };
/// let leaf_triangles = tree.leaf_triangles(&triangles, &CancelToken::new())?;
///
/// let mut log = RayLog::default();
/// let ray = Ray::new(Vec3::new(0.0, 0.2, 0.2), Vec3::X);
/// closest_hit(tree, &leaf_triangles, &ray, Traversal::Ordered, &mut log);
/// // The nearer triangle is hit; the other, which waits on the stack, begins behind it.
/// assert!(matches!(
///     log.events()[..],
///     [.., RayEvent::Nearer { t: 1.0 }, RayEvent::Pop { .. }, RayEvent::Cull { t: 2.0, .. }]
/// ));
/// # Ok::<(), bvhscope_engine::BuildError>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RayLog {
    events: Vec<RayEvent>,
    counts: TestCounts,
}

impl RayLog {
    /// The steps, in order.
    pub fn events(&self) -> &[RayEvent] {
        &self.events
    }

    /// Numbers of tests. In a [`Tree`](crate::tree::Tree) they are those of the events: each [`RayEvent::Enter`] and
    /// [`RayEvent::Miss`] is a container test, each [`RayEvent::Triangle`] a primitive test. In a [`wide`](crate::wide) tree
    /// each visit of a node is one container test, of all children at once, and up to four triangles are one primitive test.
    pub fn counts(&self) -> TestCounts {
        self.counts
    }

    /// Forgets all steps, so that another ray can be recorded.
    pub fn clear(&mut self) {
        self.events.clear();
        self.counts = TestCounts::default();
    }
}

impl Probe for RayLog {
    const EVENTS: bool = true;

    fn container_test(&mut self) {
        self.counts.container_test();
    }
    fn primitive_test(&mut self) {
        self.counts.primitive_test();
    }
    fn event(&mut self, event: RayEvent) {
        self.events.push(event);
    }
}
