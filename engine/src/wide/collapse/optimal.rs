//! The cheapest choice for each node of the binary tree. Nodes are weighed backwards as they lie in memory, children before
//! parents, chunk by chunk on all threads. Only a chunk in hand has its costs, which fit a core's second cache. Nodes whose
//! children lie in other chunks come after them: first those of a group of chunks, then those of all groups.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Select, Simd, SimdBase, dispatch, f32x8, u32x8};
use rayon::prelude::*;

use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::simd::simd_level;
use crate::tree::{Node, Tree};
use crate::wide::bounds::WideContainer;
use crate::wide::collapse::cost::{Costs, NODE_COST, blocks_of, weigh};
use crate::wide::collapse::decision::{Branch, Choice, Choices, LISTED, Link};
use crate::wide::layout::BLOCK;
use crate::wide::layout::WIDTH;

/// Pairs of siblings that are weighed at once. The choices of their parents are a list.
const CHUNK: usize = LISTED;
/// So many chunks at most are joined by one thread, which leaves little to join for the last one; fewer where there would be
/// no more than so many groups.
const MAX_GROUP: usize = 16;
const GROUPS: usize = 32;
/// Nodes between two looks at the token while one thread weighs them.
const BETWEEN_CHECKS: usize = 1 << 12;

/// The choices for all nodes of a tree that has some.
pub(crate) fn choices<C: WideContainer>(tree: &Tree<C>, token: &CancelToken) -> Result<Choices, Cancelled> {
    let chunks = (tree.nodes.len() / 2).div_ceil(CHUNK);
    let mut lists = vec![Vec::new(); chunks];
    let level = simd_level();
    let group = (chunks / GROUPS).clamp(1, MAX_GROUP);
    let groups = lists.par_chunks_mut(group).enumerate();
    let rests = groups.map_init(Room::default, |room, (at, lists)| {
        let mut part = Part { tree, first_list: group * at, lists };
        dispatch!(level, simd => part.weigh(simd, room, token))
    });
    let rests: Vec<Rest> = rests.collect::<Result<_, Cancelled>>()?;
    let root = Known::leaf(&tree.nodes[0]);
    if tree.nodes[0].is_leaf() {
        return Ok(Choices { lists, root: Branch::new(0, root.link, root.count) });
    }
    let mut whole = Part { tree, first_list: 0, lists: &mut lists };
    let rest = dispatch!(level, simd => whole.join(simd, &rests, Some(0), token))?;
    let [(0, root), ..] = rest.ends[..] else { unreachable!("it is the first that is known without a parent") };
    Ok(Choices { lists, root: Branch::new(0, root.link, root.count) })
}

/// What is known of a node from what lies below.
#[derive(Debug, Clone, Copy)]
struct Known {
    /// Surface area times cost, summed over everything, where it takes one lane.
    cost: f32,
    /// Slot of the first primitive below, and how many there are.
    first: u32,
    count: u32,
    /// Where in a list its costs are, if it does not become a leaf.
    costs: u32,
    link: Link,
}

impl Known {
    fn leaf<C: WideContainer>(node: &Node<C>) -> Self {
        let Node { container, first, count } = node;
        let cost = container.wide_area() * blocks_of(*count);
        Self { cost, first: *first, count: *count, costs: LEAF, link: Link::leaf(*first) }
    }

    /// What it costs with one to eight lanes.
    #[inline(always)]
    fn costs<S: Simd>(&self, simd: S, list: &[Costs]) -> f32x8<S> {
        let same = [self.cost; WIDTH];
        f32x8::load_array_ref(simd, list.get(self.costs as usize).unwrap_or(&same))
    }
}

/// Stands for the costs of a leaf, the same for any number of lanes.
const LEAF: u32 = u32::MAX;
/// Stands for the number of primitives below a node of which nothing is known yet. It stays the same whatever is added.
const WAITS: u32 = u32::MAX;

