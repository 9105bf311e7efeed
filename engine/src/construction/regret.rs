//! Regret: how much cheaper each part of a tree would be if its triangles were built into a new subtree.
//!
//! A subtree is rebuilt by binned splits and, where it is small, by exact clustering too; the cheaper counts. The *gain* of a node is
//! the cost of its subtree minus that of the best one known, in which the children may be rebuilt one by one. The gain alone ranks badly:
//! a defect adds as much to the gain of every node above it. So the *regret* of a node is its whole gain only where that is the largest
//! part of the cost: in no child, and not in its parent, a larger part of the cost could be saved. Elsewhere it is what the split of the
//! node alone costs: its gain without those of its children.

use std::collections::BinaryHeap;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use crate::aac::{Cluster, ClusterContainer, ClusterStack};
use crate::builders::binned_sah::{BuildPrimitive, best_split};
use crate::builders::exact::agglomerate;
use crate::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use crate::geometry::Triangle;
use crate::kernel::parallel::{par_collect, zeros};
use crate::tree::node_metrics::own_cost;
use crate::tree::statistics::INTERSECTION_COST;
use crate::tree::{AnyTree, Node, Tree, with_built_tree};

/// Most triangles of a subtree that is clustered exactly, which takes quadratic time.
pub const EXACT_TRIANGLES: usize = 500;
/// Memory in bytes that rebuilding takes for each triangle.
pub const BYTES_PER_TRIANGLE: u64 = 64;
/// Most triangles of a subtree that one thread rebuilds beside others.
const ALONE_ABOVE: u32 = 1 << 15;
/// Most triangles that one thread splits.
const FORK_ABOVE: usize = 1 << 12;
/// Depth from which on primitives are halved without searching for a split, which bounds the recursion.
const MAX_SPLIT_DEPTH: u32 = 96;
/// Part of the cost of a subtree below which a difference is rounding.
const ROUNDING: f64 = 1e-6;

/// Which subtrees are rebuilt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RegretLimits {
    /// Most triangles of a subtree.
    pub triangles: usize,
    /// Sum of the work of all subtrees, in triangles that are split once. The subtrees of greatest cost come first.
    pub work: u64,
}

impl Default for RegretLimits {
    /// Some seconds on one core, for any tree: all subtrees of a model of some ten thousand triangles, and of the dragon (871,000) the
    /// costliest.
    fn default() -> Self {
        Self { triangles: usize::MAX, work: 200_000_000 }
    }
}

/// Savings from rebuilding parts of a tree, as shares of its SAH cost.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Regrets {
    own: Vec<f32>,
    gains: Vec<f32>,
    /// Number of subtrees that were rebuilt.
    pub rebuilt: usize,
}

impl Regrets {
    /// The regret of `node` over the cost of the tree, 0 to 1. `None` where the subtree or that of a child was not rebuilt, and for
    /// indices beyond the tree.
    pub fn regret(&self, node: u32) -> Option<f32> {
        known(&self.own, node)
    }

    /// Cost of the subtree minus the cost of the best known one of the same triangles, over the cost of the tree, 0 to 1. `None` where
    /// it was not rebuilt.
    pub fn gain(&self, node: u32) -> Option<f32> {
        known(&self.gains, node)
    }
}

fn known(values: &[f32], node: u32) -> Option<f32> {
    values.get(node as usize).copied().filter(|value| !value.is_nan())
}

/// The regrets of a binary `tree` of `triangles`, in the calling thread's rayon pool; none of any other tree, whose cost cannot be
/// compared with a binary one. Rebuilt leaves have as many triangles as the tree's largest at most, where that is cheaper. A tree
/// of oriented boxes is judged by its plain ones.
pub fn regrets(
    tree: &AnyTree,
    triangles: &[Triangle],
    limits: RegretLimits,
    token: &CancelToken,
) -> Result<Regrets, Cancelled> {
    with_built_tree!(tree, tree => regrets_of(tree, triangles, limits, token), tree => {
        regrets_of(&tree.to_plain(token)?, triangles, limits, token)
    })
}

