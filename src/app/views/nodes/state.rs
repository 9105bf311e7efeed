//! The view "Nodes": which nodes of the outline are unfolded, and the rows that this makes; how the list of worst nodes
//! is sorted, and what was ranked.

use std::collections::{BTreeSet, HashSet};
use std::sync::{Arc, Weak};

use serde::{Deserialize, Serialize};

use crate::accel::node_values::KnownVisits;
use crate::accel::{Accel, is_same};
use crate::app::state::{Derived, Presented, Study, ViewState};
use crate::catalog::metrics::{self, Metric, Source};
use crate::lab::by_depth::Depth;
use crate::lab::node_ranking::NodeOrder;
use crate::lab::population::Population;
use crate::overlay::NodeTable;

/// Inputs of a ranking.
#[derive(Debug, Clone, PartialEq)]
pub struct RankingInputs {
    /// Which nodes, in which order.
    pub order: NodeOrder,
    /// The measured visits, where the order needs them.
    pub visits: Option<KnownVisits>,
}

/// Input of the list of depths: the measured visits, where they are known.
pub type DepthInputs = Option<(Population, KnownVisits)>;

/// The tree by depth.
#[derive(Debug, Clone)]
pub struct DepthList {
    /// The depths, the root's first.
    pub depths: Vec<Depth>,
    /// Number of measured rays that enter the root.
    pub entering: u32,
}

/// The outline of the tree or its depths, and the list of worst nodes.
#[derive(Debug)]
pub struct NodesView {
    /// The outline.
    pub outline: Outline,
    /// The depths are listed in place of the outline.
    pub is_by_depth: bool,
    /// The listed depths.
    pub depths: Study<DepthInputs, Arc<DepthList>>,
    /// How it is sorted.
    pub order: NodeOrder,
    /// The listed nodes, the worst first.
    pub ranking: Study<RankingInputs, Vec<u32>>,
    /// The node to which the list was scrolled last, so that it can be scrolled away from the selected node.
    revealed: Option<u32>,
    /// The unfolded nodes of a pasted state, for its tree.
    pasted_unfolded: BTreeSet<u32>,
}

/// The part of the view in a shared state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SharedNodesView {
    order: NodeOrder,
    unfolded: BTreeSet<u32>,
    #[serde(default)]
    is_by_depth: bool,
}

impl Default for SharedNodesView {
    fn default() -> Self {
        NodesView::default().shared(None)
    }
}

impl Default for NodesView {
    fn default() -> Self {
        let order = NodeOrder { metric: metrics::REGRET, ascending: false, min_area: 0.001 };
        Self {
            outline: Outline::default(),
            is_by_depth: false,
            depths: Study::default(),
            order,
            ranking: Study::default(),
            revealed: None,
            pasted_unfolded: BTreeSet::from([0]),
        }
    }
}

impl ViewState for NodesView {
    const NAME: &'static str = "Nodes";
    type Shared = SharedNodesView;

    fn shared(&self, tree: Option<&Arc<Accel>>) -> SharedNodesView {
        let Self { outline, is_by_depth, depths: _, order, ranking: _, revealed: _, pasted_unfolded } = self;
        let unfolded = tree.map_or_else(|| pasted_unfolded.clone(), |tree| outline.unfolded(tree));
        SharedNodesView { order: *order, unfolded, is_by_depth: *is_by_depth }
    }

    fn show_shared(&mut self, SharedNodesView { order, unfolded, is_by_depth }: SharedNodesView) {
        self.is_by_depth = is_by_depth;
        let min_area = if order.min_area.is_finite() { order.min_area.clamp(0.0, 1.0) } else { 0.0 };
        (self.order, self.revealed) = (NodeOrder { min_area, ..order }, None);
        self.pasted_unfolded = unfolded;
    }

    fn show_shared_nodes(&mut self, shown: &Presented) {
        let mut nodes = self.pasted_unfolded.clone();
        nodes.retain(|&node| (node as usize) < shown.table.len());
        self.outline.unfold(&shown.accel, &shown.table, nodes);
    }

    #[cfg(test)]
    fn changed() -> Self {
        let order = NodeOrder { metric: metrics::OVERLAP, ascending: true, min_area: 0.01 };
        Self { order, pasted_unfolded: BTreeSet::from([0, 2]), is_by_depth: true, ..Self::default() }
    }
}

impl NodesView {
    /// Inputs of the list of worst nodes of `accel`; `None` while visits or regrets are needed and not known.
    pub(super) fn inputs(&self, derived: &Derived, accel: &Arc<Accel>) -> Option<RankingInputs> {
        let order = self.order;
        if order.metric.source == Source::Regrets {
            derived.regrets.get(accel, &())?;
        }
        let visits = derived.needed_visits(accel, order.metric.source == Source::Visits).ok()?;
        Some(RankingInputs { order, visits })
    }

