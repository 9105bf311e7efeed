//! `build_tree(P)`, figure 6: the downward half of approximate agglomerative clustering (Gu et al., HPG 2013). Primitives are
//! partitioned by their codes until fewer than δ are left; on the way back up, the clusters of both sides are combined:
//!
//! ```text
//! build_tree(P):
//!     if |P| < δ:
//!         C = one cluster for each primitive of P
//!         return combine_clusters(C, f(δ))
//!     (P_left, P_right) = make_partition(P)
//!     C = build_tree(P_left) ∪ build_tree(P_right)
//!     return combine_clusters(C, f(|P|))
//! ```
//!
//! There are two implementations: [`TreeBuilder::build_tree`] recurses in parallel over large ranges, [`build_tree_in_task`] does the rest
//! within a task.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use std::ops::Range;

use fearless_simd::{Level, Simd};

use crate::aac::cluster::{Cluster, ClusterStack, item};
use crate::aac::cluster_container::ClusterContainer;
use crate::aac::combine::combine_clusters;
use crate::aac::combine_long::Scratch;
use crate::aac::leaf_order::TaskNodes;
use crate::aac::pair_writer::PairWriter;
use crate::aac::reduction::Reduction;
use crate::aac::tasks::{NodeSlots, TaskPlan};
use crate::cancel::{CancelToken, Cancelled, TaskProgress};
use crate::geometry::Triangle;
use crate::kernel::simd::dispatch;
use crate::order::SortedPrimitives;

/// Number of primitives whose containers are loaded at once, so that their cache misses overlap; they fit the L1 cache.
const LOADED: usize = 256;

/// Inputs of `build_tree` that are the same for every range.
pub struct TreeBuilder<'a, C: ClusterContainer> {
    triangles: &'a [Triangle],
    input: &'a SortedPrimitives<C>,
    reduction: &'a Reduction,
    level: Level,
    /// Progress by the primitives of finished tasks.
    progress: TaskProgress,
}

/// Result of `build_tree`: the clusters left of a range, and the nodes below them.
pub struct Forest<'a, C: ClusterContainer> {
    pub clusters: ClusterStack<C>,
    pub tasks: Vec<TaskNodes<'a, C>>,
}

impl<'a, C: ClusterContainer> TreeBuilder<'a, C> {
    /// A builder over `triangles`, which are sorted as `input`.
    pub fn new(
        triangles: &'a [Triangle],
        input: &'a SortedPrimitives<C>,
        reduction: &'a Reduction,
        level: Level,
    ) -> Self {
        Self { triangles, input, reduction, level, progress: TaskProgress::new(input.len() as u64) }
    }

    /// `build_tree` of the range `plan`, both sides in parallel; nodes are written to `slots`.
    pub fn build_tree<'n>(
        &self,
        plan: &TaskPlan,
        slots: NodeSlots<'_, 'n, C>,
        token: &CancelToken,
    ) -> Result<Forest<'n, C>, Cancelled> {
        token.check()?;
        // (P_left, P_right) = make_partition(P): the plan has it, or leaves the range to one task.
        let Some(sides) = &plan.sides else { return self.build_task(plan.range.clone(), slots, token) };
        let (mut pairs, [left_slots, right_slots]) = slots.split(plan, sides);
        // C = build_tree(P_left) ∪ build_tree(P_right)
        let [left, right] = &**sides;
        let (Forest { mut clusters, mut tasks }, mut right) = token.both(
            true,
            |token| self.build_tree(left, left_slots, token),
            |token| self.build_tree(right, right_slots, token),
        )?;
        clusters.append(&right.clusters, 0, right.clusters.len);
        tasks.append(&mut right.tasks);
        // return combine_clusters(C, f(|P|))
        let target = plan.reduced_count;
        dispatch!(self.level, simd => {
            combine_clusters(simd, &mut clusters, &mut Scratch::default(), 0, target, &mut pairs, token)
        })?;
        Ok(Forest { clusters, tasks })
    }

    /// `build_tree` of the primitives at the positions `range` by one thread.
    fn build_task<'n>(
        &self,
        range: Range<usize>,
        slots: NodeSlots<'_, 'n, C>,
        token: &CancelToken,
    ) -> Result<Forest<'n, C>, Cancelled> {
        let count = range.len() as u64;
        let mut pairs = PairWriter::new(&mut *slots.tasks, slots.tasks_offset);
        let mut clusters = dispatch!(self.level, simd => {
            build_tree_in_task(simd, self.triangles, self.input, self.reduction, range, &mut pairs, token)
        })?;
        // From here on a cluster refers to its nodes by an index that stands for this task's root.
        let mut roots = Vec::with_capacity(clusters.len);
        for (cluster, index) in clusters.items[..clusters.len].iter_mut().zip((slots.first_root..).step_by(2)) {
            roots.push(cluster.first);
            if item(cluster.first).is_none() {
                cluster.first = index as u32;
            }
        }
        self.progress.add(count, &token.share(0.1, 0.8));
        Ok(Forest { clusters, tasks: vec![TaskNodes { nodes: slots.tasks, offset: slots.tasks_offset, roots }] })
    }
}

