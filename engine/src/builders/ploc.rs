//! Parallel locally-ordered clustering (Meister, Bittner, *Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy
//! Construction*, 2018): bottom-up along a space-filling curve. In each round every cluster finds its nearest neighbour among those
//! close by in the list, by the area of their union; clusters that are each other's nearest merge, and the list is compacted.

use crate::aac::{ClusterContainer, ReductionStep};
use crate::builders::clustered::Clustered;
use crate::builders::flatten::ChildPair;
use crate::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use crate::geometry::Triangle;
use crate::kernel::parallel::{par_collect, par_collect_in_chunks, par_tasks, zeros};
use crate::order::{InputBounds, sort_primitives};
use crate::settings::Curve;
use crate::stage_times::{Stage, StageTimes};
use crate::tree::{Node, Tree};

/// Distance in the list up to which a cluster looks for its nearest neighbour, on both sides: that of H-PLOC (Benthin et al., 2024). Not
/// tuned here.
const RADIUS: usize = 8;
/// Number of clusters in a task; poll for cancellation before each.
const BATCH: usize = 1 << 10;
/// Least part of the clusters, one in so many, that a round merges. Where fewer are each other's nearest, as in a list of nested
/// containers, neighbours in the list merge in pairs instead: else the rounds would take quadratic time. Chosen, not tuned: random
/// scenes of up to 3000 triangles stay above it, since their trees are those of the plain algorithm.
const MIN_MERGED: usize = 32;

/// Builds a tree with one triangle per leaf.
pub fn build<C: ClusterContainer>(
    triangles: &[Triangle],
    bounds: &InputBounds,
    curve: Curve,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    cluster(triangles, bounds, curve, token, times)?.0.finish(token, times)
}

