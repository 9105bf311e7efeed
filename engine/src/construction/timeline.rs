//! The merges or the splits of a tree in an order, step by step: which clusters are active after each.

use std::ops::Range;

use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use crate::kernel::parallel::{par_collect, zeros};
use crate::order::radix_sort;
use crate::tree::{AnyTree, Container, Tree};
use crate::with_tree;

use super::construct::Construction;
use super::record::MergeRecord;
use super::snapshots::{Snapshots, ordered_bits};

/// An order in which the merges of a tree are shown, children before their parents; or its splits, parents before their children.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum MergeOrder {
    /// As a build by one thread merges or splits.
    #[default]
    Built,
    /// By the area of the container that is made, ascending, but no parent before its children; splits the other way round.
    Distance,
    /// By the level of the recursion, deepest first; within a level as built. Splits by depth, the root first.
    Level,
}

impl MergeOrder {
    /// Every order, in the order in which menus list them.
    pub const ALL: [Self; 3] = [Self::Built, Self::Distance, Self::Level];

    /// The name on the command line and in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Built => "built",
            Self::Distance => "distance",
            Self::Level => "level",
        }
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Built => "As built",
            Self::Distance => "By distance",
            Self::Level => "By level",
        }
    }
}

/// The merges of a tree in one order, or its splits. At step k, after k merges, those nodes are active that have been made and are not yet
/// merged: as many as there are leaves, less k. After k splits those that have been made and are not yet split: k + 1. In either case each
/// leaf lies below one of them. Takes some 32 bytes per node.
#[derive(Debug, Clone, PartialEq)]
pub struct Timeline {
    order: MergeOrder,
    /// Step from which on each node is active; 0 for those of step 0.
    births: Vec<u32>,
    /// Step from which on each node is no longer active; `u32::MAX` for those of the last step.
    deaths: Vec<u32>,
    /// The node that each step makes, or splits: that of step k at k − 1.
    nodes: Vec<u32>,
    /// The first child of each of these, where they are split.
    first_children: Option<Vec<u32>>,
    snapshots: Snapshots,
}

impl Construction {
    /// The merges of this construction in `order`.
    pub fn timeline(&self, order: MergeOrder, token: &CancelToken) -> Result<Timeline, Cancelled> {
        let merged = match order {
            MergeOrder::Built => self.record.nodes().to_vec(),
            MergeOrder::Distance => return Timeline::by_distance(&self.tree, token),
            MergeOrder::Level => by_level(&self.record, token)?,
        };
        with_tree!(&self.tree, tree => Timeline::new(tree, order, merged, token))
    }
}

impl Timeline {
    /// The merges of any binary tree by the area of the container that is made, whoever made it.
    pub fn by_distance(tree: &AnyTree, token: &CancelToken) -> Result<Self, Cancelled> {
        with_tree!(tree, tree => {
            let merged = merges_by_distance(tree, token)?;
            Self::new(tree, MergeOrder::Distance, merged, token)
        })
    }

    /// The timeline of `tree` in which the nodes `merged` are made one after another.
    fn new<C: Container>(
        tree: &Tree<C>,
        order: MergeOrder,
        merged: Vec<u32>,
        token: &CancelToken,
    ) -> Result<Self, Cancelled> {
        let mut births = zeros::<u32>(tree.nodes.len(), token)?;
        let mut deaths = zeros::<u32>(tree.nodes.len(), token)?;
        if let Some(root) = deaths.first_mut() {
            *root = u32::MAX;
        }
        for (step, &node) in (1..).zip(&merged) {
            token.check_every(LIGHT_STEPS, step as usize)?;
            births[node as usize] = step;
            let first = tree.nodes[node as usize].first as usize;
            deaths[first..first + 2].fill(step);
        }
        let areas = par_collect(tree.nodes.len(), token, |node| tree.area(node as u32))?;
        let snapshots = Snapshots::new(areas, &births, &deaths, token)?;
        Ok(Self { order, births, deaths, nodes: merged, first_children: None, snapshots })
    }

    /// The timeline of `tree` in which the nodes `split` are split one after another.
    pub(super) fn of_splits<C: Container>(
        tree: &Tree<C>,
        order: MergeOrder,
        split: Vec<u32>,
        token: &CancelToken,
    ) -> Result<Self, Cancelled> {
        let mut births = zeros::<u32>(tree.nodes.len(), token)?;
        let mut deaths = vec![u32::MAX; tree.nodes.len()];
        for (step, &node) in (1..).zip(&split) {
            token.check_every(LIGHT_STEPS, step as usize)?;
            deaths[node as usize] = step;
            let first = tree.nodes[node as usize].first as usize;
            births[first..first + 2].fill(step);
        }
        let first_children = par_collect(split.len(), token, |at| tree.nodes[split[at] as usize].first)?;
        let areas = par_collect(tree.nodes.len(), token, |node| tree.area(node as u32))?;
        let snapshots = Snapshots::new(areas, &births, &deaths, token)?;
        Ok(Self { order, births, deaths, nodes: split, first_children: Some(first_children), snapshots })
    }

