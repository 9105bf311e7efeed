//! The recursion of `build_tree` as a list. Which ranges of primitives it visits, how many clusters each has and leaves, and where
//! their merges are written follow from the sorted primitives, f and the layout of the nodes alone: a build records nothing.

use std::ops::Range;

use crate::aac::cluster_container::ClusterContainer;
use crate::aac::pair_writer::PairWriter;
use crate::aac::reduction::Reduction;
use crate::aac::tasks::{NodeSlots, TaskPlan};
use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::parallel::zeros;
use crate::order::SortedPrimitives;
use crate::settings::BuildSettings;
use crate::tree::Node;

/// Steps or primitives between two polls for cancellation.
const STEPS_BETWEEN_CHECKS: usize = 1 << 13;

/// One call of `combine_clusters` (figure 7), which reduces the clusters of a range of primitives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReductionStep {
    /// Depth of the recursion of `build_tree` that made the call; 0 over all primitives, and for the last `combine_clusters(C, 1)`.
    pub level: u32,
    /// Position of the range's first primitive in sorted order.
    pub first_primitive: u32,
    /// Number of primitives of the range, x.
    pub primitives: u32,
    /// Length of the list of clusters when the call begins.
    pub before: u32,
    /// Length of the list when it ends: f(x), and 1 for the last call.
    pub after: u32,
    /// Number of merges before this call, in serial order.
    pub first_merge: u32,
    /// Index of the first step of the calls below this one; its own where the range was not partitioned.
    pub first_step: u32,
}

impl ReductionStep {
    /// Numbers of the merges of this call.
    pub fn merges(&self) -> Range<u32> {
        self.first_merge..self.first_merge + (self.before - self.after)
    }

    /// Positions of its primitives in sorted order.
    pub fn positions(&self) -> Range<u32> {
        self.first_primitive..self.first_primitive + self.primitives
    }
}

/// The calls of a build by one thread, in order: left side, right side, then the range itself.
pub struct Recursion {
    /// The calls of `combine_clusters` in order; the last is `combine_clusters(C, 1)` of figure 5.
    pub steps: Vec<ReductionStep>,
    /// Number of the merge that wrote the children at `1 + 2·i` and `2 + 2·i`.
    pub merge_of_pair: Vec<u32>,
    /// Position in sorted order of each primitive, by its index in the input.
    pub positions: Vec<u32>,
}

/// The recursion that made the tree with these `nodes` of the sorted primitives `input`. Nodes are not changed.
pub fn recursion_of<C: ClusterContainer>(
    input: &SortedPrimitives<C>,
    settings: &BuildSettings,
    nodes: &mut [Node<C>],
    token: &CancelToken,
) -> Result<Recursion, Cancelled> {
    let reduction = Reduction::of(settings);
    let plan = TaskPlan::new(input, &reduction, 0..input.len());
    let merge_of_pair = zeros(nodes.len() / 2, token)?;
    let mut positions = zeros(input.len(), token)?;
    for position in 0..input.len() {
        token.check_every(STEPS_BETWEEN_CHECKS, position)?;
        positions[input.primitive(position) as usize] = position as u32;
    }
    let (top, tasks) = nodes.split_at_mut(plan.top_len());
    let (_, mut last_pairs, slots) = NodeSlots::whole(&plan, top, tasks);
    let mut walk = Walk { input, reduction: &reduction, steps: Vec::new(), merge_of_pair, merges: 0, token };
    walk.plan(&plan, slots, 0)?;
    walk.step(plan.range.clone(), 0, plan.reduced_count, 1, 0, &mut last_pairs)?;
    Ok(Recursion { steps: walk.steps, merge_of_pair: walk.merge_of_pair, positions })
}

/// The recursion, serially.
struct Walk<'a, C: ClusterContainer> {
    input: &'a SortedPrimitives<C>,
    reduction: &'a Reduction,
    steps: Vec<ReductionStep>,
    merge_of_pair: Vec<u32>,
    /// Number of merges so far.
    merges: u32,
    token: &'a CancelToken,
}

impl<C: ClusterContainer> Walk<'_, C> {
    /// `build_tree` of the range `plan`, whose nodes are in `slots`.
    fn plan(&mut self, plan: &TaskPlan, slots: NodeSlots<'_, '_, C>, level: u32) -> Result<(), Cancelled> {
        let Some(sides) = &plan.sides else {
            let mut pairs = PairWriter::new(slots.tasks, slots.tasks_offset);
            return self.range(plan.range.clone(), level, &mut pairs);
        };
        let first_step = self.steps.len();
        let (mut pairs, [left_slots, right_slots]) = slots.split(plan, sides);
        self.plan(&sides[0], left_slots, level + 1)?;
        self.plan(&sides[1], right_slots, level + 1)?;
        let before = sides[0].reduced_count + sides[1].reduced_count;
        self.step(plan.range.clone(), level, before, plan.reduced_count, first_step, &mut pairs)
    }

    /// `build_tree` of a `range` within a task, whose nodes are in `pairs`. A range is partitioned once per bit of the codes, then
    /// halved: the recursion is at most some hundred calls deep.
    fn range(&mut self, range: Range<usize>, level: u32, pairs: &mut PairWriter<C>) -> Result<(), Cancelled> {
        let first_step = self.steps.len();
        let after = self.reduction.reduced_count(range.len());
        let before = if range.len() < self.reduction.threshold() {
            range.len()
        } else {
            let split = self.input.make_partition(&range);
            self.range(range.start..split, level + 1, pairs)?;
            self.range(split..range.end, level + 1, pairs)?;
            self.reduction.reduced_count(split - range.start) + self.reduction.reduced_count(range.end - split)
        };
        self.step(range, level, before, after, first_step, pairs)
    }

    /// `combine_clusters` of the clusters of `range`, of which there are `before`, until `after` are left.
    fn step(
        &mut self,
        range: Range<usize>,
        level: u32,
        before: usize,
        after: usize,
        first_step: usize,
        pairs: &mut PairWriter<C>,
    ) -> Result<(), Cancelled> {
        self.token.check_every(STEPS_BETWEEN_CHECKS, self.steps.len())?;
        self.steps.push(ReductionStep {
            level,
            first_primitive: range.start as u32,
            primitives: range.len() as u32,
            before: before as u32,
            after: after as u32,
            first_merge: self.merges,
            first_step: first_step as u32,
        });
        for _ in after..before {
            self.merge_of_pair[pairs.skip() as usize / 2] = self.merges;
            self.merges += 1;
        }
        Ok(())
    }
}
