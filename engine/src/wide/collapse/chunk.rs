//! The bottom-up pass over one chunk of binary nodes, whose costs fit a core's second-level cache.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Select, Simd, SimdBase, f32x8, u32x8};

use crate::tree::Node;
use crate::wide::bounds::WideContainer;
use crate::wide::collapse::boundary::{Boundary, LEAF, NodeCost};
use crate::wide::collapse::cost::{LaneCosts, NODE_COST, block_count, collapse_cost};
use crate::wide::collapse::decision::{CHUNK_DECISIONS, Decision, DecisionRef};
use crate::wide::collapse::visit_order::{hits_per_cost, leaf_hits, node_hits};
use crate::wide::layout::{BLOCK, WIDTH};

/// Pairs of siblings in a chunk: each has a parent, which makes one decision.
pub(crate) const CHUNK_PAIRS: usize = CHUNK_DECISIONS;
/// Primitive count of a node with descendants outside the chunk. It saturates: sums with it are never used.
const PENDING: u32 = u32::MAX;

/// Working memory of a thread for one chunk.
pub(crate) struct ChunkMemory {
    /// For each node [`NodeCost::cost`]; the area of an interior node whose cost is not known yet.
    cost: Vec<f32>,
    /// For each node of known cost [`NodeCost::hits`].
    hits: Vec<f32>,
    primitives: Vec<PrimitiveRange>,
    /// For each node the index of its lane costs and its decision, or [`LEAF`].
    index: Vec<u32>,
    /// Interior nodes.
    interior: Vec<u16>,
    /// Interior nodes that do not become a leaf of one block.
    undecided: Vec<u16>,
    lane_costs: Vec<LaneCosts>,
    decisions: Vec<Decision>,
    /// For each pair of siblings whether its parent lies in the chunk.
    has_parent: Vec<bool>,
}

/// Primitives below a node: slot of the first, and their number or [`PENDING`].
#[derive(Debug, Clone, Copy, Default)]
struct PrimitiveRange {
    first: u32,
    count: u32,
}

impl Default for ChunkMemory {
    fn default() -> Self {
        const NODES: usize = 2 * CHUNK_PAIRS;
        Self {
            cost: vec![0.0; NODES],
            hits: vec![0.0; NODES],
            primitives: vec![PrimitiveRange::default(); NODES],
            index: vec![LEAF; NODES],
            interior: vec![0; NODES],
            undecided: vec![0; NODES],
            // One more for a node that turns out to be a leaf.
            lane_costs: vec![[0.0; WIDTH]; CHUNK_PAIRS + 1],
            decisions: vec![Decision::default(); CHUNK_PAIRS + 1],
            has_parent: vec![false; CHUNK_PAIRS],
        }
    }
}

impl ChunkMemory {
    /// Costs and decisions of `nodes`, which are chunk number `chunk`; the decisions go to `list`. Smaller nodes than `compact_area`
    /// become compact. Hardly any branch depends on the tree, because such branches could not be predicted.
    #[inline(always)]
    pub(crate) fn decide<C: WideContainer, S: Simd>(
        &mut self,
        simd: S,
        nodes: &[Node<C>],
        compact_area: f32,
        chunk: usize,
        list: &mut Vec<Decision>,
    ) -> Boundary {
        let mut boundary = Boundary::default();
        let interior = self.list_interior(nodes);
        let undecided = self.make_blocks(nodes, offset_of(chunk), interior, &mut boundary);
        let used = self.decide_between_node_and_leaf(simd, nodes, compact_area, chunk, undecided);
        let orphans = self.hand_on(nodes, chunk, &mut boundary);
        // With capacity for the decisions of their parents.
        list.reserve_exact(used + orphans);
        list.extend_from_slice(&self.decisions[..used]);
        boundary
    }

    /// Lists the interior nodes and sets all others up as leaves. Returns their number.
    #[inline(always)]
    fn list_interior<C: WideContainer>(&mut self, nodes: &[Node<C>]) -> usize {
        let Self { cost, hits, primitives, index, interior, has_parent, .. } = self;
        let (cost, hits) = (&mut cost[..nodes.len()], &mut hits[..nodes.len()]);
        let primitives = &mut primitives[..nodes.len()];
        index[..nodes.len()].fill(LEAF);
        has_parent.fill(false);
        let mut count = 0;
        for at in 0..nodes.len() {
            let node = &nodes[at];
            let area = node.container.nonempty_area();
            cost[at] = area * block_count(node.count.max(1));
            hits[at] = leaf_hits(area, node.count);
            primitives[at] = PrimitiveRange { first: node.first, count: node.count };
            interior[count] = at as u16;
            count += usize::from(!node.is_leaf());
        }
        count
    }