    /// Its steps split nodes rather than merge them.
    pub fn splits(&self) -> bool {
        self.first_children.is_some()
    }

    /// The order of its merges or splits.
    pub fn order(&self) -> MergeOrder {
        self.order
    }

    /// Number of merges or splits, which is also the last step.
    pub fn steps(&self) -> u32 {
        self.nodes.len() as u32
    }

    /// The node that each step makes, or splits: that of step k at k − 1.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// The step that makes `node`, or splits it; `None` where there is none, as for a leaf.
    pub fn step_of(&self, node: u32) -> Option<u32> {
        let lifetime = self.lifetime(node);
        let step = if self.splits() { lifetime.end } else { lifetime.start };
        (step != 0 && step != u32::MAX).then_some(step)
    }

    /// The step at which so many clusters are active; the nearest where there is none.
    pub fn step_with(&self, active: u32) -> u32 {
        let others = active.max(1) - 1;
        if self.splits() { others.min(self.steps()) } else { self.steps().saturating_sub(others) }
    }

    /// At `step`, all below `node` belongs to one cluster.
    pub(super) fn is_whole(&self, node: u32, step: u32) -> bool {
        let lifetime = self.lifetime(node);
        if self.splits() { lifetime.end > step } else { lifetime.start <= step }
    }

    /// Steps at which `node` is active; those of the nodes of the last step have no end.
    pub fn lifetime(&self, node: u32) -> Range<u32> {
        self.births[node as usize]..self.deaths[node as usize]
    }

    /// Whether `node` is active at `step`.
    pub fn stands(&self, node: u32, step: u32) -> bool {
        self.lifetime(node).contains(&step)
    }

    /// Number of active clusters at `step`.
    pub fn standing(&self, step: u32) -> u32 {
        let step = step.min(self.steps());
        match (self.births.is_empty(), self.splits()) {
            (true, _) => 0,
            (false, true) => step + 1,
            (false, false) => self.steps() + 1 - step,
        }
    }

    /// The `count` largest active clusters at `step`, by area of their containers, then by index: at most
    /// [`Timeline::MAX_LARGEST`]. Takes time that does not depend on the size of the tree.
    pub fn largest_at(&self, step: u32, count: usize) -> Vec<u32> {
        let step = step.min(self.steps());
        self.snapshots.largest_at(step, count, &self.deaths, &|first| self.made_since(first, step))
    }

    /// The nodes that the steps after `first` up to `step` make.
    fn made_since(&self, first: u32, step: u32) -> Vec<u32> {
        let steps = first as usize..step as usize;
        match &self.first_children {
            None => self.nodes[steps].to_vec(),
            Some(children) => children[steps].iter().flat_map(|&first| [first, first + 1]).collect(),
        }
    }

    /// Maximum number of clusters that [`Timeline::largest_at`] returns.
    pub const MAX_LARGEST: usize = super::snapshots::MAX_LARGEST;
}

/// The interior nodes by the largest area in their subtree, ascending; of equal ones the later in the list of nodes first, because
/// children follow their parents.
pub(super) fn merges_by_distance<C: Container>(tree: &Tree<C>, token: &CancelToken) -> Result<Vec<u32>, Cancelled> {
    let mut largest = zeros::<u32>(tree.nodes.len(), token)?;
    let mut keys = Vec::with_capacity(tree.nodes.len() / 2);
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        token.check_every(LIGHT_STEPS, index)?;
        // A leaf's own area merges nothing.
        if !node.is_leaf() {
            let first = node.first as usize;
            largest[index] = ordered_bits(node.container.relative_area()).max(largest[first]).max(largest[first + 1]);
            keys.push(u64::from(largest[index]) << 32 | u64::from(!(index as u32)));
        }
    }
    radix_sort(&mut keys, u64::BITS, token)?;
    par_collect(keys.len(), token, |at| !(keys[at] as u32))
}

/// The interior nodes by level, deepest first, then by merge number. A call of `combine_clusters` comes after all below it, and the
/// last after the root's.
fn by_level(record: &MergeRecord, token: &CancelToken) -> Result<Vec<u32>, Cancelled> {
    let deepest = record.steps().iter().map(|step| step.level).max().unwrap_or(0);
    let mut keys = Vec::with_capacity(record.len());
    for (index, step) in record.steps().iter().enumerate() {
        token.check_every(LIGHT_STEPS, index)?;
        keys.extend(step.merges().map(|merge| u64::from(deepest - step.level) << 32 | u64::from(merge)));
    }
    radix_sort(&mut keys, u64::BITS - u64::from(deepest).leading_zeros() + 32, token)?;
    par_collect(keys.len(), token, |at| record.nodes()[keys[at] as u32 as usize])
}
