//! The list of worst nodes: how it is sorted, and what was ranked.

use std::sync::Arc;

use crate::accel::Accel;
use crate::app::state::study::Study;
use crate::catalog::metrics::{self, Metric};
use crate::lab::node_ranking::NodeOrder;
use crate::lab::node_values::KnownVisits;

/// What a ranking is made from.
#[derive(Debug, Clone, PartialEq)]
pub struct RankingInputs {
    /// Which nodes, in which order.
    pub order: NodeOrder,
    /// The measured visits, where the order needs them.
    pub visits: Option<KnownVisits>,
}

/// The list of worst nodes.
#[derive(Debug)]
pub struct NodesState {
    /// How it is sorted.
    pub order: NodeOrder,
    /// The listed nodes, the worst first.
    pub ranking: Study<RankingInputs, Vec<u32>>,
    /// The node to which the list was scrolled last, so that it can be scrolled away from the selected node.
    revealed: Option<u32>,
}

impl Default for NodesState {
    fn default() -> Self {
        let order = NodeOrder { metric: metrics::COST, ascending: false, min_area: 0.001 };
        Self { order, ranking: Study::default(), revealed: None }
    }
}

impl NodesState {
    /// Its part of a shared state.
    pub fn shared(&self) -> NodeOrder {
        let Self { order, ranking: _, revealed: _ } = self;
        *order
    }

    /// Sorts as another window did.
    pub fn show_shared(&mut self, order: NodeOrder) {
        let min_area = if order.min_area.is_finite() { order.min_area.clamp(0.0, 1.0) } else { 0.0 };
        (self.order, self.revealed) = (NodeOrder { min_area, ..order }, None);
    }

    /// Name of its view.
    pub const VIEW: &str = "Nodes";

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