fn regrets_of<C: ClusterContainer>(
    tree: &Tree<C>,
    triangles: &[Triangle],
    limits: RegretLimits,
    token: &CancelToken,
) -> Result<Regrets, Cancelled> {
    if tree.nodes.is_empty() || !tree.is_binary(token)? {
        return Ok(Regrets::default());
    }
    let sums = Sums::new(tree, token)?;
    let rebuild = Rebuild { tree, triangles, max_leaf: sums.max_leaf, scale: tree.area_scale() };
    let (large, small) = sums.choose(tree, limits, token)?;
    let all = (large.len() + small.len()).max(1);
    let mut costs = zeros::<f64>(tree.nodes.len(), token)?;
    costs.fill(f64::NAN);
    // Large ones use all threads one after the other, so that their memory is that of one.
    for (done, &node) in large.iter().enumerate() {
        costs[node as usize] = rebuild.cost(node, &token.part(done, all))?;
    }
    let done = AtomicUsize::new(large.len());
    let found = small.par_iter().with_max_len(64).map(|&node| {
        let token = token.part(done.fetch_add(1, Ordering::Relaxed), all);
        let cost = rebuild.cost(node, &token)?;
        token.set_progress(1.0);
        Ok(cost)
    });
    let found = found.collect::<Result<Vec<f64>, Cancelled>>()?;
    small.iter().zip(found).for_each(|(&node, cost)| costs[node as usize] = cost);
    token.set_progress(1.0);
    sums.compare(tree, &costs, token)
}

/// Sums over the subtree of each node.
struct Sums {
    /// SAH cost times the area of the root.
    costs: Vec<f64>,
    /// Primitives in its leaves.
    primitives: Vec<u32>,
    /// Largest number of primitives in a leaf of the tree.
    max_leaf: u32,
}

impl Sums {
    fn new<C: ClusterContainer>(tree: &Tree<C>, token: &CancelToken) -> Result<Self, Cancelled> {
        let mut costs = zeros::<f64>(tree.nodes.len(), token)?;
        let mut primitives = zeros::<u32>(tree.nodes.len(), token)?;
        let mut max_leaf = 1;
        // Backwards, so that children are done before their parents.
        for (index, node) in tree.nodes.iter().enumerate().rev() {
            token.check_every(MEDIUM_STEPS, index)?;
            let children = node.children().map(|child| child as usize);
            costs[index] = own_cost(tree, index as u32) + children.clone().map(|child| costs[child]).sum::<f64>();
            primitives[index] = node.slots().len() as u32 + children.map(|child| primitives[child]).sum::<u32>();
            max_leaf = max_leaf.max(node.slots().len() as u32);
        }
        Ok(Self { costs, primitives, max_leaf })
    }

    /// There is more than one subtree of the primitives below `node`.
    fn has_choice(&self, node: usize) -> bool {
        self.primitives[node] > 2 || self.primitives[node] == 2 && self.max_leaf > 1
    }

    /// The nodes whose subtrees are rebuilt: large ones, and small ones.
    fn choose<C: ClusterContainer>(
        &self,
        tree: &Tree<C>,
        limits: RegretLimits,
        token: &CancelToken,
    ) -> Result<(Vec<u32>, Vec<u32>), Cancelled> {
        let (mut large, mut small, mut work) = (Vec::new(), Vec::new(), 0);
        let key = |node: u32| (self.costs[node as usize].to_bits(), !node);
        // No subtree costs more than the one around it, so that those above a chosen node are chosen as well.
        let mut open = BinaryHeap::from([key(0)]);
        let mut visited = 0_usize;
        while let Some((_, node)) = open.pop() {
            token.check_every(MEDIUM_STEPS, visited)?;
            visited += 1;
            let (node, index) = (!node, !node as usize);
            let primitives = self.primitives[index];
            if primitives as usize <= limits.triangles && self.has_choice(index) {
                work += work_of(primitives);
                if work > limits.work {
                    break;
                }
                let list = if primitives > ALONE_ABOVE { &mut large } else { &mut small };
                list.push(node);
            }
            open.extend(tree.nodes[index].children().map(key));
        }
        Ok((large, small))
    }

