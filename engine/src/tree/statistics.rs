//! Statistics of a finished tree.

use rayon::prelude::*;

use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::prefetch::prefetch;
use crate::tree::{AnyTree, Container, Node, Tree};
use crate::with_tree;

/// Cost of testing one container, in the unit of [`INTERSECTION_COST`].
pub const TRAVERSAL_COST: f32 = 1.0;
/// Cost of testing one primitive.
pub const INTERSECTION_COST: f32 = 1.0;

/// What a tree looks like in numbers. All are finite for every tree.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct TreeStats {
    /// Nodes, leaves included.
    pub nodes: usize,
    /// Nodes that hold primitives.
    pub leaves: usize,
    /// Depth of the deepest node; the root's is 0.
    pub max_depth: u32,
    /// Mean depth over the leaves.
    pub mean_leaf_depth: f32,
    /// Smallest number of primitives in a leaf.
    pub min_leaf_size: u32,
    /// Mean number of primitives in a leaf.
    pub mean_leaf_size: f32,
    /// Largest number of primitives in a leaf.
    pub max_leaf_size: u32,
    /// Number of nodes at each depth, root first.
    pub nodes_per_depth: Vec<u32>,
    /// Number of leaves of each size; index 0 is unused.
    pub leaf_size_histogram: Vec<u32>,
    /// SAH cost: Σ interior area·[`TRAVERSAL_COST`] + Σ leaf area·primitives·[`INTERSECTION_COST`], over the root's area
    /// (Goldsmith and Salmon: *Automatic Creation of Object Hierarchies*, 1987). 0 where the root has no area.
    pub sah_cost: f32,
}

/// Counts and costs of `tree`, unless `token` is cancelled.
pub fn tree_stats(tree: &AnyTree, token: &CancelToken) -> Result<TreeStats, Cancelled> {
    with_tree!(tree, tree => stats_of(tree, token))
}

/// Subtrees below which threads share the work, at least, where the tree is wide enough, and how many one thread takes at once.
/// Always the same, so that the sums do not depend on the number of threads.
const SUBTREES: usize = 1 << 12;
const SUBTREES_AT_ONCE: usize = 64;
/// Pairs of siblings that are fetched before their turn: most of the time was waiting for them.
const PAIRS_AHEAD: usize = 16;
/// Pairs of siblings between two looks at the token.
const PAIRS_BETWEEN_CHECKS: usize = 1 << 13;

/// What is added up over nodes.
#[derive(Debug, Default)]
pub(crate) struct Sums {
    interior_area: f64,
    leaf_area: f64,
    leaf_depth: u64,
    nodes_per_depth: Vec<u32>,
    /// Interior nodes count as leaves of no primitives.
    leaf_sizes: Vec<u32>,
}

impl Sums {
    /// Adds the siblings that begin at each of `pairs`, all of them `depth` deep, and leaves where those below them begin.
    fn add_depth<C: Container>(
        &mut self,
        nodes: &[Node<C>],
        pairs: &mut Vec<u32>,
        depth: u32,
        token: &CancelToken,
    ) -> Result<(), Cancelled> {
        let mut below = vec![0; 2 * pairs.len()];
        let mut interior = 0;
        for pairs in pairs.chunks(PAIRS_BETWEEN_CHECKS) {
            token.check()?;
            for (&first, ahead) in pairs.iter().zip(pairs.iter().skip(PAIRS_AHEAD).chain(std::iter::repeat(&0))) {
                prefetch(nodes, *ahead as usize);
                for node in &nodes[first as usize..first as usize + 2] {
                    // Without branches, which nobody could foretell: interior nodes hold no primitives.
                    let is_interior = node.count == 0;
                    let area = f64::from(node.container.relative_area());
                    self.interior_area += if is_interior { area } else { 0.0 };
                    self.leaf_area += area * f64::from(node.count);
                    count(&mut self.leaf_sizes, node.count, 1);
                    below[interior] = node.first;
                    interior += usize::from(is_interior);
                }
            }
        }
        self.leaf_depth += (2 * pairs.len() - interior) as u64 * u64::from(depth);
        count(&mut self.nodes_per_depth, depth, 2 * pairs.len() as u32);
        below.truncate(interior);
        *pairs = below;
        Ok(())
    }

    /// Adds `nodes`, which are `depth` deep and know how many primitives are below them: leaves one, others more.
    #[inline(always)]
    pub(crate) fn add_nodes<C: Container>(&mut self, nodes: &[Node<C>], depth: u32) {
        let mut leaves = 0;
        for node in nodes {
            let area = f64::from(node.container.relative_area());
            let is_leaf = node.count == 1;
            self.leaf_area += if is_leaf { area } else { 0.0 };
            self.interior_area += if is_leaf { 0.0 } else { area };
            leaves += u32::from(is_leaf);
        }
        self.leaf_depth += u64::from(leaves * depth);
        count(&mut self.nodes_per_depth, depth, nodes.len() as u32);
        count(&mut self.leaf_sizes, 1, leaves);
    }

