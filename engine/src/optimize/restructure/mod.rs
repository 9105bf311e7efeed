//! Treelet restructuring: rebuilds treelets where that lowers the SAH cost (the idea of Karras, Aila, *Fast Parallel
//! Construction of High-Quality Bounding Volume Hierarchies*, 2013, section 3), here large ones, from the top by binned
//! splits (Wald, *On fast Construction of SAH-based Bounding Volume Hierarchies*, 2007).
//!
//! Agglomerative clustering is worse than top-down splits on scans, and far better on architecture. So a sample of
//! treelets is rebuilt first. If most of it gains, the whole tree is rebuilt, otherwise the treelets around those
//! samples that gain; each is replaced only if it gets cheaper.

mod item;
mod split;
mod split_large;
mod topdown;
mod treelets;

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Aabb;
use crate::kernel::parallel::{par_tasks, par_tasks_with, zeros};
use crate::optimize::restructure::item::{Item, NEW_NODE};
use crate::optimize::restructure::topdown::Builder;
use crate::optimize::restructure::treelets::{Subtree, collect_leaves, treelets};
use crate::optimize::sah::node_or_leaf_cost;
use crate::optimize::subtree_costs::SubtreeCost;
use crate::tree::{Node, Tree};

/// Number of treelets rebuilt as a sample, if there are enough.
const SAMPLE_COUNT: usize = 20;
/// Minimum number of treelets that a sample stands for.
const MIN_GROUP_TREELETS: usize = 8;
/// One in this number of samples is taken first: where each gains, as on scans, the others are not needed.
const GROUPS_PER_FIRST_SAMPLE: usize = 4;
/// Minimum gain of a sample, as a fraction of its cost, for the treelets that it stands for to be rebuilt.
const MIN_SAMPLE_GAIN: f32 = 0.01;
/// The whole tree is rebuilt if at most one in this number of samples fails to gain: at most one in five does on scans,
/// mostly half on architecture.
const SAMPLES_PER_FAILURE: usize = 4;
/// Minimum gain of a rebuilt treelet, as a fraction of its cost; less is rounding.
const MIN_GAIN: f32 = 1e-5;
/// Maximum number of nodes: one bit of an index is [`NEW_NODE`].
const MAX_NODES: usize = NEW_NODE as usize;

/// Rebuilds treelets of `tree`, whose subtrees have `costs`, or the whole tree. Leaves the nodes in any order with
/// siblings together. Returns the reduction of the SAH cost.
pub fn restructure(
    tree: &mut Tree<Aabb>,
    costs: Vec<SubtreeCost>,
    collapses: bool,
    token: &CancelToken,
) -> Result<f32, Cancelled> {
    if tree.nodes.len() > MAX_NODES {
        return Ok(0.0);
    }
    let whole = Subtree { root: 0, cost: costs[0] };
    let treelets = treelets(&tree.nodes, &costs);
    let restructuring = Restructuring { nodes: &tree.nodes, builder: Builder::new(collapses, token) };
    let group_size = treelets.len().div_ceil(SAMPLE_COUNT).max(MIN_GROUP_TREELETS);
    let samples = restructuring.samples(&treelets, group_size, &costs)?;
    // Frees as much memory as the leaves of the whole tree need.
    drop(costs);
    let failed_count = samples.iter().flatten().filter(|&&sample| !is_gain(sample, MIN_SAMPLE_GAIN)).count();
    if failed_count <= samples.len() / SAMPLES_PER_FAILURE
        && let Some((nodes, cost)) = restructuring.rebuild_tree(&whole, &treelets)?
        && is_gain([whole.cost.cost, cost], MIN_GAIN)
    {
        tree.nodes = nodes;
        return Ok(whole.cost.cost - cost);
    }

    let is_worthwhile =
        |index: usize| samples[index / group_size].is_some_and(|sample| is_gain(sample, MIN_SAMPLE_GAIN));
    let selected: Vec<&Subtree> =
        treelets.iter().enumerate().filter(|&(index, _)| is_worthwhile(index)).map(|(_, old)| old).collect();
    let rebuilt = par_tasks(&selected, token, |old, _| {
        let new = restructuring.rebuild_subtree(old)?;
        Ok(new.filter(|new| is_gain([old.cost.cost, new.cost], MIN_GAIN)))
    })?;
    let mut gain = 0.0;
    for (old, new) in selected.into_iter().zip(&rebuilt) {
        token.check()?;
        if let Some(new) = new {
            new.write(&mut tree.nodes, old.root);
            gain += old.cost.cost - new.cost;
        }
    }
    Ok(gain)
}

/// Whether the new of two costs is less by at least this fraction of the old one.
fn is_gain([old, new]: [f32; 2], min_gain: f32) -> bool {
    new < old * (1.0 - min_gain)
}