    /// The gain of each node, given the `rebuilt` cost of some subtrees; the others have NaN.
    fn compare<C: ClusterContainer>(
        &self,
        tree: &Tree<C>,
        rebuilt: &[f64],
        token: &CancelToken,
    ) -> Result<Regrets, Cancelled> {
        // Lowest known cost of each subtree.
        let mut best = zeros::<f64>(tree.nodes.len(), token)?;
        let mut regrets = zeros::<f32>(tree.nodes.len(), token)?;
        // A larger part of the cost could be saved here than in either child.
        let mut is_peak = zeros::<u8>(tree.nodes.len(), token)?;
        let whole = self.costs[0];
        let share = |cost: f64| if whole > 0.0 { (cost / whole) as f32 } else { 0.0 };
        for (index, node) in tree.nodes.iter().enumerate().rev() {
            token.check_every(MEDIUM_STEPS, index)?;
            let children = node.children().map(|child| child as usize);
            let kept = own_cost(tree, index as u32) + children.clone().map(|child| best[child]).sum::<f64>();
            let saved = kept - rebuilt[index];
            let is_saving = saved > ROUNDING * self.costs[index];
            best[index] = if is_saving { rebuilt[index] } else { kept };
            let left = |node: usize| if self.costs[node] > 0.0 { best[node] / self.costs[node] } else { 1.0 };
            is_peak[index] = u8::from(is_saving && children.clone().all(|child| left(index) <= left(child)));
            let is_known = |node: usize| !rebuilt[node].is_nan() || !self.has_choice(node);
            regrets[index] = match (is_known(index) && children.clone().all(is_known), is_saving) {
                (false, _) => f32::NAN,
                (true, false) => 0.0,
                (true, true) => share(saved),
            };
        }
        let mut is_below_peak = zeros::<u8>(tree.nodes.len(), token)?;
        for (index, node) in tree.nodes.iter().enumerate() {
            token.check_every(MEDIUM_STEPS, index)?;
            if is_peak[index] == 0 {
                continue;
            }
            node.children().for_each(|child| is_below_peak[child as usize] = 1);
            if is_below_peak[index] == 0 && !regrets[index].is_nan() {
                regrets[index] = share(self.costs[index] - best[index]);
            }
        }
        let gains = par_collect(best.len(), token, |node| {
            if rebuilt[node].is_nan() { f32::NAN } else { share(self.costs[node] - best[node]) }
        })?;
        Ok(Regrets { own: regrets, gains, rebuilt: rebuilt.iter().filter(|cost| !cost.is_nan()).count() })
    }
}

/// Work of rebuilding a number of triangles, in triangles that are split once.
fn work_of(triangles: u32) -> u64 {
    let triangles = u64::from(triangles);
    let exact = if triangles as usize <= EXACT_TRIANGLES { triangles * triangles / 16 } else { 0 };
    triangles * u64::from(triangles.ilog2() + 1) + exact
}

/// Rebuilds subtrees of a tree.
struct Rebuild<'a, C> {
    tree: &'a Tree<C>,
    triangles: &'a [Triangle],
    /// Most primitives of a leaf.
    max_leaf: u32,
    /// Factor on coordinates, as in [`Tree::area`].
    scale: f32,
}

/// A rebuilt subtree.
struct Rebuilt<C> {
    container: C,
    count: u32,
    cost: f64,
}