/// A pending step of [`build_tree_in_task`].
enum Pending {
    /// Push the clusters of the primitives at these positions.
    Build(Range<usize>),
    /// Combine the topmost clusters of the stack, those of both sides of a partition: their number, and how many to leave.
    Combine(usize, usize),
}

/// `build_tree` of the primitives at the positions `range`, for one thread: without recursion, so that everything is inlined into
/// one function that was compiled for the machine's vector instructions. Returns the clusters that are left.
#[inline(always)]
fn build_tree_in_task<C: ClusterContainer, S: Simd>(
    simd: S,
    triangles: &[Triangle],
    input: &SortedPrimitives<C>,
    reduction: &Reduction,
    range: Range<usize>,
    pairs: &mut PairWriter<C>,
    token: &CancelToken,
) -> Result<ClusterStack<C>, Cancelled> {
    let mut stack = ClusterStack::with_capacity(LOADED);
    let mut scratch = Scratch::default();
    let mut loaded = ClusterStack::with_capacity(LOADED);
    let mut loaded_range = 0..0;
    let mut prefetched_to = 0;
    let mut steps = vec![Pending::Build(range)];
    while let Some(step) = steps.pop() {
        let (base, target) = match step {
            // return combine_clusters(C, f(|P|))
            Pending::Combine(count, target) => (stack.len - count, target),
            Pending::Build(range) => {
                if range.len() <= LOADED && range.start >= loaded_range.end {
                    token.check()?;
                    // Prefetch the primitives after these while these are clustered.
                    let prefetch_to = (range.end + LOADED).min(input.len());
                    for position in range.end.max(prefetched_to)..prefetch_to {
                        input.prefetch(triangles, position);
                    }
                    prefetched_to = prefetch_to;
                    for (at, position) in range.clone().enumerate() {
                        let cluster = if let Some((block, primitives)) = input.block(position) {
                            Cluster::of_item(block.fields(), position as u32, primitives.len() as u32)
                        } else {
                            let (fields, primitive) = input.fields(simd, triangles, position);
                            Cluster::of_primitive(fields, primitive)
                        };
                        loaded.set(at, cluster);
                    }
                    loaded_range = range.clone();
                }
                // (P_left, P_right) = make_partition(P); C = build_tree(P_left) ∪ build_tree(P_right)
                if range.len() >= reduction.threshold() {
                    let split = input.make_partition(&range);
                    let clusters =
                        reduction.reduced_count(split - range.start) + reduction.reduced_count(range.end - split);
                    steps.push(Pending::Combine(clusters, reduction.reduced_count(range.len())));
                    steps.push(Pending::Build(split..range.end));
                    steps.push(Pending::Build(range.start..split));
                    continue;
                }
                // if |P| < δ: one cluster for each primitive of P; return combine_clusters(C, f(δ))
                let base = stack.len;
                stack.append(&loaded, range.start - loaded_range.start, range.len());
                (base, reduction.reduced_count(range.len()))
            }
        };
        combine_clusters(simd, &mut stack, &mut scratch, base, target, pairs, token)?;
    }
    Ok(stack)
}