/// Merges all clusters. Returns the rounds as calls that have all clusters in their list, the first at the highest level; children of
/// merges are in their slots in order.
pub fn cluster<C: ClusterContainer>(
    triangles: &[Triangle],
    bounds: &InputBounds,
    curve: Curve,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<(Clustered<C>, Vec<ReductionStep>), Cancelled> {
    let count = triangles.len();
    let sorted = sort_primitives::<C>(triangles, bounds, curve, token, times)?;
    let stage = Stage::begin("tree", token);
    let mut slots: Vec<ChildPair<C>> = zeros(count - 1, token)?;
    let mut clusters = par_collect(count, token, |position| {
        let container = sorted.container(triangles, sorted.primitive(position));
        Node { container, first: position as u32, count: 1 }
    })?;
    let mut next: Vec<Node<C>> = zeros(count, token)?;
    let (mut written, mut remaining) = (0, &mut slots[..]);
    let mut rounds = Vec::new();
    while clusters.len() > 1 {
        let round = Round::new(&clusters, written, token)?;
        let pairs;
        (pairs, remaining) = remaining.split_at_mut(round.merges);
        round.merge(&clusters, &mut next, pairs, token)?;
        rounds.push(ReductionStep {
            level: 0,
            first_primitive: 0,
            primitives: count as u32,
            before: clusters.len() as u32,
            after: (clusters.len() - round.merges) as u32,
            first_merge: written as u32,
            first_step: rounds.len() as u32,
        });
        written += round.merges;
        next.truncate(clusters.len() - round.merges);
        std::mem::swap(&mut clusters, &mut next);
        token.set_progress(1.0 - clusters.len() as f32 / count as f32);
    }
    let root = clusters[0];
    drop((clusters, next));
    for (level, round) in rounds.iter_mut().rev().enumerate() {
        round.level = level as u32;
    }
    Ok((Clustered { root, slots, sorted, stage }, rounds))
}

/// A round: for each cluster the other one of its pair, and where its batch writes.
struct Round {
    /// Position of the cluster that each one merges with; its own where it merges with none.
    partners: Vec<u32>,
    counts: Vec<BatchCounts>,
    /// Number of merges of all batches.
    merges: usize,
    /// Number of merges in the rounds before.
    written: usize,
}

/// Numbers of clusters that a batch writes, and of those among them that it merges with later ones.
struct BatchCounts {
    kept: usize,
    merges: usize,
}

impl Round {
    fn new<C: ClusterContainer>(clusters: &[Node<C>], written: usize, token: &CancelToken) -> Result<Self, Cancelled> {
        let count = clusters.len();
        let container = |at: usize| &clusters[at].container;
        let nearest = par_collect_in_chunks(count, MEDIUM_STEPS, token, |at| nearest(count, container, at))?;
        let mutual = |at: usize| if nearest[nearest[at] as usize] == at as u32 { nearest[at] } else { at as u32 };
        let round = Self::with_partners(par_collect(count, token, mutual)?, written, token)?;
        if round.merges >= count.div_ceil(MIN_MERGED) {
            return Ok(round);
        }
        let beside = |at: usize| if (at ^ 1) < count { at as u32 ^ 1 } else { at as u32 };
        Self::with_partners(par_collect(count, token, beside)?, written, token)
    }

    fn with_partners(partners: Vec<u32>, written: usize, token: &CancelToken) -> Result<Self, Cancelled> {
        let counts = par_tasks(partners.chunks(BATCH).enumerate(), token, |(batch, partners), _| {
            let beyond = |at: usize, partner: u32| (partner as usize).cmp(&(batch * BATCH + at));
            let mut counts = BatchCounts { kept: 0, merges: 0 };
            for (at, &partner) in partners.iter().enumerate() {
                counts.kept += usize::from(beyond(at, partner).is_ge());
                counts.merges += usize::from(beyond(at, partner).is_gt());
            }
            Ok(counts)
        })?;
        let merges = counts.iter().map(|batch| batch.merges).sum();
        Ok(Self { partners, counts, merges, written })
    }

    /// Writes the merged and the remaining clusters to `next`, in order, and the children of the merged ones to `pairs`.
    fn merge<C: ClusterContainer>(
        &self,
        clusters: &[Node<C>],
        next: &mut [Node<C>],
        pairs: &mut [ChildPair<C>],
        token: &CancelToken,
    ) -> Result<(), Cancelled> {
        let (mut next, mut pairs, mut slot) = (next, pairs, self.written);
        let mut tasks = Vec::with_capacity(self.counts.len());
        for (batch, &BatchCounts { kept, merges }) in self.counts.iter().enumerate() {
            let (own_next, own_pairs);
            (own_next, next) = next.split_at_mut(kept);
            (own_pairs, pairs) = pairs.split_at_mut(merges);
            tasks.push((batch * BATCH, slot, own_next, own_pairs));
            slot += merges;
        }
        par_tasks(tasks, token, |(first, mut slot, next, pairs), _| {
            let batch = first..clusters.len().min(first + BATCH);
            let kept = batch.filter(|&at| self.partners[at] as usize >= at);
            let mut pairs = pairs.iter_mut();
            for (at, cluster) in kept.zip(next) {
                let other = self.partners[at] as usize;
                *cluster = clusters[at];
                if other > at
                    && let Some(pair) = pairs.next()
                {
                    *pair = [clusters[at], clusters[other]];
                    let container = clusters[at].container.union(&clusters[other].container);
                    let count = clusters[at].count + clusters[other].count;
                    *cluster = Node { container, first: slot as u32, count };
                    slot += 1;
                }
            }
            Ok(())
        })
        .map(drop)
    }
}

/// Position of the nearest neighbour of the cluster at `at`, of `count`, of two at least, with these containers. Pairs at the same
/// distance are ordered by the exclusive or of their positions, which is the same from both sides: so the closest pair of all is always
/// merged, and of equal clusters every second one with the next.
pub fn nearest<'a, C: ClusterContainer>(count: usize, container: impl Fn(usize) -> &'a C, at: usize) -> u32 {
    let own = container(at);
    let (first, last) = (at.saturating_sub(RADIUS), (at + RADIUS).min(count - 1));
    // Unions of spheres depend on their order: the earlier one comes first, from both sides.
    let before = (first..at).map(|other| (container(other).union(own), other));
    let after = (at + 1..=last).map(|other| (own.union(container(other)), other));
    let keys = before.chain(after).map(|(union, other)| {
        // Bits of areas, which are not negative, are in the order of the areas.
        (union.relative_area().to_bits(), (at ^ other) as u32)
    });
    keys.min().map_or(at as u32, |(_, exclusive)| at as u32 ^ exclusive)
}
