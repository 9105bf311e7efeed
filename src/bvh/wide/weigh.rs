//! The cheapest choice for each node of the binary tree. Nodes are weighed backwards as they lie in memory, children before
//! parents, chunk by chunk on all threads. Only a chunk in hand has its costs, which fit a core's second cache. Nodes whose
//! children lie in other chunks come after them: first those of a group of chunks, then those of all groups.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Simd, dispatch};
use rayon::prelude::*;

use super::choice::{Choice, Link, pair_of};
use super::cost::{Below, Costs, Known, SAME, WAITS, blocks_of, weigh};
use super::{WIDTH, WideContainer};
use crate::bvh::cluster::simd_level;
use crate::bvh::lists::zeros;
use crate::bvh::{Node, Tree};
use crate::cancel::{CancelToken, Cancelled};

/// Pairs of siblings that are weighed at once.
const CHUNK: usize = 4096;
/// So many chunks at most are joined by one thread, which leaves little to join for the last one; fewer where there would be
/// no more than so many groups.
const MAX_GROUP: usize = 16;
const GROUPS: usize = 32;
/// Nodes between two looks at the token while one thread weighs them.
const BETWEEN_CHECKS: usize = 1 << 12;

/// The choices for all interior nodes, each where [`Link::pair`] says.
pub(super) fn choices<C: WideContainer>(tree: &Tree<C>, token: &CancelToken) -> Result<Vec<Choice>, Cancelled> {
    let pairs = tree.nodes.len() / 2;
    let mut choices: Vec<Choice> = zeros(pairs, token)?;
    let level = simd_level();
    let group = (pairs / CHUNK / GROUPS).clamp(1, MAX_GROUP) * CHUNK;
    let groups = choices.par_chunks_mut(group).enumerate();
    let rests = groups.map_init(Room::default, |room, (at, choices)| {
        let mut part = Part { tree, offset: 1 + 2 * group * at, choices };
        dispatch!(level, simd => part.weigh(simd, room, token))
    });
    let rests: Vec<Rest> = rests.collect::<Result<_, Cancelled>>()?;
    let root = (!tree.nodes.is_empty() && !tree.nodes[0].is_leaf()).then_some(0);
    let mut whole = Part { tree, offset: 1, choices: &mut choices };
    dispatch!(level, simd => whole.join(simd, &rests, root, token))?;
    Ok(choices)
}

/// Where a thread weighs a chunk.
struct Room {
    /// For each node [`Known::cost`]; of an interior one that is not known yet, the area.
    cost: Vec<f32>,
    /// For each interior node.
    below: Vec<Below>,
    interior: Vec<u32>,
    costs: Vec<Costs>,
}

/// What a chunk leaves.
#[derive(Default)]
struct Rest {
    /// Interior nodes that are known, but not to parents within the chunk.
    ends: Vec<(u32, Known)>,
    costs: Vec<Costs>,
    /// Those that wait for others, from the last to the first.
    waiting: Vec<u32>,
}

impl Rest {
    /// Adds an end, whose costs are in a list.
    fn add(&mut self, node: u32, mut known: Known, costs: &[Costs]) {
        if known.below.costs != SAME {
            self.costs.push(costs[known.below.costs as usize]);
            known.below.costs = self.costs.len() as u32 - 1;
        }
        self.ends.push((node, known));
    }
}

impl Default for Room {
    fn default() -> Self {
        const NODES: usize = 2 * CHUNK;
        Self {
            cost: vec![0.0; NODES],
            below: vec![Below::default(); NODES],
            interior: vec![0; NODES],
            costs: vec![[0.0; WIDTH]; NODES + 1],
        }
    }
}

/// Neighbours in the list of nodes, and the choices of those pairs.
struct Part<'a, C> {
    tree: &'a Tree<C>,
    /// Number of its first node.
    offset: usize,
    choices: &'a mut [Choice],
}

