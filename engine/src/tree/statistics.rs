//! Statistics of a finished tree: counts, depths, leaf sizes, children per node, SAH cost.

use crate::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use crate::kernel::parallel::par_tasks;
use crate::kernel::prefetch::prefetch;
use crate::with_tree;

use super::node::{AnyTree, Node, Tree};
use crate::geometry::{Container, ContainerKind};

/// Cost of one test of a box or a sphere, in the unit of [`INTERSECTION_COST`]; see
/// [`traversal_cost`](crate::tree::ContainerKind::traversal_cost).
pub const TRAVERSAL_COST: f32 = ContainerKind::Aabb.traversal_cost();
/// Cost of one primitive test.
pub const INTERSECTION_COST: f32 = 1.0;

/// Statistics of a tree. All are finite for every tree.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct TreeStats {
    /// Number of nodes, leaves included.
    pub nodes: usize,
    /// Number of leaves.
    pub leaves: usize,
    /// Depth of the deepest node; the root's is 0.
    pub max_depth: u32,
    /// Depth of the highest leaf.
    pub min_leaf_depth: u32,
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
    /// Number of leaves by number of primitives; index 0 is unused.
    pub leaf_size_histogram: Vec<u32>,
    /// Mean number of children of an interior node; 2 in a binary tree, 0 where no node has children.
    pub mean_arity: f32,
    /// Largest number of children of a node; 0 where no node has children.
    pub max_arity: u32,
    /// Number of interior nodes by number of children; index 0 is unused. Empty where no node has children.
    pub arity_histogram: Vec<u32>,
    /// SAH cost: Σ interior area·[`traversal_cost`](crate::tree::ContainerKind::traversal_cost) + Σ leaf
    /// area·primitives·[`INTERSECTION_COST`], over the root's area (Goldsmith and Salmon: *Automatic Creation of Object Hierarchies*,
    /// 1987). The constants are the same for nodes of any number of children: an interior node costs one step, however many containers
    /// are tested in it. 0 where the root has no area.
    pub sah_cost: f32,
}

impl TreeStats {
    /// Smallest number of children of an interior node; 0 where no node has children.
    pub fn min_arity(&self) -> u32 {
        self.arity_histogram.iter().position(|&nodes| nodes > 0).unwrap_or(0) as u32
    }

    /// Whether each interior node has two children.
    pub fn is_binary(&self) -> bool {
        self.arity_histogram.iter().enumerate().all(|(arity, &nodes)| arity == 2 || nodes == 0)
    }
}

/// Statistics of `tree`. The same on any number of threads.
pub fn tree_stats(tree: &AnyTree, token: &CancelToken) -> Result<TreeStats, Cancelled> {
    with_tree!(tree, tree => stats_of(tree, token))
}

/// Minimum number of sibling pairs at a depth from which subtrees are distributed to threads, and number of them per task.
/// Constants, so that the sums do not depend on the number of threads.
const SUBTREES: usize = 1 << 12;
const SUBTREES_AT_ONCE: usize = 64;
/// Distance, in sibling pairs, of the prefetch: without it most of the time was waiting for memory.
const PAIRS_AHEAD: usize = 16;
/// Sibling pairs between two polls for cancellation.
const PAIRS_BETWEEN_CHECKS: usize = 1 << 13;
/// Sums over nodes, from which [`TreeStats`] are made.
#[derive(Debug, Default)]
pub(crate) struct Sums {
    interior_area: f64,
    leaf_area: f64,
    leaf_depth: u64,
    /// Depth of the highest leaf; 0 where all nodes have two children or none, of which it follows from the nodes per depth.
    min_leaf_depth: u32,
    nodes_per_depth: Vec<u32>,
    /// Number of nodes by number of primitives; interior nodes have 0.
    leaf_sizes: Vec<u32>,
    /// Number of interior nodes by number of children; empty where these are two each.
    arities: Vec<u32>,
    /// Set by [`Sums::add_depth`]: a node has another number of children than two, so that the sums say nothing.
    has_other_arity: bool,
}

