//! How `build_tree` is divided among parallel tasks, and where in the list of nodes each part of the tree is written.
//!
//! A range of x primitives always leaves [`Reduction::reduced_count`] x clusters, so that the number of merges in each range is
//! known before any of them happens: every node is written once, directly to its index. The list of nodes holds the
//! root, then the pairs merged in ranges above the tasks, then those of each task, and within each of these the last
//! merge comes first, so that parents precede their children.

use std::ops::Range;

use crate::aac::cluster_container::ClusterContainer;
use crate::aac::pair_writer::PairWriter;
use crate::aac::reduction::Reduction;
use crate::order::SortedPrimitives;
use crate::tree::Node;

/// Maximum number of primitives that one task builds. Gu et al. fork down to single clusters; below some thousand primitives a
/// fork costs more than it gains, and what a task writes should fit a core's L2 cache.
const MAX_TASK_PRIMITIVES: usize = 8192;

/// The partitions of a range of primitives down to its tasks, with the number of clusters and merges of each part.
pub struct TaskPlan {
    /// Positions of the primitives in sorted order.
    pub range: Range<usize>,
    /// The two sides of the range's partition; `None` where one task builds the whole range.
    pub sides: Option<Box<[Self; 2]>>,
    /// Number of clusters that are left of the range, f(|P|).
    pub reduced_count: usize,
    /// Number of merges above the tasks.
    pub top_pairs: usize,
    /// Number of clusters that the tasks leave.
    pub task_roots: usize,
}

impl TaskPlan {
    /// Partitions `range` until each part is small enough for one task.
    pub fn new<C: ClusterContainer>(input: &SortedPrimitives<C>, reduction: &Reduction, range: Range<usize>) -> Self {
        let reduced_count = reduction.reduced_count(range.len());
        if range.len() <= MAX_TASK_PRIMITIVES {
            return Self { range, sides: None, reduced_count, top_pairs: 0, task_roots: reduced_count };
        }
        let split = input.make_partition(&range);
        let sides = [range.start..split, split..range.end].map(|side| Self::new(input, reduction, side));
        let own_pairs = sides[0].reduced_count + sides[1].reduced_count - reduced_count;
        Self {
            range,
            reduced_count,
            top_pairs: own_pairs + sides[0].top_pairs + sides[1].top_pairs,
            task_roots: sides[0].task_roots + sides[1].task_roots,
            sides: Some(Box::new(sides)),
        }
    }

    /// Number of nodes above the tasks: the root, the pairs of the last `combine_clusters`, and those that ranges above tasks merge.
    pub fn top_len(&self) -> usize {
        1 + 2 * (self.reduced_count - 1) + 2 * self.top_pairs
    }

    /// Number of merges within the tasks.
    fn task_pairs(&self) -> usize {
        self.range.len() - self.reduced_count - self.top_pairs
    }
}

/// The slices of the list of nodes that a range's merges are written to.
pub struct NodeSlots<'t, 'n, C> {
    /// Slots of the pairs merged above the tasks, and the index of the first of them in the whole list.
    pub top: &'t mut [Node<C>],
    pub top_offset: usize,
    /// Slots of the pairs that tasks merge, and the index of the first of them in the whole list.
    pub tasks: &'n mut [Node<C>],
    pub tasks_offset: usize,
    /// Index that stands for the first cluster that this range's tasks leave, odd as that of every pair, see
    /// [`crate::aac::leaf_order::order_leaves`].
    pub first_root: usize,
}

impl<'t, 'n, C: ClusterContainer> NodeSlots<'t, 'n, C> {
    /// Divides the whole list of nodes: the root, the slots of the last `combine_clusters`, those of all of `plan`. `top` are its
    /// first [`TaskPlan::top_len`] nodes, `tasks` the others.
    pub fn whole(
        plan: &TaskPlan,
        top: &'t mut [Node<C>],
        tasks: &'n mut [Node<C>],
    ) -> (&'t mut Node<C>, PairWriter<'t, C>, Self) {
        let top_len = top.len();
        let last_len = 2 * (plan.reduced_count - 1);
        let (root, top_pairs) = top.split_at_mut(1);
        let (last_pairs, top) = top_pairs.split_at_mut(last_len);
        let slots = Self { top, top_offset: 1 + last_len, tasks, tasks_offset: top_len, first_root: top_len };
        (&mut root[0], PairWriter::new(last_pairs, 1), slots)
    }

    /// Divides the slots of the range `plan`: those of the pairs that it merges itself, then those of its two `sides`.
    pub fn split(self, plan: &TaskPlan, sides: &[TaskPlan; 2]) -> (PairWriter<'t, C>, [Self; 2]) {
        let [left, right] = sides;
        let own_pairs = plan.top_pairs - left.top_pairs - right.top_pairs;
        let (own_nodes, sides_top) = self.top.split_at_mut(2 * own_pairs);
        let (left_top, right_top) = sides_top.split_at_mut(2 * left.top_pairs);
        let (left_tasks, right_tasks) = self.tasks.split_at_mut(2 * left.task_pairs());
        let left_top_offset = self.top_offset + own_nodes.len();
        let right_slots = Self {
            top_offset: left_top_offset + left_top.len(),
            top: right_top,
            tasks_offset: self.tasks_offset + left_tasks.len(),
            tasks: right_tasks,
            first_root: self.first_root + 2 * left.task_roots,
        };
        let left_slots = Self {
            top_offset: left_top_offset,
            top: left_top,
            tasks_offset: self.tasks_offset,
            tasks: left_tasks,
            first_root: self.first_root,
        };
        (PairWriter::new(own_nodes, self.top_offset), [left_slots, right_slots])
    }
}
