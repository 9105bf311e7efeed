//! Why two clusters were merged: the list that they were in, and the distances that the builder compared.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Simd, SimdBase, f32x16};

use crate::aac::{Cluster, ClusterContainer, ClusterStack, splat_fields};
use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::SimdLevel;
use crate::kernel::simd::dispatch;
use crate::tree::{ContainerKind, Node, Tree, with_built_tree};
use crate::with_tree;

use super::construct::Construction;
use super::record::MergeRecord;

/// Number of clusters whose distances among each other are listed.
const MAX_MATRIX: usize = 64;
/// Number of pairs that are listed.
const MAX_PAIRS: usize = 64;

/// A pair of clusters of a list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClusterPair {
    /// Their nodes, the lower index first.
    pub nodes: [u32; 2],
    /// The distance between them, see [`merge_area`].
    pub distance: f32,
    /// Number of primitives of both together, which decides between pairs at the same distance.
    pub primitives: u32,
}

impl ClusterPair {
    /// The builder's order of pairs: distance, then number of primitives. It then takes the one at the lower places of its list, of
    /// which nothing is recorded; the nodes only make this order definite.
    fn key(&self) -> (u32, u32, [u32; 2]) {
        (self.distance.max(0.0).to_bits(), self.primitives, self.nodes)
    }
}

/// A cluster of a list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ListedCluster {
    /// Its node.
    pub node: u32,
    /// Number of its primitives.
    pub primitives: u32,
    /// The closest other cluster of the list.
    pub nearest: u32,
    /// Distance to it.
    pub distance: f32,
}

/// The choice of one merge: the list that it had, and the pairs in it.
#[derive(Debug, Clone, PartialEq)]
pub struct MergeChoice {
    /// Number of the merge.
    pub merge: u32,
    /// The node that it made.
    pub node: u32,
    /// Index of its call of `combine_clusters` in [`MergeRecord::steps`].
    pub step: usize,
    /// The clusters of the list just before the merge, those with the smallest distance to their nearest first.
    pub clusters: Vec<ListedCluster>,
    /// Distances between the first [`MergeChoice::matrix_size`] clusters, row by row; infinite from a cluster to itself.
    pub distances: Vec<f32>,
    /// The closest pairs of the whole list in the builder's order, at most 64, with the winner.
    pub pairs: Vec<ClusterPair>,
    /// The pair that was merged.
    pub winner: ClusterPair,
    /// The pair that would have been merged instead; `None` where the list had no other.
    pub runner_up: Option<ClusterPair>,
}

impl MergeChoice {
    /// Number of rows and of columns of [`MergeChoice::distances`], at most 64.
    pub fn matrix_size(&self) -> usize {
        self.clusters.len().min(MAX_MATRIX)
    }

    /// By how much the runner-up is further apart than the winner, in units of the winner's distance. 0 where both are at the same
    /// distance, `None` where there is no other pair or the winner's distance is 0.
    pub fn margin(&self) -> Option<f32> {
        let runner_up = self.runner_up?;
        (self.winner.distance > 0.0).then(|| runner_up.distance / self.winner.distance - 1.0)
    }
}

/// Surface area of the container around two clusters at `distance`. The builder compares values that increase with it: half the area for
/// boxes and polytopes, the radius for spheres.
pub fn merge_area(kind: ContainerKind, distance: f32) -> f32 {
    match kind {
        ContainerKind::Aabb | ContainerKind::Dop14 | ContainerKind::Oriented => 2.0 * distance,
        ContainerKind::Sphere => 4.0 * std::f32::consts::PI * distance * distance,
    }
}

impl Construction {
    /// Why `merge` merged its two clusters; `None` where there is no such merge, and where merges do not choose the closest pair, see
    /// [`Construction::chooses_closest`]. Distances are in the coordinates in which the tree was
    /// clustered, which differ from the given ones only where those are above 1e15 or below 1e-10. Takes time quadratic in the
    /// length of the list.
    pub fn choice(&self, merge: u32, token: &CancelToken) -> Result<Option<MergeChoice>, Cancelled> {
        if !self.chooses_closest() {
            return Ok(None);
        }
        with_built_tree!(self.clustered(), tree => choice(tree, &self.record, merge, token), _tree => Ok(None))
    }

    /// The clusters of the list that `merge` chose from, in no particular order; none where there is no such merge. Not of PLOC, whose
    /// rounds are no recursion.
    pub fn list_before(&self, merge: u32) -> Vec<u32> {
        with_tree!(&self.tree, tree => list_before(tree, &self.record, merge))
    }
}

/// The list just before `merge`, from the root downwards: a step's list is what its merges from then on merge, and what is left of it
/// belongs to the step above.
fn list_before<C>(tree: &Tree<C>, record: &MergeRecord, merge: u32) -> Vec<u32> {
    let Some(target) = record.step_of(merge) else { return Vec::new() };
    let mut list = vec![0];
    let mut index = record.steps().len() - 1;
    while index != target {
        undo(tree, record, &mut list, record.steps()[index].first_merge);
        // Of the two sides, the second begins after the first.
        let side = record.steps_below(index).find(|&below| target <= below);
        let Some(side) = side else { return Vec::new() };
        let (merges, positions) = (record.merges_within(side), record.steps()[side].positions());
        list.retain(|&node| match record.merge_of(node) {
            Some(merge) => merges.contains(&merge),
            None => positions.contains(&record.positions()[tree.nodes[node as usize].first as usize]),
        });
        index = side;
    }
    undo(tree, record, &mut list, merge);
    list
}

