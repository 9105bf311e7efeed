//! The cheapest decision for each node of the binary tree. The pass runs backwards over the nodes as they lie in memory,
//! children before parents, chunk by chunk on all threads. Only the chunk in progress stores its costs, which fit a core's
//! second-level cache. Nodes whose children lie in other chunks follow later: first those of a group of chunks, then those
//! of the whole tree.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Simd, SimdBase};

use crate::cancel::{CancelToken, Cancelled, HEAVY_STEPS};
use crate::kernel::SimdLevel;
use crate::kernel::parallel::par_tasks_with;
use crate::kernel::simd::dispatch_plain;
use crate::tree::Tree;
use crate::wide::bounds::WideContainer;
use crate::wide::collapse::boundary::{Boundary, LEAF, NodeCost};
use crate::wide::collapse::chunk::{CHUNK_PAIRS, ChunkMemory};
use crate::wide::collapse::cost::{LaneCosts, collapse_cost};
use crate::wide::collapse::decision::{DecidedNode, Decision, DecisionRef, Decisions};
use crate::wide::collapse::visit_order::{hits_per_cost, leaf_hits, node_hits};

/// Maximum number of chunks that one thread joins into a group: enough to leave little for the last, sequential join.
const MAX_GROUP_CHUNKS: usize = 16;
/// Number of groups below which groups get smaller than [`MAX_GROUP_CHUNKS`].
const MIN_GROUPS: usize = 32;
/// The optimal decisions for a tree, which must not be empty. Nodes of less than `compact_area` become compact.
pub(crate) fn optimal_decisions<C: WideContainer>(
    tree: &Tree<C>,
    compact_area: f32,
    token: &CancelToken,
) -> Result<Decisions, Cancelled> {
    let chunk_count = (tree.nodes.len() / 2).div_ceil(CHUNK_PAIRS);
    let mut chunks = vec![Vec::new(); chunk_count];
    let level = SimdLevel::of_builds().level();
    let group = (chunk_count / MIN_GROUPS).clamp(1, MAX_GROUP_CHUNKS);
    let groups = chunks.chunks_mut(group).enumerate();
    let boundaries = par_tasks_with(groups, token, ChunkMemory::default, |scratch, (index, chunks), token| {
        let mut range = ChunkRange { tree, compact_area, first_chunk: group * index, chunks };
        dispatch_plain!(level, simd => range.decide(simd, scratch, token))
    })?;
    let root = NodeCost::leaf(&tree.nodes[0]);
    if tree.nodes[0].is_leaf() {
        return Ok(Decisions { chunks, root: DecidedNode::new(0, root.decision, root.count) });
    }
    let mut whole = ChunkRange { tree, compact_area, first_chunk: 0, chunks: &mut chunks };
    let boundary = dispatch_plain!(level, simd => whole.join(simd, &boundaries, Some(0), token))?;
    let [(0, root), ..] = boundary.roots[..] else { unreachable!("the root has no parent and the lowest index") };
    Ok(Decisions { chunks, root: DecidedNode::new(0, root.decision, root.count) })
}

/// Consecutive chunks of nodes, and the decisions of their pairs' parents, chunk by chunk.
struct ChunkRange<'a, C> {
    tree: &'a Tree<C>,
    /// Area below which nodes become compact.
    compact_area: f32,
    first_chunk: usize,
    chunks: &'a mut [Vec<Decision>],
}

