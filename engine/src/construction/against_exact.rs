//! The price of the approximation: a subtree beside the one that exact agglomerative clustering makes of the same leaves (Walter, Bala,
//! Kulkarni, Pingali, *Fast Agglomerative Clustering for Rendering*, 2008).

use std::collections::HashSet;

use crate::aac::{Cluster, ClusterContainer, ClusterStack};
use crate::builders::BuildError;
use crate::builders::exact::agglomerate;
use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::mix::mix64;
use crate::tree::statistics::{normalized_cost, stats_of};
use crate::tree::{AnyTree, Tree, with_built_tree};

use super::timeline::merges_by_distance;

/// Maximum number of leaves of a subtree that is clustered exactly, which takes quadratic time.
pub const MAX_EXACT_LEAVES: usize = 4096;

/// A merge in which two trees over the same leaves differ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DifferentMerge {
    /// Number of merges before it, by distance: all of them make sets of primitives that the other tree makes, too.
    pub merges_before: u32,
    /// The node that it makes, in its own tree.
    pub node: u32,
    /// Area of the container that it makes over that of the subtree's root.
    pub area: f32,
}

/// A subtree beside the exact one.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactComparison {
    /// The tree that exact clustering makes of the subtree's leaves; its primitive indices are those of the whole tree.
    pub exact: AnyTree,
    /// Number of leaves.
    pub leaves: usize,
    /// SAH cost of the subtree, normalised by the area of its root.
    pub cost: f64,
    /// SAH cost of the exact tree, normalised by the same area.
    pub exact_cost: f64,
    /// The first merge of the subtree, by distance, that makes a set of primitives which no node of the exact tree has; `None` where
    /// both trees group the same sets.
    pub first_difference: Option<DifferentMerge>,
    /// The first merge of the exact tree that makes a set which no node of the subtree has.
    pub exact_difference: Option<DifferentMerge>,
}

impl ExactComparison {
    /// Cost of the subtree over that of the exact tree: 1.1 means that the approximation costs 10 %. 1 where neither costs anything.
    /// Below 1 where always merging the closest pair is not the best: it is a heuristic, too.
    pub fn ratio(&self) -> f64 {
        if self.exact_cost > 0.0 { self.cost / self.exact_cost } else { 1.0 }
    }
}

/// Clusters the leaves below the node `root` of `tree` exactly and compares both. Leaves stay whole, whatever number of primitives they
/// have; of oriented boxes the plain ones are compared. Refused above [`MAX_EXACT_LEAVES`] leaves and where there is no such node.
pub fn compare_with_exact(tree: &AnyTree, root: u32, token: &CancelToken) -> Result<ExactComparison, BuildError> {
    if root as usize >= tree.node_count() {
        return Err(BuildError::Refused(format!("the tree has no node {root}")));
    }
    with_built_tree!(tree, tree => compare(tree, root, token), tree => compare(&tree.to_plain(token)?, root, token))
}

/// [`compare_with_exact`] of a tree of one kind.
fn compare<C: ClusterContainer>(tree: &Tree<C>, root: u32, token: &CancelToken) -> Result<ExactComparison, BuildError>
where
    AnyTree: From<Tree<C>>,
{
    let Subtree { tree: own, source } = Subtree::new(tree, root, token)?;
    let mut leaves: Vec<usize> = (0..own.nodes.len()).filter(|&node| own.nodes[node].is_leaf()).collect();
    // In the order of the input, as the exact builder gets them.
    leaves.sort_by_key(|&leaf| own.primitive_indices[own.nodes[leaf].first as usize]);
    let mut clusters = ClusterStack::with_capacity(leaves.len());
    let mut leaf_numbers = vec![0; own.nodes.len()];
    for (&leaf, number) in leaves.iter().zip(0..) {
        clusters.push(Cluster::of_primitive(own.nodes[leaf].container.fields(), number));
        leaf_numbers[leaf] = number;
    }
    let mut exact = agglomerate(clusters, token)?;
    let sets = leaf_sets(&own, |leaf| leaf_numbers[leaf]);
    let exact_sets = leaf_sets(&exact, |leaf| exact.primitive_indices[exact.nodes[leaf].first as usize]);
    restore_leaves(&mut exact, &own, &leaves);

    let area = f64::from(own.nodes[0].container.relative_area());
    let difference = first_difference(&own, &sets, &exact_sets, area, token)?;
    Ok(ExactComparison {
        leaves: leaves.len(),
        cost: cost_of(&own, area, token)?,
        exact_cost: cost_of(&exact, area, token)?,
        first_difference: difference.map(|merge| DifferentMerge { node: source[merge.node as usize], ..merge }),
        exact_difference: first_difference(&exact, &exact_sets, &sets, area, token)?,
        exact: exact.into(),
    })
}

