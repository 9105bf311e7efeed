//! One task of the collapse: which binary nodes become leaves and which stand side by side in a wide node.

use arrayvec::ArrayVec;

use super::block::BLOCK;
use super::prefetch::prefetch;
use super::{Child, WIDTH, WideContainer};
use crate::bvh::{Node, Tree};
use crate::cancel::{CancelToken, Cancelled};

/// Cost of visiting a wide node, in the unit of testing a block. Found by trial.
const NODE_COST: f32 = 0.5;
/// Primitives that a wide leaf holds at most, unless a binary leaf holds more.
const MAX_LEAF: u32 = 16;
/// Binary or wide nodes between two looks at the token.
const BETWEEN_CHECKS: usize = 1 << 12;

/// A lane of a wide node to be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lane {
    /// The binary node whose container it holds.
    pub(super) node: u32,
    /// Within the part.
    pub(super) child: Child,
}

impl Lane {
    /// No child: the root never is one.
    pub(super) const NONE: Self = Self { node: 0, child: Child(0) };
}

/// What a part of the wide tree looks like, with indices of its own.
#[derive(Debug, Default)]
pub(super) struct Part {
    /// What its starts became.
    pub(super) roots: Vec<Child>,
    /// The nodes, parents first; lanes without child at the end.
    pub(super) nodes: Vec<[Lane; WIDTH]>,
    /// The blocks, leaf by leaf.
    pub(super) blocks: Vec<BlockPlan>,
}

/// The triangles of a block.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlockPlan {
    /// Slot of the first one in leaf order.
    first: u32,
    count: u8,
    /// Whether its leaf ends with it.
    pub(super) is_last: bool,
}

impl BlockPlan {
    /// The slots of its triangles.
    pub(super) fn slots(self) -> std::ops::Range<usize> {
        self.first as usize..self.first as usize + usize::from(self.count)
    }
}

impl Part {
    fn leaf(&mut self, first: u32, count: u32) -> Child {
        let leaf = Child::leaf(self.blocks.len());
        for at in (0..count).step_by(BLOCK) {
            let is_last = count - at <= BLOCK as u32;
            self.blocks.push(BlockPlan { first: first + at, count: (count - at).min(BLOCK as u32) as u8, is_last });
        }
        leaf
    }
}

/// What lies below a binary node.
#[derive(Debug, Clone, Copy)]
pub(super) struct Below {
    /// Surface area times cost, summed over everything, at best with at most one, two, up to eight roots.
    costs: [f32; WIDTH],
    /// Slot of the first primitive.
    first: u32,
    /// Primitives; [`TOO_MANY`] where no leaf can hold them or they are not neighbours.
    count: u32,
}

const TOO_MANY: u32 = u32::MAX;

impl Below {
    fn leaf<C: WideContainer>(node: &Node<C>) -> Self {
        let cost = node.container.relative_area() * blocks_of(node.count);
        Self { costs: [cost; WIDTH], first: node.first, count: node.count }
    }
}

/// A binary node of a subtree that is no end.
#[derive(Debug, Clone, Copy)]
struct Entry {
    /// The first of its two children in the tree.
    children: u32,
    /// Where the children are in the list of entries; [`END`] for an end.
    entries: [u32; 2],
    area: f32,
    below: Below,
    /// Whether it becomes a leaf.
    is_leaf: bool,
}

const END: u32 = u32::MAX;

/// A part of the binary tree, from a root to its ends, with what its nodes cost.
#[derive(Debug)]
pub(super) struct Subtree {
    root: u32,
    /// The nodes that are no ends, breadth first; none where the root is one.
    entries: Vec<Entry>,
}

impl Subtree {
    /// The nodes from `root` to the ends; `end` gives what lies below those. It may be most of the tree where one side of its
    /// top is far smaller.
    pub(super) fn new<C: WideContainer>(
        tree: &Tree<C>,
        root: u32,
        end: impl Fn(u32) -> Option<Below>,
        token: &CancelToken,
    ) -> Result<Self, Cancelled> {
        token.check()?;
        let mut subtree = Self { root, entries: Vec::new() };
        if end(root).is_none() {
            subtree.entries.reserve(2048);
            subtree.gather(tree, &end, token)?;
            subtree.weigh(&end, token)?;
        }
        Ok(subtree)
    }

    /// The nodes from `root` to the leaves.
    pub(super) fn to_leaves<C: WideContainer>(
        tree: &Tree<C>,
        root: u32,
        token: &CancelToken,
    ) -> Result<Self, Cancelled> {
        let end = |node: u32| {
            let node = &tree.nodes[node as usize];
            node.is_leaf().then(|| Below::leaf(node))
        };
        Self::new(tree, root, end, token)
    }