impl<C: WideContainer> ChunkRange<'_, C> {
    /// Decides all nodes whose descendants lie in the range.
    #[inline(always)]
    fn decide<S: Simd>(
        &mut self,
        simd: S,
        scratch: &mut ChunkMemory,
        token: &CancelToken,
    ) -> Result<Boundary, Cancelled> {
        let mut boundaries = Vec::with_capacity(MAX_GROUP_CHUNKS);
        let nodes = &self.tree.nodes[1..];
        for (list, chunk) in self.chunks.iter_mut().zip(self.first_chunk..) {
            token.check()?;
            let first = 2 * CHUNK_PAIRS * chunk;
            let chunk_nodes = &nodes[first..nodes.len().min(first + 2 * CHUNK_PAIRS)];
            boundaries.push(scratch.decide(simd, chunk_nodes, self.compact_area, chunk, list));
        }
        if let [_] = boundaries[..] { Ok(boundaries.remove(0)) } else { self.join(simd, &boundaries, None, token) }
    }

    /// Decides the nodes that were pending in single chunks or groups, then `root`.
    #[inline(always)]
    #[expect(clippy::too_many_lines, reason = "the steps of one pass over pending nodes")]
    fn join<S: Simd>(
        &mut self,
        simd: S,
        boundaries: &[Boundary],
        root: Option<u32>,
        token: &CancelToken,
    ) -> Result<Boundary, Cancelled> {
        let nodes = &self.tree.nodes;
        let mut lane_costs: Vec<LaneCosts> = Vec::new();
        let first_pair = self.first_chunk * CHUNK_PAIRS;
        let chunk_of = |node: u32| (node as usize - 1) / 2 / CHUNK_PAIRS - self.first_chunk;
        // For each chunk in descending order: the roots of the boundaries, then the nodes decided here.
        let mut costed: Vec<Vec<CostedNode>> = vec![Vec::new(); self.chunks.len()];
        for boundary in boundaries {
            token.check()?;
            let before = lane_costs.len() as u32;
            lane_costs.extend_from_slice(&boundary.lane_costs);
            for &(node, cost) in boundary.roots.iter().rev() {
                let lane_costs = cost.lane_costs.saturating_add(before);
                costed[chunk_of(node)].push(CostedNode { node, cost: NodeCost { lane_costs, ..cost }, is_root: true });
            }
        }
        let root_counts: Vec<usize> = costed.iter().map(Vec::len).collect();
        let mut joined = Boundary::default();
        let pending = boundaries.iter().rev().flat_map(|boundary| boundary.pending.iter().copied()).chain(root);
        for (count, at) in pending.enumerate() {
            token.check_every(HEAVY_STEPS, count)?;
            let first = nodes[at as usize].first;
            let in_range =
                (first as usize / 2).checked_sub(first_pair).is_some_and(|pair| pair < CHUNK_PAIRS * costed.len());
            let chunk = if in_range { chunk_of(first) } else { costed.len() };
            let position = |node: u32| {
                let (roots, decided) = costed[chunk].split_at(root_counts[chunk]);
                let find = |list: &[CostedNode]| list.binary_search_by(|costed| node.cmp(&costed.node)).ok();
                find(roots).or_else(|| find(decided).map(|position| roots.len() + position))
            };
            let child = |node: u32| match &nodes[node as usize] {
                _ if !in_range => None,
                leaf if leaf.is_leaf() => Some((NodeCost::leaf(leaf), None)),
                _ => position(node).map(|position| (costed[chunk][position].cost, Some(position))),
            };
            let (Some((left, left_position)), Some((right, right_position))) = (child(first), child(first + 1)) else {
                joined.pending.push(at);
                continue;
            };
            for position in [left_position, right_position].into_iter().flatten() {
                costed[chunk][position].is_root = false;
            }
            let (area, primitives) = (nodes[at as usize].container.nonempty_area(), left.count + right.count);
            let children_costs = [left.lane_costs(simd, &lane_costs), right.lane_costs(simd, &lane_costs)];
            let are_leaves = [left.lane_costs == LEAF, right.lane_costs == LEAF];
            let collapsed = collapse_cost(simd, area, primitives, children_costs, are_leaves);
            let decision = DecisionRef::leaf(left.first);
            let hits =
                if collapsed.is_leaf { leaf_hits(area, primitives) } else { node_hits(area, [left.hits, right.hits]) };
            let (cost, first_slot) = (collapsed.cost, left.first);
            let mut node = NodeCost { cost, hits, first: first_slot, count: primitives, lane_costs: LEAF, decision };
            if !collapsed.is_leaf {
                let list = &mut self.chunks[chunk];
                node.lane_costs = lane_costs.len() as u32;
                node.decision = DecisionRef::decision(self.first_chunk + chunk, list.len());
                let (children, counts) = ([left.decision, right.decision], [left.count, right.count]);
                let hits_per_cost = [left, right].map(|child| hits_per_cost(child.hits, child.cost));
                let is_compact = area < self.compact_area;
                list.push(Decision::new(first, collapsed.lanes, children, counts, hits_per_cost, is_compact));
                lane_costs.push(collapsed.costs.to_array());
            }
            if at == 0 {
                joined.add(at, node, &lane_costs);
            } else {
                costed[chunk_of(at)].push(CostedNode { node: at, cost: node, is_root: true });
            }
        }
        for mut chunk in costed {
            token.check()?;
            chunk.retain(|costed| costed.is_root);
            chunk.sort_unstable_by_key(|costed| costed.node);
            for CostedNode { node, cost, .. } in chunk {
                joined.add(node, cost, &lane_costs);
            }
        }
        Ok(joined)
    }
}

