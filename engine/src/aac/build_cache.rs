//! Memory and order that a build leaves for the next one of the same triangles: while a slider is dragged, primitives are sorted once and
//! the
//! nodes of discarded trees are overwritten instead of allocated again.

use std::any::Any;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use crate::aac::cluster_container::ClusterContainer;
use crate::order::{InputBounds, SortedPrimitives};
use crate::settings::Curve;
use crate::tree::statistics::TreeStats;
use crate::tree::{Container, Node, Tree};

/// Intermediate results of builds of the same triangles: their bounds, the primitives sorted along a curve, and memory for
/// nodes. A build with a cache makes the same tree as one without.
#[derive(Default)]
pub struct BuildCache {
    bounds: Option<InputBounds>,
    /// A [`SortedOrder`] of the container that was built last.
    order: Option<Box<dyn Any + Send + Sync>>,
    spare: Arc<SpareTree>,
    /// Statistics of the tree that was built last, where the builder has computed them.
    stats: Option<TreeStats>,
}

/// A discarded tree, whose memory the next build may use.
type SpareTree = Mutex<Option<Box<dyn Any + Send>>>;

/// Takes discarded trees, so that the next build with the same [`BuildCache`] writes to their memory. Holds nothing once the
/// cache is gone.
#[derive(Debug, Clone, Default)]
pub struct NodeRecycler(Weak<SpareTree>);

/// Primitives sorted along a curve.
struct SortedOrder<C: ClusterContainer> {
    primitives: SortedPrimitives<C>,
    curve: Curve,
}

impl BuildCache {
    /// Takes the trees that are no longer needed, for later builds with this cache.
    pub fn recycler(&self) -> NodeRecycler {
        NodeRecycler(Arc::downgrade(&self.spare))
    }

    /// Statistics of the tree that was built last, where the builder has computed them with the tree; `None` the second time.
    pub fn take_stats(&mut self) -> Option<TreeStats> {
        self.stats.take()
    }

    /// Bounds of the triangles, where an earlier build has computed them.
    pub(crate) fn input_bounds(&self) -> Option<InputBounds> {
        self.bounds
    }

    /// Stores the bounds of the triangles for the next build.
    pub(crate) fn store_input_bounds(&mut self, bounds: InputBounds) {
        self.bounds = Some(bounds);
    }

    /// The primitives as the last build has sorted them; `None` if it used another container or another curve.
    pub(super) fn take_order<C: ClusterContainer>(&mut self, curve: Curve) -> Option<SortedPrimitives<C>> {
        let order = self.order.take()?.downcast::<SortedOrder<C>>().ok()?;
        (order.curve == curve).then_some(order.primitives)
    }

    /// Stores the primitives, sorted along `curve`, for the next build.
    pub(super) fn store_order<C: ClusterContainer>(&mut self, primitives: SortedPrimitives<C>, curve: Curve) {
        self.order = Some(Box::new(SortedOrder { primitives, curve }));
    }

    /// Stores the statistics for [`Self::take_stats`].
    pub(super) fn store_stats(&mut self, stats: Option<TreeStats>) {
        self.stats = stats;
    }

    /// The nodes of a discarded tree of `count` nodes, if there is one; what they contain is unspecified.
    pub(super) fn nodes<C: ClusterContainer>(&mut self, count: usize) -> Option<Vec<Node<C>>> {
        let spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner).take();
        let tree = spare.and_then(|spare| spare.downcast::<Tree<C>>().ok())?;
        (tree.nodes.len() == count).then_some(tree.nodes)
    }
}

impl NodeRecycler {
    /// Gives `tree` to the next build with the cache, if there still is one; it replaces a tree given before.
    pub fn recycle<C: Container>(&self, tree: Tree<C>) {
        if let Some(spare) = self.0.upgrade() {
            let replaced = spare.lock().unwrap_or_else(PoisonError::into_inner).replace(Box::new(tree));
            // Freed after the lock is released.
            drop(replaced);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::aac::build_bvh;
    use crate::cancel::CancelToken;
    use crate::geometry::{Aabb, Sphere, Triangle};
    use crate::order::input_bounds;
    use crate::settings::BuildSettings;
    use crate::stage_times::StageTimes;

    /// A build of `triangles` with `cache`: the tree and the stages.
    fn build<C: ClusterContainer>(
        triangles: &[Triangle],
        settings: &BuildSettings,
        cache: Option<&mut BuildCache>,
    ) -> (Tree<C>, StageTimes) {
        let (token, mut times) = (CancelToken::new(), StageTimes::default());
        let Ok(bounds) = input_bounds(triangles, &token) else { panic!("not cancelled") };
        let Ok(tree) = build_bvh(triangles, None, &bounds, settings, cache, &token, &mut times) else {
            panic!("not cancelled")
        };
        (tree, times)
    }

    /// Builds with and without `cache`, compares the trees, and returns the names of the stages that were reused and that ran.
    fn check<C: ClusterContainer>(settings: &BuildSettings, cache: &mut BuildCache) -> [Vec<&'static str>; 2] {
        let triangles: Vec<Triangle> = (0..20_000)
            .map(|i| {
                let a = Vec3::new((i % 141) as f32, (i * 7 % 97) as f32, (i / 141) as f32);
                Triangle { a, b: a + Vec3::X * 0.7, c: a + Vec3::new(0.2, 0.5, (i % 3) as f32) }
            })
            .collect();
        let (tree, times) = build::<C>(&triangles, settings, Some(&mut *cache));
        let (expected, _) = build::<C>(&triangles, settings, None);
        assert!(tree == expected, "{settings:?}: a cache changes the tree");
        assert_eq!(times.total(), times.stages.iter().map(|stage| stage.1).sum());
        cache.recycler().recycle(tree);
        [times.reused, times.stages.iter().map(|stage| stage.0).collect()]
    }

    #[test]
    fn the_second_build_reuses_what_the_first_has_sorted() {
        let sorted = [vec![], vec!["codes", "sort", "tree", "flatten"]];
        let reused = [vec!["codes", "sort"], vec!["tree", "flatten"]];
        let morton = BuildSettings::default();
        let other_threshold = BuildSettings { threshold: 17, ..morton };
        let hilbert = BuildSettings { curve: Curve::Hilbert, ..morton };
        let mut cache = BuildCache::default();
        assert_eq!(check::<Aabb>(&morton, &mut cache), sorted);
        assert_eq!(check::<Aabb>(&other_threshold, &mut cache), reused);
        assert_eq!(check::<Aabb>(&morton, &mut cache), reused);
        assert_eq!(check::<Aabb>(&hilbert, &mut cache), sorted, "another curve");
        assert_eq!(check::<Aabb>(&hilbert, &mut cache), reused);
        assert_eq!(check::<Sphere>(&hilbert, &mut cache), sorted, "another container");
        assert_eq!(check::<Sphere>(&hilbert, &mut cache), reused);
    }
}