    /// What lies below its root, which may be a leaf.
    pub(super) fn below<C: WideContainer>(&self, tree: &Tree<C>) -> Below {
        self.entries.first().map_or_else(|| Below::leaf(&tree.nodes[self.root as usize]), |entry| entry.below)
    }

    /// Its root.
    pub(super) fn start(&self) -> Spot {
        Spot { node: self.root, entry: if self.entries.is_empty() { END } else { 0 } }
    }

    fn gather<C: WideContainer>(
        &mut self,
        tree: &Tree<C>,
        end: &impl Fn(u32) -> Option<Below>,
        token: &CancelToken,
    ) -> Result<(), Cancelled> {
        let entry = |index: u32| {
            let node = &tree.nodes[index as usize];
            prefetch(&tree.nodes, node.first as usize);
            let below = Below { costs: [0.0; WIDTH], first: 0, count: 0 };
            let area = node.container.relative_area();
            Entry { children: node.first, entries: [END; 2], area, below, is_leaf: false }
        };
        let entries = &mut self.entries;
        entries.push(entry(self.root));
        let mut at = 0;
        while at < entries.len() {
            if at.is_multiple_of(BETWEEN_CHECKS) {
                token.check()?;
            }
            for side in 0..2 {
                let child = entries[at].children + side;
                if end(child).is_none() {
                    entries[at].entries[side as usize] = entries.len() as u32;
                    entries.push(entry(child));
                }
            }
            at += 1;
        }
        Ok(())
    }

    /// Finds, bottom-up, the least costs and what becomes a leaf.
    fn weigh(&mut self, end: &impl Fn(u32) -> Option<Below>, token: &CancelToken) -> Result<(), Cancelled> {
        for at in (0..self.entries.len()).rev() {
            if at.is_multiple_of(BETWEEN_CHECKS) {
                token.check()?;
            }
            let Entry { children, entries, area, .. } = self.entries[at];
            let below = |side: usize| match self.entries.get(entries[side] as usize) {
                Some(entry) => entry.below,
                None => end(children + side as u32).unwrap_or(NOTHING),
            };
            let (left, right) = (below(0), below(1));
            let neighbours =
                left.count <= MAX_LEAF && right.count <= MAX_LEAF && left.first + left.count == right.first;
            let count = if neighbours { left.count + right.count } else { TOO_MANY };
            let whole = if count <= MAX_LEAF { area * blocks_of(count) } else { f32::INFINITY };
            // No wide node costs less than this.
            let bound = area * NODE_COST + left.costs[WIDTH - 1] + right.costs[WIDTH - 1];
            let (costs, is_leaf) = if whole <= bound {
                ([whole; WIDTH], true)
            } else {
                let costs = shared(&left.costs, &right.costs);
                let split = area * NODE_COST + costs[WIDTH - 1];
                if whole <= split { ([whole; WIDTH], true) } else { (costs.map(|cost| least(cost, split)), false) }
            };
            let entry = &mut self.entries[at];
            entry.below = Below { costs, first: left.first, count };
            entry.is_leaf = is_leaf;
        }
        Ok(())
    }

    /// Makes wide nodes of everything below `starts`, top-down: depth first, what lies below the first lane right after the
    /// node.
    pub(super) fn open<C: WideContainer>(
        &self,
        tree: &Tree<C>,
        starts: &[Spot],
        token: &CancelToken,
    ) -> Result<Part, Cancelled> {
        let mut part = Part::default();
        part.nodes.reserve(self.entries.len() / 6);
        part.blocks.reserve(self.entries.len() / 2);
        // Entries that become wide nodes, with the node and lane that refer to them.
        let mut open: Vec<(Spot, Option<(usize, usize)>)> = Vec::new();
        for &start in starts {
            let root = self.child(tree, start, &mut part);
            let root = root.unwrap_or_else(|| {
                open.push((start, None));
                Child::node(part.nodes.len())
            });
            part.roots.push(root);
            while let Some((spot, parent)) = open.pop() {
                let at = part.nodes.len();
                if at.is_multiple_of(BETWEEN_CHECKS) {
                    token.check()?;
                }
                if let Some((node, lane)) = parent {
                    let lanes: &mut [Lane; WIDTH] = &mut part.nodes[node];
                    lanes[lane].child = Child::node(at);
                }
                let (spots, count) = children_of(spot, |spot| self.look(tree, spot));
                let mut lanes = [Lane::NONE; WIDTH];
                for (lane, &spot) in lanes.iter_mut().zip(&spots[..count]) {
                    let child = self.child(tree, spot, &mut part).unwrap_or(Child::node(0));
                    *lane = Lane { node: spot.node, child };
                }
                part.nodes.push(lanes);
                let interior = (0..count).rev().filter(|&lane| !lanes[lane].child.is_leaf());
                open.extend(interior.map(|lane| (spots[lane], Some((at, lane)))));
            }
        }
        Ok(part)
    }