    /// Input of the list of depths of `accel`.
    pub(super) fn depth_inputs(derived: &Derived, accel: &Arc<Accel>) -> DepthInputs {
        let (rays, measured) = derived.measured(accel)?;
        Some((rays.population(), KnownVisits(Arc::clone(&measured.visits))))
    }

    /// Sorts by `metric`, the largest first; by the metric that it is sorted by already, the other way round.
    pub fn sort_by(&mut self, metric: &'static Metric) {
        let ascending = self.order.metric == metric && !self.order.ascending;
        self.order = NodeOrder { metric, ascending, ..self.order };
        self.revealed = None;
    }

    /// Where `selected` is in the list `ranked`, once after each change of it.
    pub fn reveal(&mut self, selected: Option<u32>, ranked: &[u32]) -> Option<usize> {
        if self.revealed == selected {
            return None;
        }
        self.revealed = selected;
        ranked.iter().position(|&node| Some(node) == selected)
    }

    /// The node `step` places below `selected` in the list of `accel`, or the first where that is not listed; `None` at either end
    /// and while nothing is ranked.
    pub fn neighbour(&self, accel: &Arc<Accel>, selected: Option<u32>, step: isize) -> Option<u32> {
        let ranked = self.ranking.of_tree(accel)?;
        let place = ranked.iter().position(|&node| Some(node) == selected);
        let target = place.map_or(Some(0), |place| place.checked_add_signed(step))?;
        ranked.get(target).copied()
    }
}

/// A row of the outline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OutlineRow {
    /// The node.
    pub node: u32,
    /// Its depth; the root's is 0.
    pub depth: u32,
}

/// Unfolded nodes of the presented tree, with the rows in their order. Only unfolded nodes cost anything, so that a tree of
/// millions can be walked.
#[derive(Debug, Default)]
pub struct Outline {
    tree: Weak<Accel>,
    unfolded: HashSet<u32>,
    rows: Vec<OutlineRow>,
    /// The node that was revealed last, so that the user can fold what is above a selected node.
    revealed: Option<u32>,
}

impl Outline {
    /// Lists the root and its children where the tree is another one than the last time.
    pub fn follow(&mut self, accel: &Arc<Accel>, table: &NodeTable) {
        if !is_same(&self.tree, accel) {
            *self = Self { tree: Arc::downgrade(accel), unfolded: HashSet::from([0]), ..Self::default() };
            self.list(table);
        }
    }

    /// The unfolded nodes of `accel`; the root alone where another tree is listed.
    pub fn unfolded(&self, accel: &Arc<Accel>) -> BTreeSet<u32> {
        if is_same(&self.tree, accel) { self.unfolded.iter().copied().collect() } else { BTreeSet::from([0]) }
    }

    /// Unfolds nodes of `accel`, and folds all others.
    pub fn unfold(&mut self, accel: &Arc<Accel>, table: &NodeTable, nodes: BTreeSet<u32>) {
        self.follow(accel, table);
        self.unfolded = nodes.into_iter().collect();
        self.list(table);
    }

    /// The listed nodes, parents before their children.
    pub fn rows(&self) -> &[OutlineRow] {
        &self.rows
    }

    /// Whether the children of `node` are listed.
    pub fn is_unfolded(&self, node: u32) -> bool {
        self.unfolded.contains(&node)
    }

    /// Lists the children of `node`, or no longer.
    pub fn toggle(&mut self, node: u32, table: &NodeTable) {
        if !self.unfolded.remove(&node) {
            self.unfolded.insert(node);
        }
        self.list(table);
    }

    /// Unfolds all nodes above `node`, once after each change of `node`. Returns its row where it was revealed just now.
    pub fn reveal(&mut self, node: u32, table: &NodeTable) -> Option<usize> {
        if self.revealed.replace(node) == Some(node) {
            return None;
        }
        let mut above = table.parent(node);
        let mut changed = false;
        while let Some(node) = above {
            changed |= self.unfolded.insert(node);
            above = table.parent(node);
        }
        if changed {
            self.list(table);
        }
        self.rows.iter().position(|row| row.node == node)
    }

    fn list(&mut self, table: &NodeTable) {
        self.rows.clear();
        let mut open = if table.is_empty() { Vec::new() } else { vec![OutlineRow { node: 0, depth: 0 }] };
        while let Some(row) = open.pop() {
            self.rows.push(row);
            if self.unfolded.contains(&row.node) {
                let depth = row.depth + 1;
                open.extend(table.children(row.node).rev().map(|node| OutlineRow { node, depth }));
            }
        }
    }
}
