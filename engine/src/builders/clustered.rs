//! Clusters of builders that merge along the curve, before they are flattened into a tree, and the calls that merged them.

use crate::aac::{ClusterContainer, Recursion, ReductionStep};
use crate::builders::flatten::{ChildPair, finish};
use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use crate::kernel::parallel::zeros;
use crate::order::SortedPrimitives;
use crate::stage_times::{Stage, StageTimes};
use crate::tree::{Node, Tree};

/// The calls that merged clusters, in the order of a build by one thread, and the merges.
#[derive(Debug, Default)]
pub struct MergeLog {
    /// The calls, those that had nothing to merge included.
    pub steps: Vec<ReductionStep>,
    /// Slot of the children of each merge.
    pub slots: Vec<u32>,
    /// Level of the recursion of the present call.
    pub level: u32,
}

impl MergeLog {
    /// Number of merges so far.
    pub fn merges(&self) -> u32 {
        self.slots.len() as u32
    }
}

/// The clusters of a build, before they are flattened.
pub struct Clustered<C: ClusterContainer> {
    /// The root.
    pub root: Node<C>,
    /// The children of all others.
    pub slots: Vec<ChildPair<C>>,
    /// The primitives, to whose positions leaves refer.
    pub sorted: SortedPrimitives<C>,
    /// The stage that made them.
    pub stage: Stage,
}

impl<C: ClusterContainer> Clustered<C> {
    /// The tree.
    pub fn finish(self, token: &CancelToken, times: &mut StageTimes) -> Result<Tree<C>, Cancelled> {
        let Self { root, slots, sorted, stage } = self;
        finish(root, &slots, |position| sorted.primitive(position), stage, token, times)
    }

    /// The tree, and the calls of `log` that made it.
    pub fn finish_with_merges(
        self,
        log: MergeLog,
        token: &CancelToken,
        times: &mut StageTimes,
    ) -> Result<(Tree<C>, Recursion), Cancelled> {
        let Self { root, slots, sorted, stage } = self;
        let tree = finish(root, &slots, |position| sorted.primitive(position), stage, token, times)?;
        let mut merge_of_slot: Vec<u32> = zeros(slots.len(), token)?;
        for (merge, &slot) in (0..).zip(&log.slots) {
            merge_of_slot[slot as usize] = merge;
        }
        let mut merge_of_pair = zeros(tree.nodes.len() / 2, token)?;
        let mut positions = zeros(tree.primitive_indices.len(), token)?;
        // Nodes of the tree with what they were before.
        let mut open = vec![(0, root)];
        let mut steps = 0;
        while let Some((at, cluster)) = open.pop() {
            steps += 1;
            token.check_every(LIGHT_STEPS, steps)?;
            let first = tree.nodes[at as usize].first;
            if cluster.count == 1 {
                positions[tree.primitive_indices[first as usize] as usize] = cluster.first;
                continue;
            }
            merge_of_pair[first as usize / 2] = merge_of_slot[cluster.first as usize];
            let [left, right] = slots[cluster.first as usize];
            open.extend([(first, left), (first + 1, right)]);
        }
        Ok((tree, Recursion { steps: log.steps, merge_of_pair, positions }))
    }
}
