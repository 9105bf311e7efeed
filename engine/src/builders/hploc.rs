//! Hierarchical parallel locally-ordered clustering (Benthin, Meister, Barczak, Mehalwal, Tsakok, Kensler, *H-PLOC: Hierarchical Parallel
//! Locally-Ordered Clustering for Bounding Volume Hierarchy Construction*, 2024): the rounds of PLOC, on short lists. The lists are
//! those of the nodes of a linear BVH, bottom-up: a node of more primitives than half a wave joins the clusters that both of its children
//! have left, and merges mutual nearest neighbours until half a wave is left; the root goes on until one is.
//!
//! A GPU does this in one kernel, a wave of 32 threads for each list. Here it is a recursion, whose sides are independent.

use crate::aac::ClusterContainer;
use crate::builders::flatten::{ChildPair, finish};
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
    let count = triangles.len();
    let sorted = sort_primitives::<C>(triangles, bounds, curve, token, times)?;
    let stage = Stage::begin("tree", token);
    let mut slots: Vec<ChildPair<C>> = zeros(count, token)?;
    let mut clusters = Vec::with_capacity(2 * WAVE);
    combine(&Input { triangles, sorted: &sorted }, 0, &mut slots, &mut clusters, token)?;
    merge(&mut clusters, 0, 1, 0, &mut slots);
    let root = clusters[0].node;
    finish(root, &slots, |position| sorted.primitive(position), stage, token, times)
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
    token: &CancelToken,
) -> Result<(), Cancelled> {
    let range = first..first + slots.len();
    if range.len() <= HALF_WAVE {
        clusters.extend(range.map(|position| {
            let container = input.sorted.container(input.triangles, input.sorted.primitive(position));
            Cluster { node: Node { container, first: position as u32, count: 1 }, place: position as u32 }
        }));
        return Ok(());
    }
    let base = clusters.len();
    let middle = input.sorted.make_partition(&range);
    let (left_slots, right_slots) = slots.split_at_mut(middle - first);
    if range.len() > FORK_ABOVE {
        let mut right_clusters = Vec::with_capacity(2 * WAVE);
        token.both(
            true,
            |token| combine(input, first, left_slots, clusters, token),
            |token| combine(input, middle, right_slots, &mut right_clusters, token),
        )?;
        clusters.append(&mut right_clusters);
    } else {
        combine(input, first, left_slots, clusters, token)?;
        combine(input, middle, right_slots, clusters, token)?;
    }
    merge(clusters, base, HALF_WAVE, first, slots);
    Ok(())
}

/// Merges the clusters of the list that begins at `base`, a wave at most, in rounds until `target` are left or fewer. Children are
/// written to the slots, the first of which is that of the position `first`.
fn merge<C: ClusterContainer>(
    clusters: &mut Vec<Cluster<C>>,
    base: usize,
    target: usize,
    first: usize,
    slots: &mut [ChildPair<C>],
) {
    while clusters.len() - base > target {
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
                slots[later.place as usize - first] = [earlier.node, later.node];
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
