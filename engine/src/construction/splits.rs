//! The splits of a tree that was built from the top: its interior nodes, in an order in which parents come before their children.

use crate::builders::{BuildError, build_binary};
use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use crate::geometry::Triangle;
use crate::kernel::parallel::zeros;
use crate::settings::{BuildSettings, BuilderKind, Pass, Passes};
use crate::tree::{AnyTree, Container, Tree};
use crate::with_tree;

use super::timeline::{MergeOrder, Timeline, merges_by_distance};

/// A tree as its builder split it, before all passes over it. Nothing is recorded while it is built: a split is an interior node.
#[derive(Debug, Clone, PartialEq)]
pub struct SplitTree {
    /// The tree.
    pub tree: AnyTree,
    /// Number of triangles that both sides of a node hold; empty where the builder cuts none.
    shared: Vec<u32>,
}

impl SplitTree {
    /// The builders that split from the top.
    pub const BUILDERS: [BuilderKind; 4] =
        [BuilderKind::Lbvh, BuilderKind::BinnedSah, BuilderKind::Sweep, BuilderKind::Sbvh];

    /// A builder splits from the top.
    pub fn is_made_by(builder: BuilderKind) -> bool {
        Self::BUILDERS.contains(&builder)
    }

    /// Builds the tree of `triangles` by one of [`SplitTree::BUILDERS`], with `settings` but for passes over the finished tree. Refused
    /// for other builders.
    pub fn new(triangles: &[Triangle], settings: &BuildSettings, token: &CancelToken) -> Result<Self, BuildError> {
        if !Self::is_made_by(settings.builder) {
            return Err(BuildError::Refused(format!("{} splits nothing", settings.builder.label())));
        }
        let is_split = settings.passes().contains(Pass::Split);
        let optimize = if is_split { Passes::NONE.with(Pass::Split) } else { Passes::NONE };
        let (tree, _) = build_binary(triangles, &BuildSettings { optimize, ..*settings }, token)?;
        // The pass cuts triangles before they are split.
        let cuts = settings.builder == BuilderKind::Sbvh && !is_split;
        let shared = if cuts { with_tree!(&tree, tree => shared(tree, triangles.len(), token)?) } else { Vec::new() };
        Ok(Self { tree, shared })
    }

    /// The splits in an order: as a build by one thread splits, the node before its left side and that before its right side; by area,
    /// the largest first, but no child before its parent; or by depth.
    pub fn timeline(&self, order: MergeOrder, token: &CancelToken) -> Result<Timeline, Cancelled> {
        with_tree!(&self.tree, tree => Timeline::of_splits(tree, order, splits(tree, order, token)?, token))
    }

    /// The builder cuts triangles, so that there are spatial splits.
    pub fn cuts(&self) -> bool {
        !self.shared.is_empty()
    }

    /// Number of triangles that both sides of `node` hold, because a spatial split cut them; 0 for other splits.
    pub fn duplicates(&self, node: u32) -> u32 {
        self.shared.get(node as usize).copied().unwrap_or(0)
    }
}

/// The interior nodes in an order.
fn splits<C: Container>(tree: &Tree<C>, order: MergeOrder, token: &CancelToken) -> Result<Vec<u32>, Cancelled> {
    let mut found = Vec::with_capacity(tree.nodes.len() / 2);
    match order {
        MergeOrder::Distance => {
            found = merges_by_distance(tree, token)?;
            found.reverse();
        }
        MergeOrder::Built => {
            let mut open: Vec<u32> = (0..tree.nodes.len().min(1) as u32).collect();
            while let Some(at) = open.pop() {
                token.check_every(LIGHT_STEPS, found.len())?;
                let node = &tree.nodes[at as usize];
                if !node.is_leaf() {
                    found.push(at);
                    open.extend([node.first + 1, node.first]);
                }
            }
        }
        MergeOrder::Level => {
            let depths = tree.depths(token)?;
            found.extend((0..tree.nodes.len() as u32).filter(|&at| !tree.nodes[at as usize].is_leaf()));
            found.sort_by_key(|&at| depths[at as usize]);
        }
    }
    Ok(found)
}

/// For each node the number of triangles that both of its sides hold.
fn shared<C: Container>(tree: &Tree<C>, triangles: usize, token: &CancelToken) -> Result<Vec<u32>, Cancelled> {
    let mut first_slots: Vec<u32> = zeros(tree.nodes.len(), token)?;
    let mut parents: Vec<u32> = zeros(tree.nodes.len(), token)?;
    let mut leaf_of_slot: Vec<u32> = zeros(tree.primitive_indices.len(), token)?;
    for (at, node) in tree.nodes.iter().enumerate().rev() {
        token.check_every(LIGHT_STEPS, at)?;
        first_slots[at] = if node.is_leaf() { node.first } else { first_slots[node.first as usize] };
        node.children().for_each(|child| parents[child as usize] = at as u32);
        leaf_of_slot[node.slots()].fill(at as u32);
    }
    let mut shared: Vec<u32> = zeros(tree.nodes.len(), token)?;
    let mut last_slots = vec![u32::MAX; triangles];
    for (slot, &triangle) in (0..).zip(&tree.primitive_indices) {
        token.check_every(LIGHT_STEPS, slot as usize)?;
        let last = std::mem::replace(&mut last_slots[triangle as usize], slot);
        if last == u32::MAX {
            continue;
        }
        // Two slots that follow one another among those of a triangle are on both sides of one node: the lowest above both.
        let mut at = leaf_of_slot[slot as usize];
        while first_slots[at as usize] > last {
            at = parents[at as usize];
        }
        shared[at as usize] += 1;
    }
    Ok(shared)
}