/// A node of known cost while chunks are joined.
#[derive(Clone)]
struct CostedNode {
    node: u32,
    cost: NodeCost,
    /// Whether its parent is still undecided.
    is_root: bool,
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use glam::Vec3;

    use super::*;
    use crate::geometry::Aabb;
    use crate::tree::Node;
    use crate::wide::collapse::cost::{MAX_LEAF_SIZE, NODE_COST, block_count};
    use crate::wide::layout::WIDTH;

    /// A tree over `leaves` points near a line, of up to three primitives each, split at random positions. Breadth first, most
    /// nodes have children in other chunks; depth first, few have.
    fn tree(leaves: usize, breadth_first: bool) -> Tree<Aabb> {
        let mut state = 7_u32;
        let mut random = |below: usize| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as usize % below
        };
        let starts: Vec<u32> =
            (0..=leaves).scan(0, |sum, _| Some(std::mem::replace(sum, *sum + 1 + random(3) as u32))).collect();
        let points: Vec<Vec3> =
            (0..leaves).map(|at| Vec3::new(at as f32, random(40) as f32, random(9) as f32)).collect();
        let mut nodes = vec![Node { container: Aabb::EMPTY, first: 0, count: 0 }];
        let mut open = std::collections::VecDeque::from([(0, 0..leaves)]);
        while let Some((at, range)) = if breadth_first { open.pop_front() } else { open.pop_back() } {
            for point in &points[range.clone()] {
                nodes[at].container = nodes[at].container.union(&Aabb { min: *point, max: *point + 1.0 });
            }
            if range.len() == 1 {
                (nodes[at].first, nodes[at].count) = (starts[range.start], starts[range.end] - starts[range.start]);
                continue;
            }
            let (first, middle) = (nodes.len(), range.start + 1 + random(range.len() - 1));
            nodes[at].first = first as u32;
            nodes.extend([nodes[0]; 2].map(|node| Node { container: Aabb::EMPTY, ..node }));
            open.extend([(first, range.start..middle), (first + 1, middle..range.end)]);
        }
        Tree { nodes, primitive_indices: (0..starts[leaves]).collect(), max_depth: 0 }
    }

    /// Least cost of a node with at most one to eight lanes, by definition, and its number of primitives.
    fn least_costs(tree: &Tree<Aabb>, at: u32) -> ([f32; WIDTH], u32) {
        let node = &tree.nodes[at as usize];
        let area = node.container.half_area();
        if node.is_leaf() {
            return ([area * block_count(node.count); WIDTH], node.count);
        }
        let ((left, left_count), (right, right_count)) =
            (least_costs(tree, node.first), least_costs(tree, node.first + 1));
        let count = left_count + right_count;
        let distributed = |lanes: usize| {
            (1..lanes)
                .map(|left_lanes| left[left_lanes - 1] + right[lanes - left_lanes - 1])
                .fold(f32::INFINITY, f32::min)
        };
        let leaf = if count <= MAX_LEAF_SIZE { area * block_count(count) } else { f32::INFINITY };
        let node = area * NODE_COST + distributed(WIDTH);
        // A leaf takes one lane, however many there are.
        (if leaf <= node { [leaf; WIDTH] } else { std::array::from_fn(|lane| node.min(distributed(lane + 1))) }, count)
    }

    /// Cost of the decisions below a node that takes at most `lanes`.
    fn decided_cost(tree: &Tree<Aabb>, decisions: &Decisions, decided: DecidedNode, lanes: u32) -> f32 {
        let node = &tree.nodes[decided.node as usize];
        let area = node.container.half_area();
        if decided.decision.is_leaf() {
            let (first, count) = primitives(tree, decided.node);
            assert_eq!(
                (decided.decision.first(), decided.primitives(|node| tree.nodes[node as usize].count)),
                (first, count)
            );
            return area * block_count(count);
        }
        let decision = decisions.get(decided.decision);
        assert_eq!(decision.first_child, node.first);
        match decision.left_lanes(lanes) {
            0 => area * NODE_COST + decided_cost(tree, decisions, decided, WIDTH as u32),
            left => {
                assert!(left < lanes);
                let [first, second] = decision.children();
                decided_cost(tree, decisions, first, left) + decided_cost(tree, decisions, second, lanes - left)
            }
        }
    }

    /// The first slot below a node, and the number of primitives.
    fn primitives(tree: &Tree<Aabb>, at: u32) -> (u32, u32) {
        let node = &tree.nodes[at as usize];
        if node.is_leaf() {
            return (node.first, node.count);
        }
        let [(first, left), (_, right)] = [0, 1].map(|side| primitives(tree, node.first + side));
        (first, left + right)
    }

    /// Area times share of rays that hit something below a node, by definition. Asserts for each node below that its hits per cost
    /// are known to its parent, within what 16 bits hold.
    fn expected_hits(tree: &Tree<Aabb>, decisions: &Decisions, decided: DecidedNode) -> f32 {
        let area = tree.nodes[decided.node as usize].container.half_area();
        if decided.decision.is_leaf() {
            let count = primitives(tree, decided.node).1 as f32;
            return area * count / (count + 2.0);
        }
        let shares = decisions.get(decided.decision).children().map(|child| {
            let hits = expected_hits(tree, decisions, child);
            let expected = hits / decided_cost(tree, decisions, child, 1);
            let known = f32::from_bits(u32::from(child.hits_per_cost) << 16);
            assert!((known - expected).abs() <= expected * 0.01, "{known}, not {expected}");
            hits / area
        });
        area * (1.0 - (1.0 - shares[0]) * (1.0 - shares[1]))
    }

    #[test]
    fn decisions_are_optimal_in_any_node_order() {
        for (leaves, breadth_first) in
            [(1, true), (2, true), (9, false), (4 * CHUNK_PAIRS, true), (9 * CHUNK_PAIRS + 5, false)]
        {
            let tree = tree(leaves, breadth_first);
            let compact_area = tree.nodes[0].container.half_area() / 100.0;
            let decisions = optimal_decisions(&tree, compact_area, &CancelToken::new()).expect("never cancelled");
            let interior = tree.nodes.iter().filter(|node| !node.is_leaf());
            let areas: HashMap<u32, f32> = interior.map(|node| (node.first, node.container.half_area())).collect();
            for decision in decisions.chunks.iter().flatten() {
                let area = areas[&decision.first_child];
                assert_eq!(decision.is_compact(), area < compact_area, "{decision:?} of area {area}");
            }
            let hits = expected_hits(&tree, &decisions, decisions.root);
            assert!(hits <= tree.nodes[0].container.half_area());
            for (lanes, cost) in (1..).zip(least_costs(&tree, 0).0) {
                let decided = decided_cost(&tree, &decisions, decisions.root, lanes);
                assert!(
                    (decided - cost).abs() <= cost * 1e-5,
                    "{leaves} leaves, {lanes} lanes: {decided}, at best {cost}"
                );
            }
        }
    }
}