/// Replaces the nodes of `list` that the merge `first` or a later one made by their children.
fn undo<C>(tree: &Tree<C>, record: &MergeRecord, list: &mut Vec<u32>, first: u32) {
    let mut at = 0;
    while at < list.len() {
        if record.merge_of(list[at]).is_some_and(|merge| merge >= first) {
            let child = tree.nodes[list[at] as usize].first;
            list[at] = child;
            list.push(child + 1);
        } else {
            at += 1;
        }
    }
}

/// [`Construction::choice`] in a tree of one kind.
fn choice<C: ClusterContainer>(
    tree: &Tree<C>,
    record: &MergeRecord,
    merge: u32,
    token: &CancelToken,
) -> Result<Option<MergeChoice>, Cancelled> {
    let Some(step) = record.step_of(merge) else { return Ok(None) };
    let mut nodes = list_before(tree, record, merge);
    nodes.sort_unstable();
    let list = Distances::new(tree, &nodes);
    let mut row = Vec::new();
    let (mut clusters, mut pairs) = (Vec::with_capacity(nodes.len()), Vec::new());
    for (at, &own) in nodes.iter().enumerate() {
        token.check()?;
        list.row(at, &mut row);
        let pair = |other: usize| ClusterPair {
            nodes: [own.min(nodes[other]), own.max(nodes[other])],
            distance: row[other],
            primitives: list.primitives(at) + list.primitives(other),
        };
        let others = (0..nodes.len()).filter(|&other| other != at);
        if let Some(nearest) = others.map(pair).min_by_key(ClusterPair::key) {
            let [low, high] = nearest.nodes;
            let other = if low == own { high } else { low };
            let (primitives, distance) = (list.primitives(at), nearest.distance);
            clusters.push(ListedCluster { node: own, primitives, nearest: other, distance });
        }
        pairs.extend((at + 1..nodes.len()).map(pair));
        if pairs.len() > 16 * MAX_PAIRS {
            keep_closest(&mut pairs);
        }
    }
    keep_closest(&mut pairs);
    clusters.sort_unstable_by_key(|cluster| (cluster.distance.max(0.0).to_bits(), cluster.node));

    let node = record.nodes()[merge as usize];
    let first = tree.nodes[node as usize].first;
    let merged = [first, first + 1];
    let [at, other] = merged.map(|node| nodes.binary_search(&node).unwrap_or_default());
    list.row(at, &mut row);
    let primitives = list.primitives(at) + list.primitives(other);
    let winner = ClusterPair { nodes: merged, distance: row[other], primitives };
    let runner_up = pairs.iter().find(|pair| pair.nodes != merged).copied();
    // Of very many pairs at the same distance the builder compares some, and not all are listed.
    if !pairs.contains(&winner) {
        pairs.pop();
        pairs.insert(0, winner);
    }

    let shown: Vec<usize> =
        clusters.iter().take(MAX_MATRIX).filter_map(|cluster| nodes.binary_search(&cluster.node).ok()).collect();
    let mut distances = Vec::with_capacity(shown.len() * shown.len());
    for &at in &shown {
        list.row(at, &mut row);
        distances.extend(shown.iter().map(|&other| if other == at { f32::INFINITY } else { row[other] }));
    }
    Ok(Some(MergeChoice { merge, node, step, clusters, distances, pairs, winner, runner_up }))
}

/// Keeps the [`MAX_PAIRS`] closest of `pairs`, in order.
fn keep_closest(pairs: &mut Vec<ClusterPair>) {
    pairs.sort_unstable_by_key(ClusterPair::key);
    pairs.truncate(MAX_PAIRS);
}

/// The containers of a list, for the builder's own distance function.
struct Distances<C: ClusterContainer>(ClusterStack<C>);

impl<C: ClusterContainer> Distances<C> {
    /// The list of these `nodes` of `tree`.
    fn new(tree: &Tree<C>, nodes: &[u32]) -> Self {
        let mut clusters = ClusterStack::with_capacity(nodes.len());
        for &index in nodes {
            let node = &tree.nodes[index as usize];
            let count = primitive_count(tree, node);
            clusters.push(Cluster { fields: node.container.fields(), first: index, count });
        }
        Self(clusters)
    }

    /// Number of primitives of the cluster at `at`.
    fn primitives(&self, at: usize) -> u32 {
        self.0.items[at].count
    }

    /// Writes the distances of the cluster at `at` to all clusters to `row`, itself included.
    fn row(&self, at: usize, row: &mut Vec<f32>) {
        dispatch!(SimdLevel::of_builds().level(), simd => distances_to::<C, _>(simd, &self.0, at, row));
    }
}

/// Writes the distances of the cluster at `at` to all of `clusters` to `row`.
#[inline(always)]
fn distances_to<C: ClusterContainer, S: Simd>(simd: S, clusters: &ClusterStack<C>, at: usize, row: &mut Vec<f32>) {
    row.clear();
    let own = splat_fields::<C, S, f32x16<S>>(simd, &clusters.items[at].fields);
    for start in (0..clusters.len).step_by(f32x16::<S>::LEN) {
        let others = clusters.load_row::<S, f32x16<S>>(simd, start);
        row.extend_from_slice(C::merge_distances(simd, &own, &others).as_slice());
    }
    row.truncate(clusters.len);
}

/// Number of primitives below `node`: leaves are in order, so that those at both ends tell.
fn primitive_count<C>(tree: &Tree<C>, node: &Node<C>) -> u32 {
    let (mut first, mut last) = (node, node);
    while !first.is_leaf() {
        first = &tree.nodes[first.first as usize];
    }
    while !last.is_leaf() {
        last = &tree.nodes[last.first as usize + 1];
    }
    last.first + last.count - first.first
}