/// Where a thread weighs a chunk.
struct Room {
    /// For each node [`Known::cost`]; of an interior one that is not known yet, the area.
    cost: Vec<f32>,
    below: Vec<Below>,
    /// For each node where its costs and its choice are, or [`LEAF`].
    place: Vec<u32>,
    /// Interior nodes, and those of them that do not fit a block.
    interior: Vec<u16>,
    others: Vec<u16>,
    costs: Vec<Costs>,
    choices: Vec<Choice>,
    /// Whether the parent of a pair has been seen.
    has_parent: Vec<bool>,
}

/// What lies below a node: slot of the first primitive, and how many there are.
#[derive(Debug, Clone, Copy, Default)]
struct Below {
    first: u32,
    count: u32,
}

/// What a chunk or a group of chunks leaves.
#[derive(Default)]
struct Rest {
    /// Interior nodes that are known, but not to parents within it, from the first to the last.
    ends: Vec<(u32, Known)>,
    costs: Vec<Costs>,
    /// Those that wait for others, from the last to the first.
    waiting: Vec<u32>,
}

impl Rest {
    /// Adds an end, whose costs are in a list.
    fn add(&mut self, node: u32, mut known: Known, costs: &[Costs]) {
        if known.costs != LEAF {
            self.costs.push(costs[known.costs as usize]);
            known.costs = self.costs.len() as u32 - 1;
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
            place: vec![LEAF; NODES],
            interior: vec![0; NODES],
            others: vec![0; NODES],
            // One more for what turns out to be a leaf.
            costs: vec![[0.0; WIDTH]; CHUNK + 1],
            choices: vec![Choice::default(); CHUNK + 1],
            has_parent: vec![false; CHUNK],
        }
    }
}

/// Neighbours in the list of nodes, and the choices of their parents: a list for each chunk.
struct Part<'a, C> {
    tree: &'a Tree<C>,
    first_list: usize,
    lists: &'a mut [Vec<Choice>],
}

impl<C: WideContainer> Part<'_, C> {
    /// Weighs all nodes that have everything below them in the part.
    #[inline(always)]
    fn weigh<S: Simd>(&mut self, simd: S, room: &mut Room, token: &CancelToken) -> Result<Rest, Cancelled> {
        let mut rests = Vec::with_capacity(MAX_GROUP);
        let nodes = &self.tree.nodes[1..];
        for (list, at) in self.lists.iter_mut().zip(self.first_list..) {
            token.check()?;
            let first = 2 * CHUNK * at;
            let chunk = &nodes[first..nodes.len().min(first + 2 * CHUNK)];
            rests.push(room.weigh(simd, chunk, at, list));
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
        let nodes = &self.tree.nodes;
        let mut costs: Vec<Costs> = Vec::new();
        let first_pair = self.first_list * CHUNK;
        let chunk_of = |node: u32| (node as usize - 1) / 2 / CHUNK - self.first_list;
        // For each chunk, from the last one to the first; then, in the same order, those that become known here.
        let mut known: Vec<Vec<Listed>> = vec![Vec::new(); self.lists.len()];
        for rest in rests {
            token.check()?;
            let before = costs.len() as u32;
            costs.extend_from_slice(&rest.costs);
            for &(node, end) in rest.ends.iter().rev() {
                let costs = end.costs.saturating_add(before);
                known[chunk_of(node)].push(Listed { node, known: Known { costs, ..end }, is_end: true });
            }
        }
        let ends: Vec<usize> = known.iter().map(Vec::len).collect();
        let mut joined = Rest::default();
        let waiting = rests.iter().rev().flat_map(|rest| rest.waiting.iter().copied()).chain(root);
        for (count, at) in waiting.enumerate() {
            if count.is_multiple_of(BETWEEN_CHECKS) {
                token.check()?;
            }
            let first = nodes[at as usize].first;
            let in_part = (first as usize / 2).checked_sub(first_pair).is_some_and(|pair| pair < CHUNK * known.len());
            let list = if in_part { chunk_of(first) } else { known.len() };
            let place = |node: u32| {
                let (ends, more) = known[list].split_at(ends[list]);
                let find = |list: &[Listed]| list.binary_search_by(|listed| node.cmp(&listed.node)).ok();
                find(ends).or_else(|| find(more).map(|place| ends.len() + place))
            };
            let side = |node: u32| match &nodes[node as usize] {
                _ if !in_part => None,
                leaf if leaf.is_leaf() => Some((Known::leaf(leaf), None)),
                _ => place(node).map(|place| (known[list][place].known, Some(place))),
            };
            let (Some((left, left_place)), Some((right, right_place))) = (side(first), side(first + 1)) else {
                joined.waiting.push(at);
                continue;
            };
            for place in [left_place, right_place].into_iter().flatten() {
                known[list][place].is_end = false;
            }
            let (area, primitives) = (nodes[at as usize].container.wide_area(), left.count + right.count);
            let costs_of = [left.costs(simd, &costs), right.costs(simd, &costs)];
            let weighed = weigh(simd, area, primitives, costs_of, [left.costs == LEAF, right.costs == LEAF]);
            let link = Link::leaf(left.first);
            let mut node = Known { cost: weighed.cost, first: left.first, count: primitives, costs: LEAF, link };
            if !weighed.is_leaf {
                let choices = &mut self.lists[list];
                (node.costs, node.link) = (costs.len() as u32, Link::choice(self.first_list + list, choices.len()));
                choices.push(Choice::new(first, weighed.lanes, [left.link, right.link], [left.count, right.count]));
                costs.push(weighed.costs.to_array());
            }
            if at == 0 {
                joined.add(at, node, &costs);
            } else {
                known[chunk_of(at)].push(Listed { node: at, known: node, is_end: true });
            }
        }
        for mut chunk in known {
            token.check()?;
            chunk.retain(|listed| listed.is_end);
            chunk.sort_unstable_by_key(|listed| listed.node);
            for Listed { node, known, .. } in chunk {
                joined.add(node, known, &costs);
            }
        }
        Ok(joined)
    }
}