impl<C: WideContainer> Part<'_, C> {
    /// Weighs all nodes that have everything below them in the part.
    #[inline(always)]
    fn weigh<S: Simd>(&mut self, simd: S, room: &mut Room, token: &CancelToken) -> Result<Rest, Cancelled> {
        let mut rests = Vec::with_capacity(MAX_GROUP);
        for (choices, at) in self.choices.chunks_mut(CHUNK).zip(0..) {
            token.check()?;
            let offset = self.offset + 2 * CHUNK * at;
            rests.push(room.weigh(simd, &self.tree.nodes[offset..offset + 2 * choices.len()], offset, choices));
        }
        if let [_] = rests[..] { Ok(rests.remove(0)) } else { self.join(simd, &rests, None, token) }
    }

    /// Weighs what waited for other chunks or groups of them, then `root`.
    #[inline(always)]
    fn join<S: Simd>(
        &mut self,
        simd: S,
        rests: &[Rest],
        root: Option<u32>,
        token: &CancelToken,
    ) -> Result<Rest, Cancelled> {
        let Self { tree, offset, choices } = self;
        // Whether they lie within the part is for the list of choices to tell.
        let pair_below = |node: &Node<C>| pair_of(node.first).wrapping_sub(*offset / 2);
        let ends = rests.iter().map(|rest| rest.ends.len()).sum::<usize>();
        let (mut list, mut costs) = (Vec::with_capacity(2 * ends), Vec::with_capacity(2 * ends));
        for rest in rests {
            token.check()?;
            let before = costs.len() as u32;
            costs.extend_from_slice(&rest.costs);
            for &(node, mut known) in &rest.ends {
                known.below.costs += if known.below.costs == SAME { 0 } else { before };
                let pair = pair_below(&tree.nodes[node as usize]);
                let choice = std::mem::replace(&mut choices[pair], Choice::listed(list.len()));
                list.push(Listed { node, known, choice, is_end: true });
            }
        }
        let mut joined = Rest::default();
        let waiting = rests.iter().rev().flat_map(|rest| rest.waiting.iter().copied()).chain(root);
        for (count, at) in waiting.enumerate() {
            if count.is_multiple_of(BETWEEN_CHECKS) {
                token.check()?;
            }
            let node = &tree.nodes[at as usize];
            let children = [&tree.nodes[node.first as usize], &tree.nodes[node.first as usize + 1]];
            // Where the children are in the list.
            let places = children.map(|child| choices.get(pair_below(child)).and_then(|choice| choice.place()));
            let known = |side: usize| match children[side] {
                child if child.is_leaf() => Some(Known::leaf(child)),
                _ => Some(list[places[side]?].known),
            };
            let pair = pair_below(node);
            let (Some(left), Some(right), true) = (known(0), known(1), pair < choices.len()) else {
                joined.waiting.push(at);
                continue;
            };
            for (child, place) in children.iter().zip(places) {
                if let (false, Some(place)) = (child.is_leaf(), place) {
                    list[place].is_end = false;
                }
            }
            costs.push([0.0; WIDTH]);
            let place = costs.len() - 1;
            let (known, lanes) = weigh(simd, node.container.wide_area(), &left, &right, &mut costs, place);
            choices[pair] = Choice::listed(list.len());
            list.push(Listed {
                node: at,
                known,
                choice: Choice { links: children.map(Link::new), first: known.below.first, lanes },
                is_end: true,
            });
        }
        for (count, Listed { node, known, choice, is_end }) in list.into_iter().enumerate() {
            if count.is_multiple_of(BETWEEN_CHECKS) {
                token.check()?;
            }
            choices[pair_below(&tree.nodes[node as usize])] = choice;
            if is_end {
                joined.add(node, known, &costs);
            }
        }
        Ok(joined)
    }
}

/// A node that is known before all of its neighbours are.
struct Listed {
    node: u32,
    known: Known,
    choice: Choice,
    /// Whether its parent is not known.
    is_end: bool,
}