    /// Bottom-up, makes a leaf of every node whose primitives fit one block where that is cheaper; it mostly is. Returns the number of
    /// nodes for which it is not.
    #[inline(always)]
    #[allow(clippy::needless_bitwise_bool, reason = "without branches")]
    fn make_blocks<C: WideContainer>(
        &mut self,
        nodes: &[Node<C>],
        offset: usize,
        interior_count: usize,
        boundary: &mut Boundary,
    ) -> usize {
        let Self { cost, hits, primitives, index, interior, undecided, has_parent, .. } = self;
        let (cost, hits) = (&cost[..nodes.len()], &mut hits[..nodes.len()]);
        let (primitives, index) = (&mut primitives[..nodes.len()], &mut index[..nodes.len()]);
        let mut undecided_count = 0;
        for &at in interior[..interior_count].iter().rev() {
            let at = usize::from(at);
            let first = (nodes[at].first as usize).wrapping_sub(offset);
            let children = primitives.get(first..first.wrapping_add(2));
            let Some(&[left, right]) = children.filter(|children| children.iter().all(|child| child.count != PENDING))
            else {
                primitives[at].count = PENDING;
                boundary.pending.push((offset + at) as u32);
                continue;
            };
            let sum = left.count + right.count;
            primitives[at] = PrimitiveRange { first: left.first, count: sum };
            has_parent[first / 2] = true;
            let split = cost[at] * NODE_COST + (cost[first] + cost[first + 1]);
            let are_leaves = index[first] & index[first + 1] == LEAF;
            let is_block = are_leaves & (sum <= BLOCK as u32) & (cost[at] <= split);
            index[at] = if is_block { LEAF } else { 0 };
            hits[at] = leaf_hits(cost[at], sum);
            undecided[undecided_count] = at as u16;
            undecided_count += usize::from(!is_block);
        }
        undecided_count
    }

    /// Bottom-up, computes the lane costs of the undecided nodes and decides between node and leaf. Returns the number of nodes.
    #[inline(always)]
    fn decide_between_node_and_leaf<C: WideContainer, S: Simd>(
        &mut self,
        simd: S,
        nodes: &[Node<C>],
        compact_area: f32,
        chunk: usize,
        undecided_count: usize,
    ) -> usize {
        let Self { cost, hits, primitives, index, undecided, lane_costs, decisions, .. } = self;
        let (cost, hits) = (&mut cost[..nodes.len()], &mut hits[..nodes.len()]);
        let (primitives, index) = (&primitives[..nodes.len()], &mut index[..nodes.len()]);
        let mut used = 0;
        for &at in &undecided[..undecided_count] {
            let at = usize::from(at);
            let first_child = nodes[at].first;
            let first = (first_child as usize).wrapping_sub(offset_of(chunk));
            let costs_of = |child: usize| {
                let index = u32x8::splat(simd, index[child]);
                let costs = f32x8::load_array_ref(simd, &lane_costs[index[0] as usize % CHUNK_PAIRS]);
                index.simd_eq(u32x8::splat(simd, LEAF)).select(f32x8::splat(simd, cost[child]), costs)
            };
            let are_leaves = [index[first] == LEAF, index[first + 1] == LEAF];
            let children_costs = [costs_of(first), costs_of(first + 1)];
            let (area, count) = (cost[at], primitives[at].count);
            let collapsed = collapse_cost(simd, area, count, children_costs, are_leaves);
            let children = [first, first + 1].map(|child| decision_of(chunk, index[child], primitives[child]));
            let counts = [primitives[first].count, primitives[first + 1].count];
            let hits_per_cost = [first, first + 1].map(|child| hits_per_cost(hits[child], cost[child]));
            decisions[used] =
                Decision::new(first_child, collapsed.lanes, children, counts, hits_per_cost, area < compact_area);
            let as_node = node_hits(area, [hits[first], hits[first + 1]]);
            hits[at] = if collapsed.is_leaf { leaf_hits(area, count) } else { as_node };
            collapsed.costs.store_slice(&mut lane_costs[used]);
            cost[at] = collapsed.cost;
            index[at] = if collapsed.is_leaf { LEAF } else { used as u32 };
            used += usize::from(!collapsed.is_leaf);
        }
        used
    }

    /// Hands on the pairs whose parents lie in other chunks. Returns their number.
    #[inline(always)]
    fn hand_on<C: WideContainer>(&self, nodes: &[Node<C>], chunk: usize, boundary: &mut Boundary) -> usize {
        let Self { cost, hits, primitives, index, lane_costs, has_parent, .. } = self;
        let without_parent = has_parent[..nodes.len() / 2].iter().enumerate().filter(|(_, has_parent)| !**has_parent);
        let mut orphans = 0;
        for (pair, _) in without_parent {
            orphans += 1;
            for at in [2 * pair, 2 * pair + 1] {
                let PrimitiveRange { first, count } = primitives[at];
                if !nodes[at].is_leaf() && count != PENDING {
                    let decision = decision_of(chunk, index[at], primitives[at]);
                    let node =
                        NodeCost { cost: cost[at], hits: hits[at], first, count, lane_costs: index[at], decision };
                    boundary.add((offset_of(chunk) + at) as u32, node, lane_costs);
                }
            }
        }
        orphans
    }
}

/// Index of the first node of a chunk in the tree, whose node 0 is the root.
const fn offset_of(chunk: usize) -> usize {
    1 + 2 * CHUNK_PAIRS * chunk
}

/// The decision about a node of `chunk`: a leaf, or by the index of its decision there.
#[inline(always)]
fn decision_of(chunk: usize, index: u32, primitives: PrimitiveRange) -> DecisionRef {
    if index == LEAF { DecisionRef::leaf(primitives.first) } else { DecisionRef::decision(chunk, index as usize) }
}