impl Sums {
    /// Adds the siblings that begin at each of `pairs`, all of depth `depth`, and replaces `pairs` by those one level below.
    fn add_depth<C: Container>(
        &mut self,
        tree: &Tree<C>,
        pairs: &mut Vec<u32>,
        depth: u32,
        token: &CancelToken,
    ) -> Result<(), Cancelled> {
        let (nodes, scale) = (&tree.nodes[..], tree.area_scale());
        let mut children = vec![0; 2 * pairs.len()];
        let mut interior = 0;
        for pairs in pairs.chunks(PAIRS_BETWEEN_CHECKS) {
            token.check()?;
            for (&first, ahead) in pairs.iter().zip(pairs.iter().skip(PAIRS_AHEAD).chain(std::iter::repeat(&0))) {
                prefetch(nodes, *ahead as usize);
                for node in &nodes[first as usize..first as usize + 2] {
                    // Without branches, which would be mispredicted: the count of an interior node is 0.
                    let is_interior = node.count == 0;
                    let area = f64::from(node.container.scaled(scale).relative_area());
                    self.interior_area += if is_interior { area } else { 0.0 };
                    self.leaf_area += area * f64::from(node.count);
                    // Nodes of other arities have the largest counts, which no list is long enough for.
                    match self.leaf_sizes.get_mut(node.count as usize) {
                        Some(sizes) => *sizes += 1,
                        None if node.is_leaf() || is_interior => count(&mut self.leaf_sizes, node.count, 1),
                        None => self.has_other_arity = true,
                    }
                    children[interior] = node.first;
                    interior += usize::from(is_interior);
                }
            }
        }
        self.leaf_depth += (2 * pairs.len() - interior) as u64 * u64::from(depth);
        count(&mut self.nodes_per_depth, depth, 2 * pairs.len() as u32);
        children.truncate(interior);
        *pairs = children;
        Ok(())
    }

    /// The sums over a tree of any arity, on one thread.
    fn of_any_arity<C: Container>(tree: &Tree<C>, token: &CancelToken) -> Result<Self, Cancelled> {
        let mut sums = Self { min_leaf_depth: u32::MAX, ..Self::default() };
        let (depths, scale) = (tree.depths(token)?, tree.area_scale());
        for (nodes, depths) in tree.nodes.chunks(MEDIUM_STEPS).zip(depths.chunks(MEDIUM_STEPS)) {
            token.check()?;
            for (node, &depth) in nodes.iter().zip(depths) {
                let area = f64::from(node.container.scaled(scale).relative_area());
                count(&mut sums.nodes_per_depth, depth, 1);
                if node.is_leaf() {
                    sums.leaf_area += area * f64::from(node.count);
                    sums.leaf_depth += u64::from(depth);
                    sums.min_leaf_depth = sums.min_leaf_depth.min(depth);
                    count(&mut sums.leaf_sizes, node.count, 1);
                } else {
                    sums.interior_area += area;
                    count(&mut sums.arities, node.arity(), 1);
                }
            }
        }
        Ok(sums)
    }

    /// Adds `nodes` of depth `depth` whose `count` is the number of primitives in their subtree: 1 for leaves, more for others.
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

    /// The sums of both.
    pub(crate) fn plus(mut self, other: &Self) -> Self {
        self.interior_area += other.interior_area;
        self.leaf_area += other.leaf_area;
        self.leaf_depth += other.leaf_depth;
        self.has_other_arity |= other.has_other_arity;
        for (sums, others) in
            [(&mut self.nodes_per_depth, &other.nodes_per_depth), (&mut self.leaf_sizes, &other.leaf_sizes)]
        {
            others.iter().zip(0..).for_each(|(&number, index)| count(sums, index, number));
        }
        self
    }
}

/// Adds `number` to an element of a list, which grows as needed.
fn count(list: &mut Vec<u32>, index: u32, number: u32) {
    let index = index as usize;
    if index >= list.len() {
        list.resize(index + 1, 0);
    }
    list[index] += number;
}

/// [`tree_stats`] of a tree of one kind.
pub(crate) fn stats_of<C: Container>(tree: &Tree<C>, token: &CancelToken) -> Result<TreeStats, Cancelled> {
    let Some(root) = tree.nodes.first() else { return Ok(TreeStats::default()) };
    let mut sums = Sums::default();
    count(&mut sums.nodes_per_depth, 0, 1);
    let root_area = f64::from(tree.area(0));
    let mut pairs = Vec::new();
    if root.is_leaf() {
        count(&mut sums.leaf_sizes, root.count, 1);
        sums.leaf_area = root_area * f64::from(root.count);
    } else if root.arity() == 2 {
        sums.interior_area = root_area;
        pairs.push(root.first);
    } else {
        return Ok(Sums::of_any_arity(tree, token)?.into_stats(tree));
    }
    // Depth by depth on one thread until there is work for all. No list of depths is needed, which only one thread could make.
    let mut depth = 1;
    while (1..SUBTREES).contains(&pairs.len()) && !sums.has_other_arity {
        sums.add_depth(tree, &mut pairs, depth, token)?;
        depth += 1;
    }
    let parts: Vec<Sums> = par_tasks(pairs.chunks(SUBTREES_AT_ONCE), token, |pairs, token| {
        let (mut sums, mut pairs) = (Sums::default(), pairs.to_vec());
        for depth in depth.. {
            if pairs.is_empty() || sums.has_other_arity {
                break;
            }
            sums.add_depth(tree, &mut pairs, depth, token)?;
        }
        Ok(sums)
    })?;
    let sums = parts.iter().fold(sums, Sums::plus);
    let sums = if sums.has_other_arity { Sums::of_any_arity(tree, token)? } else { sums };
    Ok(sums.into_stats(tree))
}

