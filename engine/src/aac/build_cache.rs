//! What a build leaves for the next one of the same triangles, so that a slider that is dragged neither sorts them again nor asks
//! the system for fresh memory each time.

use std::any::Any;
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::Duration;

use crate::aac::cluster::Clustered;
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::order::sorted_primitives::{Extent, SortedPrimitives, extent, sort_primitives};
use crate::settings::Curve;
use crate::stage_times::StageTimes;
use crate::tree::statistics::TreeStats;
use crate::tree::{Node, Tree};

/// What builds of the same triangles leave for each other. The trees are those of builds that begin with nothing.
#[derive(Default)]
pub struct BuildCache {
    extent: Option<Extent>,
    /// A [`Sorted`] of the last container.
    order: Option<Box<dyn Any + Send + Sync>>,
    spare: Arc<Spare>,
    /// Those of the last tree, where they were made on the way.
    pub(crate) stats: Option<TreeStats>,
}

/// A tree that nobody needs any more, for its memory.
type Spare = Mutex<Option<Box<dyn Any + Send>>>;

/// Where a tree goes that is no longer needed.
#[derive(Debug, Clone, Default)]
pub struct NodeRecycler(Weak<Spare>);

/// Sorted primitives, and how long that took.
pub(crate) struct Sorted<C: Clustered> {
    pub order: SortedPrimitives<C>,
    pub stages: Vec<(&'static str, Duration)>,
    curve: Curve,
    /// More than one build has sorted them.
    again: bool,
}

impl BuildCache {
    /// Where trees go for the next builds to write over.
    pub fn recycler(&self) -> NodeRecycler {
        NodeRecycler(Arc::downgrade(&self.spare))
    }

    /// The statistics of the tree that was built last, where the builder has made them on its way.
    pub fn take_stats(&mut self) -> Option<TreeStats> {
        self.stats.take()
    }

    /// [`extent`] of `triangles`.
    pub(crate) fn extent(&mut self, triangles: &[Triangle], token: &CancelToken) -> Result<Extent, Cancelled> {
        let known = if let Some(extent) = self.extent { extent } else { extent(triangles, token)? };
        self.extent = Some(known);
        Ok(known)
    }

    /// The list of nodes of a tree that was given up, or a new one; what is in it does not matter.
    pub(crate) fn nodes<C: Clustered>(&mut self, count: usize) -> Vec<Node<C>> {
        let spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner).take();
        match spare.and_then(|spare| spare.downcast::<Tree<C>>().ok()) {
            Some(tree) if tree.nodes.len() == count => tree.nodes,
            _ => bytemuck::zeroed_vec(count),
        }
    }

    pub(crate) fn keep<C: Clustered>(&mut self, sorted: Sorted<C>) {
        self.order = Some(Box::new(sorted));
    }
}

impl NodeRecycler {
    /// Leaves `tree` to the next build, where there will be one.
    pub fn recycle<C: Clustered>(&self, tree: Tree<C>) {
        if let Some(spare) = self.0.upgrade() {
            let before = spare.lock().unwrap_or_else(PoisonError::into_inner).replace(Box::new(tree));
            drop(before);
        }
    }
}

/// [`sort_primitives`] with its stages; kept from an earlier build where `cache` has it. The first two builds both sort, and the
/// shorter time counts: the first often waits for memory that the others find at hand.
pub(crate) fn sorted<C: Clustered>(
    triangles: &[Triangle],
    extent: &Extent,
    curve: Curve,
    cache: Option<&mut BuildCache>,
    token: &CancelToken,
) -> Result<Sorted<C>, Cancelled> {
    let kept = cache.and_then(|cache| cache.order.take()?.downcast::<Sorted<C>>().ok());
    let before = match kept.filter(|kept| kept.curve == curve) {
        Some(kept) if kept.again => return Ok(*kept),
        kept => kept.map(|kept| kept.stages),
    };
    let mut times = StageTimes::default();
    let order = sort_primitives(triangles, extent, curve, token, &mut times)?;
    let again = before.is_some();
    let total = |stages: &Vec<(&str, Duration)>| stages.iter().map(|stage| stage.1).sum::<Duration>();
    let stages = before.into_iter().fold(times.stages, |new, old| if total(&old) < total(&new) { old } else { new });
    Ok(Sorted { order, stages, curve, again })
}