impl Room {
    /// Weighs `nodes`, which are a chunk and begin with number `offset`.
    #[inline(always)]
    fn weigh<C: WideContainer, S: Simd>(
        &mut self,
        simd: S,
        nodes: &[Node<C>],
        offset: usize,
        choices: &mut [Choice],
    ) -> Rest {
        let mut rest = Rest::default();
        let Self { cost, below, interior, costs } = self;
        let (cost, below) = (&mut cost[..nodes.len()], &mut below[..nodes.len()]);
        let interior = &mut interior[..nodes.len()];
        // No branches that depend on what is a leaf.
        let mut count = 0;
        for at in 0..nodes.len() {
            let node = &nodes[at];
            cost[at] = node.container.wide_area() * blocks_of(node.count.max(1));
            interior[count] = at as u32;
            count += usize::from(!node.is_leaf());
        }
        let mut used = 0;
        for &at in interior[..count].iter().rev() {
            let at = at as usize;
            let first = (nodes[at].first as usize).wrapping_sub(offset);
            let known = |child: usize| {
                let node = &nodes[child];
                Known { cost: cost[child], below: if node.is_leaf() { Below::leaf(node) } else { below[child] } }
            };
            let children = (first < nodes.len()).then(|| [known(first), known(first + 1)]);
            let Some([left, right]) = children.filter(|[a, b]| a.below.costs.max(b.below.costs) != WAITS) else {
                below[at].costs = WAITS;
                rest.waiting.push((offset + at) as u32);
                continue;
            };
            let (known, lanes) = weigh(simd, cost[at], &left, &right, costs, used);
            (cost[at], below[at]) = (known.cost, known.below);
            used += usize::from(known.below.costs != SAME);
            let links = [Link::new(&nodes[first]), Link::new(&nodes[first + 1])];
            choices[first / 2] = Choice { links, first: known.below.first, lanes };
        }
        // Pairs to which no parent within the chunk has made a choice.
        for (pair, _) in choices.iter().enumerate().filter(|(_, choice)| choice.lanes == 0) {
            for at in [2 * pair, 2 * pair + 1] {
                if !nodes[at].is_leaf() && below[at].costs != WAITS {
                    rest.add((offset + at) as u32, Known { cost: cost[at], below: below[at] }, costs);
                }
            }
        }
        rest
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::bvh::wide::cost::{MAX_LEAF, NODE_COST};
    use crate::geometry::Aabb;

    /// A tree over `leaves` points near a line, of up to three primitives each, halved at chance places; its nodes breadth first,
    /// so that most wait for those of other chunks, or depth first.
    fn tree(leaves: usize, breadth_first: bool) -> Tree<Aabb> {
        let mut state = 7_u32;
        let mut chance = |below: usize| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as usize % below
        };
        let starts: Vec<u32> =
            (0..=leaves).scan(0, |sum, _| Some(std::mem::replace(sum, *sum + 1 + chance(3) as u32))).collect();
        let points: Vec<Vec3> =
            (0..leaves).map(|at| Vec3::new(at as f32, chance(40) as f32, chance(9) as f32)).collect();
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
            let (first, middle) = (nodes.len(), range.start + 1 + chance(range.len() - 1));
            nodes[at].first = first as u32;
            nodes.extend([nodes[0]; 2].map(|node| Node { container: Aabb::EMPTY, ..node }));
            open.extend([(first, range.start..middle), (first + 1, middle..range.end)]);
        }
        Tree { nodes, primitive_indices: (0..starts[leaves]).collect(), max_depth: 0 }
    }

    /// What a node costs at best with at most one, two, up to eight lanes, and its primitives: by the definition.
    fn least(tree: &Tree<Aabb>, at: u32) -> ([f32; WIDTH], u32) {
        let node = &tree.nodes[at as usize];
        let area = node.container.half_area();
        if node.is_leaf() {
            return ([area * blocks_of(node.count); WIDTH], node.count);
        }
        let ((left, of_left), (right, of_right)) = (least(tree, node.first), least(tree, node.first + 1));
        let count = of_left + of_right;
        let shared = |lanes: usize| {
            (1..lanes).map(|of_left| left[of_left - 1] + right[lanes - of_left - 1]).fold(f32::INFINITY, f32::min)
        };
        let leaf = if count <= MAX_LEAF { area * blocks_of(count) } else { f32::INFINITY };
        let node = area * NODE_COST + shared(WIDTH);
        // A leaf stays one, however many lanes there are.
        (if leaf <= node { [leaf; WIDTH] } else { std::array::from_fn(|lane| node.min(shared(lane + 1))) }, count)
    }

    /// What the choices cost.
    fn chosen(tree: &Tree<Aabb>, choices: &[Choice], at: u32, lanes: u32) -> f32 {
        let node = &tree.nodes[at as usize];
        let area = node.container.half_area();
        let link = Link::new(node);
        if link.is_leaf() {
            return area * blocks_of(node.count);
        }
        let choice = choices[link.pair()];
        assert!(choice.links == [0, 1].map(|side| Link::new(&tree.nodes[node.first as usize + side])));
        let (_, count) = choice.leaf();
        if count > 0 {
            return area * blocks_of(count);
        }
        match choice.left_of(lanes) {
            0 => area * NODE_COST + chosen(tree, choices, at, WIDTH as u32),
            left => {
                assert!(left < lanes);
                chosen(tree, choices, node.first, left) + chosen(tree, choices, node.first + 1, lanes - left)
            }
        }
    }

    #[test]
    fn the_choices_cost_least_in_whatever_order_nodes_lie() {
        for (leaves, breadth_first) in [(1, true), (2, true), (9, false), (4 * CHUNK, true), (9 * CHUNK + 5, false)] {
            let tree = tree(leaves, breadth_first);
            let Ok(choices) = choices(&tree, &CancelToken::new()) else { panic!("nobody cancels") };
            for (lanes, cost) in (1..).zip(least(&tree, 0).0) {
                let chosen = chosen(&tree, &choices, 0, lanes);
                assert!(
                    (chosen - cost).abs() <= cost * 1e-5,
                    "{leaves} leaves, {lanes} lanes: {chosen}, at best {cost}"
                );
            }
        }
    }
}