    /// The leaf that a spot becomes, if it does.
    fn child<C: WideContainer>(&self, tree: &Tree<C>, spot: Spot, part: &mut Part) -> Option<Child> {
        match self.entries.get(spot.entry as usize) {
            None => {
                let node = &tree.nodes[spot.node as usize];
                Some(part.leaf(node.first, node.count))
            }
            Some(entry) => entry.is_leaf.then(|| part.leaf(entry.below.first, entry.below.count)),
        }
    }

    /// Whether a spot becomes a leaf where it stays whole.
    pub(super) fn is_leaf(&self, spot: Spot) -> bool {
        self.entries.get(spot.entry as usize).is_none_or(|entry| entry.is_leaf)
    }

    /// What is known of a spot.
    pub(super) fn look<C: WideContainer>(&self, tree: &Tree<C>, spot: Spot) -> Look<Spot> {
        match self.entries.get(spot.entry as usize) {
            None => Look { costs: Below::leaf(&tree.nodes[spot.node as usize]).costs, children: None },
            Some(entry) => {
                let child = |side: usize| Spot { node: entry.children + side as u32, entry: entry.entries[side] };
                Look { costs: entry.below.costs, children: (!entry.is_leaf).then(|| [child(0), child(1)]) }
            }
        }
    }
}

/// Stands where an end was promised.
const NOTHING: Below = Below { costs: [0.0; WIDTH], first: 0, count: TOO_MANY };

/// A binary node, and its entry in a subtree; [`END`] for an end.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Spot {
    pub(super) node: u32,
    entry: u32,
}

impl Spot {
    /// Whether it is an end of its subtree.
    pub(super) fn is_end(self) -> bool {
        self.entry == END
    }
}

/// What is known of a binary node that may become part of a wide one.
pub(super) struct Look<N> {
    pub(super) costs: [f32; WIDTH],
    /// Unless it becomes a leaf.
    pub(super) children: Option<[N; 2]>,
}

/// The children of the wide node that a binary one becomes, and how many they are.
pub(super) fn children_of<N: Copy + Default>(root: N, look: impl Fn(N) -> Look<N>) -> ([N; WIDTH], usize) {
    let mut lanes = [N::default(); WIDTH];
    let mut count = 0;
    // Nodes with the number of lanes that they may take, the next one last.
    let mut waiting = ArrayVec::<(N, usize), WIDTH>::new();
    waiting.push((root, WIDTH));
    while let Some((node, roots)) = waiting.pop() {
        let is_root = count == 0 && waiting.is_empty();
        let split = if roots == 1 { None } else { split(&look(node), is_root, roots, &look) };
        if let Some(([left, right], lanes_of_left)) = split {
            waiting.push((right, roots - lanes_of_left));
            waiting.push((left, lanes_of_left));
        } else {
            lanes[count] = node;
            count += 1;
        }
    }
    (lanes, count)
}

/// Both children of a node with how many of `roots` lanes the left one gets; `None` where it stays whole.
fn split<N: Copy>(node: &Look<N>, is_root: bool, roots: usize, look: impl Fn(N) -> Look<N>) -> Option<([N; 2], usize)> {
    let children = node.children?;
    let [left, right] = [look(children[0]).costs, look(children[1]).costs];
    let (lanes_of_left, cost) = best_share(&left, &right, roots);
    (is_root || cost <= node.costs[0]).then_some((children, lanes_of_left))
}

/// The least costs of two subtrees that share at most so many roots. At least two: infinite for one.
fn shared(left: &[f32; WIDTH], right: &[f32; WIDTH]) -> [f32; WIDTH] {
    let mut costs = [f32::INFINITY; WIDTH];
    // The right one's costs from one root on, after as many infinite ones as there are lanes.
    let mut shifted = [f32::INFINITY; 2 * WIDTH];
    shifted[WIDTH..].copy_from_slice(right);
    for (of_left, left) in left[..WIDTH - 1].iter().enumerate() {
        let right = &shifted[WIDTH - 1 - of_left..][..WIDTH];
        for (cost, right) in costs.iter_mut().zip(right) {
            *cost = least(*cost, left + right);
        }
    }
    costs
}

/// How many of `roots`, two or more, the left one of two subtrees gets best, and the cost of that.
fn best_share(left: &[f32; WIDTH], right: &[f32; WIDTH], roots: usize) -> (usize, f32) {
    let mut best = (1, f32::INFINITY);
    for of_left in 1..roots {
        let cost = left[of_left - 1] + right[roots - of_left - 1];
        if cost < best.1 {
            best = (of_left, cost);
        }
    }
    best
}

/// The smaller one, in one instruction.
fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Blocks of so many triangles, as a cost.
fn blocks_of(primitives: u32) -> f32 {
    primitives.div_ceil(BLOCK as u32) as f32
}
