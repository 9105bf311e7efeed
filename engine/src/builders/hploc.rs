//! Hierarchical parallel locally-ordered clustering (Benthin, Meister, Barczak, Mehalwal, Tsakok, Kensler, *H-PLOC: Hierarchical Parallel
//! Locally-Ordered Clustering for Bounding Volume Hierarchy Construction*, 2024): the rounds of PLOC, on short lists. The lists are
//! those of the nodes of a linear BVH, bottom-up: a node of more primitives than half a wave joins the clusters that both of its children
//! have left, and merges mutual nearest neighbours until half a wave is left; the root goes on until one is.
//!
//! A GPU does this in one kernel, a wave of 32 threads for each list. Here it is a recursion, whose sides are independent.

use std::ops::Range;

use crate::aac::{ClusterContainer, ReductionStep};
use crate::builders::clustered::{Clustered, MergeLog};
use crate::builders::flatten::ChildPair;
use crate::builders::ploc::nearest;
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::kernel::parallel::zeros;
use crate::order::{InputBounds, SortedPrimitives, sort_primitives};
use crate::settings::Curve;
use crate::stage_times::{Stage, StageTimes};
use crate::tree::{Node, Tree};

/// Number of clusters in the longest list: one for each thread of a wave.
const WAVE: usize = 32;
/// Number of clusters that a node leaves to its parent at most, and of primitives that are not yet merged.
const HALF_WAVE: usize = WAVE / 2;
/// Maximum number of primitives that are built by one thread; poll for cancellation before each.
const FORK_ABOVE: usize = 4096;

/// An active cluster.
#[derive(Clone, Copy)]
struct Cluster<C> {
    node: Node<C>,
    /// Position of one of its primitives, which no other active cluster has. The later one of two that merge gives its own away: the
    /// slot of their union.
    place: u32,
}

/// Builds a tree with one triangle per leaf.
pub fn build<C: ClusterContainer>(
    triangles: &[Triangle],
    bounds: &InputBounds,
    curve: Curve,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    cluster(triangles, bounds, curve, None, token, times)?.finish(token, times)
}

/// Merges all clusters: with a `log` by one thread.
pub fn cluster<C: ClusterContainer>(
    triangles: &[Triangle],
    bounds: &InputBounds,
    curve: Curve,
    mut log: Option<&mut MergeLog>,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Clustered<C>, Cancelled> {
    let count = triangles.len();
    let sorted = sort_primitives::<C>(triangles, bounds, curve, token, times)?;
    let stage = Stage::begin("tree", token);
    let mut slots: Vec<ChildPair<C>> = zeros(count, token)?;
    let mut clusters = Vec::with_capacity(2 * WAVE);
    combine(&Input { triangles, sorted: &sorted }, 0, &mut slots, &mut clusters, log.as_deref_mut(), token)?;
    let list = List { base: 0, range: 0..count, target: 1, first_step: 0 };
    list.merge(&mut clusters, &mut slots, log);
    Ok(Clustered { root: clusters[0].node, slots, sorted, stage })
}

/// The primitives, and their order.
struct Input<'a, C: ClusterContainer> {
    triangles: &'a [Triangle],
    sorted: &'a SortedPrimitives<C>,
}

/// Adds the clusters that the primitives from the position `first` on leave, as many as there are `slots`, to the end of `clusters`: half a
/// wave at most. The depth of the recursion is bounded by the bits of a code and by halving groups of equal codes.
fn combine<C: ClusterContainer>(
    input: &Input<'_, C>,
    first: usize,
    slots: &mut [ChildPair<C>],
    clusters: &mut Vec<Cluster<C>>,
    mut log: Option<&mut MergeLog>,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    let range = first..first + slots.len();
    let (base, first_step) = (clusters.len(), log.as_ref().map_or(0, |log| log.steps.len() as u32));
    let list = List { base, range: range.clone(), target: HALF_WAVE, first_step };
    if range.len() <= HALF_WAVE {
        clusters.extend(range.map(|position| {
            let container = input.sorted.container(input.triangles, input.sorted.primitive(position));
            Cluster { node: Node { container, first: position as u32, count: 1 }, place: position as u32 }
        }));
        list.merge(clusters, slots, log);
        return Ok(());
    }
    if let Some(log) = &mut log {
        log.level += 1;
    }
    let middle = input.sorted.make_partition(&range);
    let (left_slots, right_slots) = slots.split_at_mut(middle - first);
    if range.len() > FORK_ABOVE && log.is_none() {
        let mut right_clusters = Vec::with_capacity(2 * WAVE);
        token.both(
            true,
            |token| combine(input, first, left_slots, clusters, None, token),
            |token| combine(input, middle, right_slots, &mut right_clusters, None, token),
        )?;
        clusters.append(&mut right_clusters);
    } else {
        combine(input, first, left_slots, clusters, log.as_deref_mut(), token)?;
        combine(input, middle, right_slots, clusters, log.as_deref_mut(), token)?;
    }
    if let Some(log) = &mut log {
        log.level -= 1;
    }
    list.merge(clusters, slots, log);
    Ok(())
}

/// A list of clusters at the end of all.
struct List {
    /// Place of its first cluster.
    base: usize,
    /// Positions of its primitives.
    range: Range<usize>,
    /// Number of clusters that it leaves at most.
    target: usize,
    /// Number of calls in the log before those of both sides.
    first_step: u32,
}

impl List {
    /// Merges its clusters, a wave at most, in rounds. Children are written to the slots, the first of which is that of its first position.
    fn merge<C: ClusterContainer>(
        &self,
        clusters: &mut Vec<Cluster<C>>,
        slots: &mut [ChildPair<C>],
        mut log: Option<&mut MergeLog>,
    ) {
        let (base, before) = (self.base, clusters.len() - self.base);
        let first_merge = log.as_ref().map_or(0, |log| log.merges());
        while clusters.len() - base > self.target {
            self.round(clusters, slots, log.as_deref_mut());
        }
        if let Some(log) = log {
            log.steps.push(ReductionStep {
                level: log.level,
                first_primitive: self.range.start as u32,
                primitives: self.range.len() as u32,
                before: before as u32,
                after: (clusters.len() - base) as u32,
                first_merge,
                first_step: self.first_step,
            });
        }
    }

    /// Merges those that are each other's nearest.
    fn round<C: ClusterContainer>(
        &self,
        clusters: &mut Vec<Cluster<C>>,
        slots: &mut [ChildPair<C>],
        mut log: Option<&mut MergeLog>,
    ) {
        let base = self.base;
        let list = &mut clusters[base..];
        let mut partners = [0; WAVE];
        for (at, partner) in partners[..list.len()].iter_mut().enumerate() {
            *partner = nearest(list.len(), |at| &list[at].node.container, at) as usize;
        }
        let mut kept = 0;
        for at in 0..list.len() {
            let other = partners[at];
            let is_mutual = partners[other] == at;
            if is_mutual && other < at {
                continue;
            }
            let mut cluster = list[at];
            if is_mutual {
                let [earlier, later] = [cluster, list[other]];
                slots[later.place as usize - self.range.start] = [earlier.node, later.node];
                if let Some(log) = &mut log {
                    log.slots.push(later.place);
                }
                cluster.node = Node {
                    container: earlier.node.container.union(&later.node.container),
                    first: later.place,
                    count: earlier.node.count + later.node.count,
                };
            }
            list[kept] = cluster;
            kept += 1;
        }
        clusters.truncate(base + kept);
    }
}