/// A rebuilt subtree.
struct RebuiltSubtree {
    /// All nodes below its root; indices are relative to the first of them.
    nodes: Vec<Node<Aabb>>,
    /// Slots of the pairs of siblings in the tree, which the old subtree occupies: as many as needed.
    pair_slots: Vec<u32>,
    cost: f32,
}

impl RebuiltSubtree {
    /// Replaces the old subtree under `root`.
    fn write(&self, nodes: &mut [Node<Aabb>], root: u32) {
        nodes[root as usize].first = self.pair_slots[0];
        for (pair, &slot) in self.nodes.as_chunks::<2>().0.iter().zip(&self.pair_slots) {
            for (node, index) in pair.iter().zip(slot as usize..) {
                let first = if node.is_leaf() { node.first } else { self.pair_slots[node.first as usize / 2] };
                nodes[index] = Node { first, ..*node };
            }
        }
    }
}

/// All nodes of a rebuilt tree, and its SAH cost.
type RebuiltTree = (Vec<Node<Aabb>>, f32);

struct Restructuring<'a> {
    nodes: &'a [Node<Aabb>],
    builder: Builder<'a>,
}

impl Restructuring<'_> {
    /// For each group of `group_size` treelets the old and new cost of a part of the middle one; `None` if the first samples
    /// suffice.
    fn samples(
        &self,
        treelets: &[Subtree],
        group_size: usize,
        costs: &[SubtreeCost],
    ) -> Result<Vec<Option<[f32; 2]>>, Cancelled> {
        let sample = |group: &[Subtree]| {
            let old = group[group.len() / 2].sample(self.nodes, costs);
            Ok([old.cost.cost, self.rebuild_subtree(&old)?.map_or(old.cost.cost, |new| new.cost)])
        };
        let groups = || treelets.chunks(group_size);
        let first: Vec<[f32; 2]> =
            par_tasks(groups().step_by(GROUPS_PER_FIRST_SAMPLE), self.builder.token, |group, _| sample(group))?;
        let is_clear = first.iter().all(|&sample| is_gain(sample, MIN_SAMPLE_GAIN));
        par_tasks(groups().enumerate(), self.builder.token, |(index, group), _| match index % GROUPS_PER_FIRST_SAMPLE {
            0 => Ok(Some(first[index / GROUPS_PER_FIRST_SAMPLE])),
            _ if is_clear => Ok(None),
            _ => sample(group).map(Some),
        })
    }

    /// Rebuilds the subtree `old`; `None` if there is only one tree over its leaves.
    fn rebuild_subtree(&self, old: &Subtree) -> Result<Option<RebuiltSubtree>, Cancelled> {
        let leaves = old.cost.leaves as usize;
        if leaves < 3 {
            return Ok(None);
        }
        let mut items = bytemuck::zeroed_vec(leaves);
        let mut pair_slots = Vec::with_capacity(leaves - 1);
        collect_leaves(self.nodes, old.root, &mut items, &mut pair_slots);
        let mut nodes = bytemuck::zeroed_vec(2 * (leaves - 1));
        let children_cost = self.builder.build(&mut items, self.item(old), &mut nodes, 0)?;
        Ok(Some(RebuiltSubtree { nodes, pair_slots, cost: self.cost(old, children_cost) }))
    }

    /// Rebuilds the whole tree `old`, which consists of `treelets` and the nodes above them.
    fn rebuild_tree(&self, old: &Subtree, treelets: &[Subtree]) -> Result<Option<RebuiltTree>, Cancelled> {
        let leaves = old.cost.leaves as usize;
        if leaves < 3 {
            return Ok(None);
        }
        let mut items: Vec<Item> = zeros(leaves, self.builder.token)?;
        let (mut tasks, mut remaining) = (Vec::with_capacity(treelets.len()), &mut items[..]);
        for treelet in treelets {
            let treelet_items;
            (treelet_items, remaining) = remaining.split_at_mut(treelet.cost.leaves as usize);
            tasks.push((treelet.root, treelet_items));
        }
        par_tasks_with(tasks, self.builder.token, Vec::new, |pair_slots, (root, items), _| {
            collect_leaves(self.nodes, root, items, pair_slots);
            Ok(())
        })?;
        let mut nodes = zeros(2 * leaves - 1, self.builder.token)?;
        let children_cost = self.builder.build(&mut items, self.item(old), &mut nodes[1..], 1)?;
        nodes[0] = Node { first: 1, ..self.nodes[0] };
        Ok(Some((nodes, self.cost(old, children_cost))))
    }

    fn item(&self, subtree: &Subtree) -> Item {
        Item::new(&self.nodes[subtree.root as usize].container, subtree.cost.count, NEW_NODE)
    }

    /// SAH cost of `subtree` if everything below its root costs `children_cost`.
    fn cost(&self, subtree: &Subtree, children_cost: f32) -> f32 {
        let area = self.nodes[subtree.root as usize].container.half_area();
        node_or_leaf_cost::<Aabb>(area, subtree.cost.count, children_cost, self.builder.collapses).0
    }
}