/// A part of a tree as a tree of its own.
struct Subtree<C> {
    tree: Tree<C>,
    /// Index of each node in the whole tree.
    source: Vec<u32>,
}

impl<C: ClusterContainer> Subtree<C> {
    /// Copies everything below the node `root`; refused above [`MAX_EXACT_LEAVES`] leaves.
    fn new(whole: &Tree<C>, root: u32, token: &CancelToken) -> Result<Self, BuildError> {
        token.check()?;
        let (mut nodes, mut source, mut depths) = (vec![whole.nodes[root as usize]], vec![root], vec![0]);
        let mut at = 0;
        while at < nodes.len() {
            if nodes.len() >= 2 * MAX_EXACT_LEAVES {
                return Err(BuildError::Refused(format!(
                    "exact clustering takes quadratic time: choose a node of at most {MAX_EXACT_LEAVES} leaves"
                )));
            }
            if !nodes[at].is_leaf() {
                let first = nodes[at].first;
                nodes[at].first = nodes.len() as u32;
                nodes.extend_from_slice(&whole.nodes[first as usize..first as usize + 2]);
                source.extend([first, first + 1]);
                depths.extend([depths[at] + 1; 2]);
            }
            at += 1;
        }
        // Leaves are in order: those below a node refer to one range.
        let first = nodes.iter().filter(|node| node.is_leaf()).map(|leaf| leaf.first).min().unwrap_or(0);
        let mut count = 0;
        for leaf in nodes.iter_mut().filter(|node| node.is_leaf()) {
            leaf.first -= first;
            count += leaf.count as usize;
        }
        let primitive_indices = whole.primitive_indices[first as usize..first as usize + count].to_vec();
        let max_depth = depths.into_iter().max().unwrap_or(0);
        Ok(Self { tree: Tree { nodes, primitive_indices, max_depth }, source })
    }
}

/// Replaces the leaves of `exact`, each of which is the number of one of `leaves`, by those of `own`.
fn restore_leaves<C: ClusterContainer>(exact: &mut Tree<C>, own: &Tree<C>, leaves: &[usize]) {
    let numbers = std::mem::take(&mut exact.primitive_indices);
    let mut firsts = Vec::with_capacity(numbers.len());
    for &number in &numbers {
        let leaf = &own.nodes[leaves[number as usize]];
        firsts.push(exact.primitive_indices.len() as u32);
        let primitives = leaf.first as usize..(leaf.first + leaf.count) as usize;
        exact.primitive_indices.extend_from_slice(&own.primitive_indices[primitives]);
    }
    for node in exact.nodes.iter_mut().filter(|node| node.is_leaf()) {
        let slot = node.first as usize;
        *node = own.nodes[leaves[numbers[slot] as usize]];
        node.first = firsts[slot];
    }
}

/// The set of leaves below each node, by a sum of 64-bit hashes: two of some thousand sets have the same one about never.
fn leaf_sets<C: ClusterContainer>(tree: &Tree<C>, leaf_number: impl Fn(usize) -> u32) -> Vec<u64> {
    let mut sets = vec![0_u64; tree.nodes.len()];
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        let first = node.first as usize;
        sets[index] = if node.is_leaf() {
            mix64(u64::from(leaf_number(index)))
        } else {
            sets[first].wrapping_add(sets[first + 1])
        };
    }
    sets
}

/// The first merge of `tree`, by distance, whose set is none of `others`.
fn first_difference<C: ClusterContainer>(
    tree: &Tree<C>,
    sets: &[u64],
    others: &[u64],
    root_area: f64,
    token: &CancelToken,
) -> Result<Option<DifferentMerge>, Cancelled> {
    let others: HashSet<u64> = others.iter().copied().collect();
    let merged = merges_by_distance(tree, token)?;
    let found = (0..).zip(merged).find(|(_, node)| !others.contains(&sets[*node as usize]));
    Ok(found.map(|(merges_before, node)| {
        let area = f64::from(tree.nodes[node as usize].container.relative_area());
        DifferentMerge { merges_before, node, area: normalized_cost(area, root_area) as f32 }
    }))
}

/// SAH cost of `tree`, normalised by `area` instead of its root's.
fn cost_of<C: ClusterContainer>(tree: &Tree<C>, area: f64, token: &CancelToken) -> Result<f64, Cancelled> {
    let own_area = f64::from(tree.nodes[0].container.relative_area());
    Ok(normalized_cost(f64::from(stats_of(tree, token)?.sah_cost) * own_area, area))
}