impl<C: ClusterContainer> Rebuild<'_, C> {
    /// Cost of the best subtree that is found for the primitives below `root`.
    fn cost(&self, root: u32, token: &CancelToken) -> Result<f64, Cancelled> {
        token.check()?;
        let mut primitives = self.primitives(root);
        let exact = (primitives.len() <= EXACT_TRIANGLES).then(|| self.clustered(&primitives, token)).transpose()?;
        let split = self.split(&mut primitives, 0, token)?.cost;
        Ok(exact.map_or(split, |exact| exact.min(split)))
    }

    /// The primitives in the leaves below `root`. A primitive that has a leaf for itself has its container, which is smaller than the
    /// triangle's where the triangle was split.
    fn primitives(&self, root: u32) -> Vec<BuildPrimitive<C>> {
        let mut primitives = Vec::new();
        let mut open = vec![root];
        while let Some(node) = open.pop() {
            let node = &self.tree.nodes[node as usize];
            open.extend(node.children());
            let slots = node.slots();
            for &triangle in &self.tree.primitive_indices[slots.clone()] {
                let own = || C::of_triangle(&self.triangles[triangle as usize]);
                let container = if slots.len() == 1 { node.container } else { own() };
                let container = container.scaled(self.scale);
                primitives.push(BuildPrimitive { container, centre: container.centroid(), index: triangle });
            }
        }
        primitives
    }

    /// The subtree of binned splits.
    fn split(
        &self,
        primitives: &mut [BuildPrimitive<C>],
        depth: u32,
        token: &CancelToken,
    ) -> Result<Rebuilt<C>, Cancelled> {
        if let [primitive] = primitives {
            return Ok(Self::leaf(primitive.container));
        }
        let middle = if depth < MAX_SPLIT_DEPTH { best_split(primitives, token)? } else { primitives.len() / 2 };
        let forks = primitives.len() > FORK_ABOVE;
        let (left, right) = primitives.split_at_mut(middle);
        let (left, right) = token.both(
            forks,
            |token| self.split(left, depth + 1, token),
            |token| self.split(right, depth + 1, token),
        )?;
        Ok(self.join(&left, &right))
    }

    /// Cost of the subtree of exact clustering.
    fn clustered(&self, primitives: &[BuildPrimitive<C>], token: &CancelToken) -> Result<f64, Cancelled> {
        let mut clusters = ClusterStack::with_capacity(primitives.len());
        for (primitive, number) in primitives.iter().zip(0..) {
            clusters.push(Cluster::of_primitive(primitive.container.fields(), number));
        }
        let tree = agglomerate(clusters, token)?;
        let mut parts: Vec<Option<Rebuilt<C>>> = tree.nodes.iter().map(|_| None).collect();
        for (index, Node { container, .. }) in tree.nodes.iter().enumerate().rev() {
            let children = tree.nodes[index].children();
            let join = || {
                let [left, right] = [children.start, children.end - 1].map(|child| parts[child as usize].as_ref());
                Some(self.join(left?, right?))
            };
            parts[index] = if children.is_empty() { Some(Self::leaf(*container)) } else { join() };
        }
        Ok(parts.first().and_then(Option::as_ref).map_or(f64::NAN, |root| root.cost))
    }

    fn leaf(container: C) -> Rebuilt<C> {
        Rebuilt { container, count: 1, cost: f64::from(container.relative_area()) * f64::from(INTERSECTION_COST) }
    }

    /// Both under one node, or in one leaf where that is cheaper and allowed.
    fn join(&self, left: &Rebuilt<C>, right: &Rebuilt<C>) -> Rebuilt<C> {
        let container = left.container.union(&right.container);
        let area = f64::from(container.relative_area());
        let count = left.count + right.count;
        let cost = area * f64::from(C::KIND.traversal_cost()) + left.cost + right.cost;
        let as_leaf = area * f64::from(INTERSECTION_COST) * f64::from(count);
        Rebuilt { container, count, cost: if count <= self.max_leaf { cost.min(as_leaf) } else { cost } }
    }
}