    pub(crate) fn plus(mut self, other: &Self) -> Self {
        self.interior_area += other.interior_area;
        self.leaf_area += other.leaf_area;
        self.leaf_depth += other.leaf_depth;
        for (sums, others) in
            [(&mut self.nodes_per_depth, &other.nodes_per_depth), (&mut self.leaf_sizes, &other.leaf_sizes)]
        {
            others.iter().zip(0..).for_each(|(&number, place)| count(sums, place, number));
        }
        self
    }
}

/// Adds `number` in a place of a list, which grows as needed.
fn count(list: &mut Vec<u32>, place: u32, number: u32) {
    let place = place as usize;
    if place >= list.len() {
        list.resize(place + 1, 0);
    }
    list[place] += number;
}

/// [`tree_stats`] of a tree of one kind.
pub(crate) fn stats_of<C: Container>(tree: &Tree<C>, token: &CancelToken) -> Result<TreeStats, Cancelled> {
    let Some(root) = tree.nodes.first() else { return Ok(TreeStats::default()) };
    let mut sums = Sums::default();
    count(&mut sums.nodes_per_depth, 0, 1);
    let root_area = f64::from(root.container.relative_area());
    let mut pairs = Vec::new();
    if root.is_leaf() {
        count(&mut sums.leaf_sizes, root.count, 1);
        sums.leaf_area = root_area * f64::from(root.count);
    } else {
        sums.interior_area = root_area;
        pairs.push(root.first);
    }
    // Depth by depth, by one thread until there is work for all: without a list of all depths, which only one could make.
    let mut depth = 1;
    while (1..SUBTREES).contains(&pairs.len()) {
        sums.add_depth(&tree.nodes, &mut pairs, depth, token)?;
        depth += 1;
    }
    let parts: Vec<Sums> = pairs
        .par_chunks(SUBTREES_AT_ONCE)
        .map(|pairs| {
            let (mut sums, mut pairs) = (Sums::default(), pairs.to_vec());
            for depth in depth.. {
                if pairs.is_empty() {
                    break;
                }
                sums.add_depth(&tree.nodes, &mut pairs, depth, token)?;
            }
            Ok(sums)
        })
        .collect::<Result<_, Cancelled>>()?;
    Ok(parts.iter().fold(sums, Sums::plus).into_stats(tree))
}

impl Sums {
    /// What they say about `tree`, over whose nodes they are.
    pub(crate) fn into_stats<C: Container>(mut self, tree: &Tree<C>) -> TreeStats {
        let root_area = tree.nodes.first().map_or(0.0, |root| f64::from(root.container.relative_area()));
        let sums = &mut self;
        count(&mut sums.leaf_sizes, 0, 0);
        sums.leaf_sizes[0] = 0;
        let leaves: usize = sums.leaf_sizes.iter().map(|&count| count as usize).sum();
        let cost = sums.interior_area * f64::from(TRAVERSAL_COST) + sums.leaf_area * f64::from(INTERSECTION_COST);
        TreeStats {
            nodes: tree.nodes.len(),
            leaves,
            max_depth: tree.max_depth,
            mean_leaf_depth: (sums.leaf_depth as f64 / leaves.max(1) as f64) as f32,
            min_leaf_size: sums.leaf_sizes.iter().position(|&count| count > 0).unwrap_or(0) as u32,
            mean_leaf_size: (tree.primitive_indices.len() as f64 / leaves.max(1) as f64) as f32,
            max_leaf_size: sums.leaf_sizes.len() as u32 - 1,
            nodes_per_depth: self.nodes_per_depth,
            leaf_size_histogram: self.leaf_sizes,
            sah_cost: share(cost, root_area) as f32,
        }
    }
}

/// SAH cost of `tree` if each subtree were one leaf wherever that is cheaper: trees with and without large leaves compare
/// by it. Same constants and normalisation as [`TreeStats::sah_cost`].
pub fn collapsed_sah_cost(tree: &AnyTree) -> f64 {
    with_tree!(tree, tree => collapsed_cost_of(tree))
}

/// [`collapsed_sah_cost`] of a tree of one kind.
pub fn collapsed_cost_of<C: Container>(tree: &Tree<C>) -> f64 {
    let Some(root) = tree.nodes.first() else { return 0.0 };
    let mut counts = vec![0_u32; tree.nodes.len()];
    let mut costs = vec![0.0_f64; tree.nodes.len()];
    // Children come after their parents: backwards, they are done first.
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        let area = f64::from(node.container.relative_area());
        let (count, below) = if node.is_leaf() {
            (node.count, f64::INFINITY)
        } else {
            let first = node.first as usize;
            (counts[first] + counts[first + 1], costs[first] + costs[first + 1])
        };
        counts[index] = count;
        costs[index] =
            (area * f64::from(TRAVERSAL_COST) + below).min(area * f64::from(count) * f64::from(INTERSECTION_COST));
    }
    share(costs[0], f64::from(root.container.relative_area()))
}

/// `part / whole`; 0 where the whole is nothing, as in a scene of points.
pub(crate) fn share(part: f64, whole: f64) -> f64 {
    if whole > 0.0 && part.is_finite() && whole.is_finite() { part / whole } else { 0.0 }
}
