//! Costs of single binary nodes, and what one range of chunks hands to the next stage of the bottom-up pass.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Simd, SimdBase, f32x8};

use crate::tree::Node;
use crate::wide::bounds::WideContainer;
use crate::wide::collapse::cost::{LaneCosts, block_count};
use crate::wide::collapse::decision::DecisionRef;
use crate::wide::collapse::visit_order::leaf_hits;
use crate::wide::layout::WIDTH;

/// Index for the lane costs of a leaf, whose cost is the same for any number of lanes.
pub(crate) const LEAF: u32 = u32::MAX;

/// Least cost of a binary node and everything below it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NodeCost {
    /// Surface area times cost, summed over the subtree, where it takes one lane.
    pub(crate) cost: f32,
    /// Surface area times the share of rays that hit something, see [`node_hits`](super::visit_order::node_hits).
    pub(crate) hits: f32,
    /// Slot of the first primitive below.
    pub(crate) first: u32,
    /// Number of primitives below.
    pub(crate) count: u32,
    /// Index of the node's [`LaneCosts`] in a list; [`LEAF`] for a leaf of the wide tree.
    pub(crate) lane_costs: u32,
    pub(crate) decision: DecisionRef,
}

impl NodeCost {
    /// Cost of a leaf of the binary tree.
    pub(crate) fn leaf<C: WideContainer>(node: &Node<C>) -> Self {
        let Node { container, first, count } = node;
        let area = container.nonempty_area();
        let (cost, hits) = (area * block_count(*count), leaf_hits(area, *count));
        Self { cost, hits, first: *first, count: *count, lane_costs: LEAF, decision: DecisionRef::leaf(*first) }
    }

    /// Cost with at most one to eight lanes; `list` holds the lane costs.
    #[inline(always)]
    pub(crate) fn lane_costs<S: Simd>(&self, simd: S, list: &[LaneCosts]) -> f32x8<S> {
        let same = [self.cost; WIDTH];
        f32x8::load_array_ref(simd, list.get(self.lane_costs as usize).unwrap_or(&same))
    }
}

/// Result of a range of chunks for the ranges around it.
#[derive(Default)]
pub(crate) struct Boundary {
    /// Interior nodes of known cost whose parents lie outside the range, in ascending order.
    pub(crate) roots: Vec<(u32, NodeCost)>,
    /// Lane costs of these nodes.
    pub(crate) lane_costs: Vec<LaneCosts>,
    /// Nodes with descendants outside the range, in descending order.
    pub(crate) pending: Vec<u32>,
}

impl Boundary {
    /// Adds a root, whose lane costs are in `list`.
    pub(crate) fn add(&mut self, node: u32, mut cost: NodeCost, list: &[LaneCosts]) {
        if cost.lane_costs != LEAF {
            self.lane_costs.push(list[cost.lane_costs as usize]);
            cost.lane_costs = self.lane_costs.len() as u32 - 1;
        }
        self.roots.push((node, cost));
    }
}