impl Sums {
    /// The statistics of `tree`, of whose nodes these are the sums.
    pub(crate) fn into_stats<C: Container>(mut self, tree: &Tree<C>) -> TreeStats {
        let root_area = if tree.nodes.is_empty() { 0.0 } else { f64::from(tree.area(0)) };
        let sums = &mut self;
        count(&mut sums.leaf_sizes, 0, 0);
        sums.leaf_sizes[0] = 0;
        let leaves: usize = sums.leaf_sizes.iter().map(|&count| count as usize).sum();
        let interior = tree.nodes.len() - leaves;
        if sums.arities.is_empty() {
            sums.arities = if interior > 0 { vec![0, 0, interior as u32] } else { Vec::new() };
            // Above the highest leaf each node has two children on the next level.
            let is_full = |levels: &[u32]| levels[1] == 2 * levels[0];
            sums.min_leaf_depth = sums.nodes_per_depth.windows(2).take_while(|levels| is_full(levels)).count() as u32;
        }
        let cost =
            sums.interior_area * f64::from(C::KIND.traversal_cost()) + sums.leaf_area * f64::from(INTERSECTION_COST);
        TreeStats {
            nodes: tree.nodes.len(),
            leaves,
            max_depth: tree.max_depth,
            min_leaf_depth: sums.min_leaf_depth,
            mean_leaf_depth: (sums.leaf_depth as f64 / leaves.max(1) as f64) as f32,
            min_leaf_size: sums.leaf_sizes.iter().position(|&count| count > 0).unwrap_or(0) as u32,
            mean_leaf_size: (tree.primitive_indices.len() as f64 / leaves.max(1) as f64) as f32,
            max_leaf_size: sums.leaf_sizes.len() as u32 - 1,
            nodes_per_depth: self.nodes_per_depth,
            leaf_size_histogram: self.leaf_sizes,
            // All nodes but the root are children of one.
            mean_arity: if interior > 0 { ((tree.nodes.len() - 1) as f64 / interior as f64) as f32 } else { 0.0 },
            max_arity: self.arities.len().saturating_sub(1) as u32,
            arity_histogram: self.arities,
            sah_cost: normalized_cost(cost, root_area) as f32,
        }
    }
}

/// SAH cost of `tree` if each subtree were one leaf wherever that is cheaper, by which trees with and without large leaves can be
/// compared. Same constants and normalisation as [`TreeStats::sah_cost`].
pub fn collapsed_sah_cost(tree: &AnyTree) -> f64 {
    with_tree!(tree, tree => collapsed_cost_of(tree))
}

/// [`collapsed_sah_cost`] of a tree of one kind.
pub fn collapsed_cost_of<C: Container>(tree: &Tree<C>) -> f64 {
    if tree.nodes.is_empty() {
        return 0.0;
    }
    let mut counts = vec![0_u32; tree.nodes.len()];
    let mut costs = vec![0.0_f64; tree.nodes.len()];
    // Backwards, so that children are done before their parents.
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        let area = f64::from(tree.area(index as u32));
        let (count, children_cost) = if node.is_leaf() {
            (node.count, f64::INFINITY)
        } else {
            let below = |sum: (u32, f64), child: u32| (sum.0 + counts[child as usize], sum.1 + costs[child as usize]);
            node.children().fold((0, 0.0), below)
        };
        counts[index] = count;
        costs[index] = (area * f64::from(C::KIND.traversal_cost()) + children_cost)
            .min(area * f64::from(count) * f64::from(INTERSECTION_COST));
    }
    normalized_cost(costs[0], f64::from(tree.area(0)))
}

/// `cost / root_area`; 0 where the root has no area, as in a scene of points.
pub(crate) fn normalized_cost(cost: f64, root_area: f64) -> f64 {
    if root_area > 0.0 && cost.is_finite() && root_area.is_finite() { cost / root_area } else { 0.0 }
}