/// A node that is known before all of its neighbours are.
#[derive(Clone)]
struct Listed {
    node: u32,
    known: Known,
    /// Whether its parent is not known.
    is_end: bool,
}

impl Room {
    /// Weighs `nodes`, which are chunk number `chunk`, and makes their choices. Hardly any branch depends on the tree: nobody
    /// could predict which.
    #[inline(always)]
    #[allow(clippy::needless_bitwise_bool, reason = "without branches")]
    fn weigh<C: WideContainer, S: Simd>(
        &mut self,
        simd: S,
        nodes: &[Node<C>],
        chunk: usize,
        list: &mut Vec<Choice>,
    ) -> Rest {
        // Node 0 is the root.
        let offset = 1 + 2 * CHUNK * chunk;
        let mut rest = Rest::default();
        let Self { cost, below, place, interior, others, costs, choices, has_parent } = self;
        let (cost, below, place) = (&mut cost[..nodes.len()], &mut below[..nodes.len()], &mut place[..nodes.len()]);
        place.fill(LEAF);
        has_parent.fill(false);
        let mut count = 0;
        for at in 0..nodes.len() {
            let node = &nodes[at];
            cost[at] = node.container.wide_area() * blocks_of(node.count.max(1));
            below[at] = Below { first: node.first, count: node.count };
            interior[count] = at as u16;
            count += usize::from(!node.is_leaf());
        }
        // What fits a block mostly is one.
        let mut other_count = 0;
        for &at in interior[..count].iter().rev() {
            let at = usize::from(at);
            let first = (nodes[at].first as usize).wrapping_sub(offset);
            let children = below.get(first..first.wrapping_add(2));
            let Some(&[left, right]) = children.filter(|children| children.iter().all(|child| child.count != WAITS))
            else {
                below[at].count = WAITS;
                rest.waiting.push((offset + at) as u32);
                continue;
            };
            let primitives = left.count + right.count;
            below[at] = Below { first: left.first, count: primitives };
            has_parent[first / 2] = true;
            let split = cost[at] * NODE_COST + (cost[first] + cost[first + 1]);
            let are_leaves = place[first] & place[first + 1] == LEAF;
            let is_block = are_leaves & (primitives <= BLOCK as u32) & (cost[at] <= split);
            place[at] = if is_block { LEAF } else { 0 };
            others[other_count] = at as u16;
            other_count += usize::from(!is_block);
        }
        let link = |place: u32, below: Below| {
            if place == LEAF { Link::leaf(below.first) } else { Link::choice(chunk, place as usize) }
        };
        let mut used = 0;
        for &at in &others[..other_count] {
            let at = usize::from(at);
            let first_child = nodes[at].first;
            let first = (first_child as usize).wrapping_sub(offset);
            let costs_of = |child: usize| {
                let place = u32x8::splat(simd, place[child]);
                let costs = f32x8::load_array_ref(simd, &costs[place[0] as usize % CHUNK]);
                place.simd_eq(u32x8::splat(simd, LEAF)).select(f32x8::splat(simd, cost[child]), costs)
            };
            let are_leaves = [place[first] == LEAF, place[first + 1] == LEAF];
            let weighed = weigh(simd, cost[at], below[at].count, [costs_of(first), costs_of(first + 1)], are_leaves);
            let links = [link(place[first], below[first]), link(place[first + 1], below[first + 1])];
            let counts = [below[first].count, below[first + 1].count];
            choices[used] = Choice::new(first_child, weighed.lanes, links, counts);
            weighed.costs.store_slice(&mut costs[used]);
            cost[at] = weighed.cost;
            place[at] = if weighed.is_leaf { LEAF } else { used as u32 };
            used += usize::from(!weighed.is_leaf);
        }
        let without_parent = has_parent[..nodes.len() / 2].iter().enumerate().filter(|(_, has_parent)| !**has_parent);
        let mut orphans = 0;
        for (pair, _) in without_parent {
            orphans += 1;
            for at in [2 * pair, 2 * pair + 1] {
                let Below { first, count } = below[at];
                if !nodes[at].is_leaf() && count != WAITS {
                    let link = link(place[at], below[at]);
                    let known = Known { cost: cost[at], first, count, costs: place[at], link };
                    rest.add((offset + at) as u32, known, costs);
                }
            }
        }
        // With room for the choices of their parents.
        list.reserve_exact(used + orphans);
        list.extend_from_slice(&choices[..used]);
        rest
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::geometry::Aabb;
    use crate::wide::collapse::cost::{MAX_LEAF, NODE_COST};

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
    fn chosen(tree: &Tree<Aabb>, choices: &Choices, branch: Branch, lanes: u32) -> f32 {
        let node = &tree.nodes[branch.node as usize];
        let area = node.container.half_area();
        if branch.link.is_leaf() {
            let (first, count) = primitives(tree, branch.node);
            assert_eq!(
                (branch.link.first(), branch.primitives(|node| tree.nodes[node as usize].count)),
                (first, count)
            );
            return area * blocks_of(count);
        }
        let choice = choices.get(branch.link);
        assert_eq!(choice.first_child, node.first);
        match choice.left_of(lanes) {
            0 => area * NODE_COST + chosen(tree, choices, branch, WIDTH as u32),
            left => {
                assert!(left < lanes);
                let [first, second] = choice.children();
                chosen(tree, choices, first, left) + chosen(tree, choices, second, lanes - left)
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

    #[test]
    fn the_choices_cost_least_in_whatever_order_nodes_lie() {
        for (leaves, breadth_first) in [(1, true), (2, true), (9, false), (4 * CHUNK, true), (9 * CHUNK + 5, false)] {
            let tree = tree(leaves, breadth_first);
            let Ok(choices) = choices(&tree, &CancelToken::new()) else { panic!("nobody cancels") };
            for (lanes, cost) in (1..).zip(least(&tree, 0).0) {
                let chosen = chosen(&tree, &choices, choices.root, lanes);
                assert!(
                    (chosen - cost).abs() <= cost * 1e-5,
                    "{leaves} leaves, {lanes} lanes: {chosen}, at best {cost}"
                );
            }
        }
    }
}
