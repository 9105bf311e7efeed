//! The record of a construction: number, level and list of each merge.

use std::ops::Range;

use crate::aac::{Recursion, ReductionStep};
use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use crate::kernel::parallel::{par_collect, zeros};
use crate::tree::{Container, Tree};

/// The merges of a construction, numbered from 0 in the order of a build by one thread: everything in the left side of a range,
/// everything in its right side, then the range itself; of PLOC round by round along the list. A tree of n leaves has n − 1 merges. Takes some 20 bytes per primitive.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MergeRecord {
    /// Number of merges up to the one that made each node, that one included; 0 for leaves.
    births: Vec<u32>,
    /// The node that each merge made.
    nodes: Vec<u32>,
    /// The calls of `combine_clusters` in serial order; of PLOC its rounds.
    steps: Vec<ReductionStep>,
    /// Position in sorted order of the primitive in each slot of [`Tree::primitive_indices`].
    positions: Vec<u32>,
}

impl MergeRecord {
    /// The record of `tree`, made by `recursion`, before its primitive indices are replaced by those of their triangles.
    pub(super) fn of_recursion<C: Container>(
        tree: &Tree<C>,
        recursion: Recursion,
        token: &CancelToken,
    ) -> Result<Self, Cancelled> {
        let Recursion { steps, merge_of_pair, positions } = recursion;
        let slots = &tree.primitive_indices;
        let positions = par_collect(slots.len(), token, |slot| positions[slots[slot] as usize])?;
        Self::new(tree, steps, positions, |pair| merge_of_pair[pair], token)
    }

    /// The record of `tree`, for which all primitives in order of their index were one list.
    pub(super) fn of_one_list<C: Container>(tree: &Tree<C>, token: &CancelToken) -> Result<Self, Cancelled> {
        let count = tree.primitive_indices.len() as u32;
        let step = ReductionStep {
            level: 0,
            first_primitive: 0,
            primitives: count,
            before: count,
            after: 1,
            first_merge: 0,
            first_step: 0,
        };
        // The last merge is written first.
        let merge_of_pair = |pair: usize| count - 2 - pair as u32;
        Self::new(tree, vec![step], tree.primitive_indices.clone(), merge_of_pair, token)
    }

    fn new<C: Container>(
        tree: &Tree<C>,
        steps: Vec<ReductionStep>,
        positions: Vec<u32>,
        merge_of_pair: impl Fn(usize) -> u32 + Sync,
        token: &CancelToken,
    ) -> Result<Self, Cancelled> {
        let births = par_collect(tree.nodes.len(), token, |index| {
            let node = &tree.nodes[index];
            if node.is_leaf() { 0 } else { 1 + merge_of_pair(node.first as usize / 2) }
        })?;
        let mut nodes = zeros::<u32>(births.len() / 2, token)?;
        for (index, &birth) in births.iter().enumerate() {
            token.check_every(LIGHT_STEPS, index)?;
            if birth > 0 {
                nodes[birth as usize - 1] = index as u32;
            }
        }
        Ok(Self { births, nodes, steps, positions })
    }

    /// Number of merges.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether nothing was merged: a tree of at most one primitive.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Number of merges up to the one that made each node, that one included; 0 for leaves.
    pub fn births(&self) -> &[u32] {
        &self.births
    }

    /// The node that each merge made, in order.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// The calls of `combine_clusters` in serial order, those that had nothing to merge included. The last is the
    /// `combine_clusters(C, 1)` of figure 5. Of H-PLOC the lists of the recursion, the last of which is the root's until one cluster is
    /// left; of PLOC the rounds, the level of each being the number of rounds after it.
    pub fn steps(&self) -> &[ReductionStep] {
        &self.steps
    }

    /// Position in sorted order of the primitive in each slot of [`Tree::primitive_indices`].
    pub fn positions(&self) -> &[u32] {
        &self.positions
    }

    /// Number of the merge that made `node`; `None` for a leaf.
    pub fn merge_of(&self, node: u32) -> Option<u32> {
        self.births.get(node as usize)?.checked_sub(1)
    }

    /// Index of the step that did `merge`; `None` where there is no such merge.
    pub fn step_of(&self, merge: u32) -> Option<usize> {
        // Of steps with the same first merge, all but the last have none.
        let after = self.steps.partition_point(|step| step.first_merge <= merge);
        (after > 0 && (merge as usize) < self.len()).then(|| after - 1)
    }

    /// Length of the list of clusters that `merge` chose from.
    pub fn list_length(&self, merge: u32) -> Option<u32> {
        let step = &self.steps[self.step_of(merge)?];
        Some(step.before - (merge - step.first_merge))
    }

    /// Level of the recursion that made `node`; `None` for a leaf.
    pub fn level_of(&self, node: u32) -> Option<u32> {
        Some(self.steps[self.step_of(self.merge_of(node)?)?].level)
    }

    /// Indices of the steps whose clusters the step `index` combines: none, the one before the last call, or those of both sides.
    pub fn steps_below(&self, index: usize) -> impl Iterator<Item = usize> + use<> {
        let own = self.steps.get(index);
        let last = index.checked_sub(1).filter(|_| own.is_some_and(|step| (step.first_step as usize) < index));
        // The side on the left ends before the one on the right begins.
        let is_root = index + 1 == self.steps.len();
        let right = last.filter(|_| !is_root).map(|last| self.steps[last].first_step as usize);
        right.and_then(|first| first.checked_sub(1)).into_iter().chain(last)
    }

    /// Numbers of the merges in the step `index` and in all below it.
    pub(super) fn merges_within(&self, index: usize) -> Range<u32> {
        let step = &self.steps[index];
        self.steps[step.first_step as usize].first_merge..step.merges().end
    }
}
