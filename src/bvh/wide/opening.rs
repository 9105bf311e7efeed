//! One task of the collapse: which binary nodes become leaves and which stand side by side in a wide node.

use arrayvec::ArrayVec;

use super::block::BLOCK;
use super::prefetch::prefetch;
use super::{Child, WIDTH, WideContainer};
use crate::bvh::{Node, Tree};

/// Cost of visiting a wide node, in the unit of testing a block. Found by trial.
const NODE_COST: f32 = 0.5;
/// Primitives that a wide leaf holds at most, unless a binary leaf holds more.
const MAX_LEAF: u32 = 16;

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
    pub(super) root: Child,
    /// Surface area times cost, summed over everything in it.
    pub(super) cost: f32,
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

/// Where the binary tree ends for a task.
pub(super) trait Ends<C: WideContainer> {
    /// Whether a node is an end.
    fn is_end(&self, tree: &Tree<C>, node: u32) -> bool;
    /// What lies below an end.
    fn below(&self, tree: &Tree<C>, node: u32) -> Below;
    /// What an end becomes.
    fn child(&self, tree: &Tree<C>, node: u32, part: &mut Part) -> Child;
}

/// The leaves.
pub(super) struct Leaves;

impl<C: WideContainer> Ends<C> for Leaves {
    fn is_end(&self, tree: &Tree<C>, node: u32) -> bool {
        tree.nodes[node as usize].is_leaf()
    }

    fn below(&self, tree: &Tree<C>, node: u32) -> Below {
        let Node { container, first, count } = &tree.nodes[node as usize];
        Below { costs: [container.relative_area() * blocks_of(*count); WIDTH], first: *first, count: *count }
    }

    fn child(&self, tree: &Tree<C>, node: u32, part: &mut Part) -> Child {
        let node = &tree.nodes[node as usize];
        part.leaf(node.first, node.count)
    }
}

/// What lies below a binary node.
#[derive(Debug, Clone, Copy)]
pub(super) struct Below {
    /// Surface area times cost, summed over everything, at best with at most one, two, up to eight roots.
    pub(super) costs: [f32; WIDTH],
    /// Slot of the first primitive.
    pub(super) first: u32,
    /// Primitives; [`TOO_MANY`] where no leaf can hold them or they are not neighbours.
    pub(super) count: u32,
}

/// A binary node of a task's subtree that is no end.
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
pub(super) const TOO_MANY: u32 = u32::MAX;

/// Memory that a thread keeps from task to task.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    entries: Vec<Entry>,
    /// Entries that become wide nodes, with the node and lane that refer to them.
    open: Vec<(u32, Option<(usize, usize)>)>,
}

impl Scratch {
    /// The part of the wide tree below a node.
    pub(super) fn part<C: WideContainer>(&mut self, tree: &Tree<C>, ends: &impl Ends<C>, root: u32) -> Part {
        let mut part = Part::default();
        if ends.is_end(tree, root) {
            part.cost = ends.below(tree, root).costs[0];
            part.root = ends.child(tree, root, &mut part);
            return part;
        }
        self.gather(tree, ends, root);
        self.weigh(tree, ends);
        let Entry { below, is_leaf, .. } = self.entries[0];
        part.cost = below.costs[0];
        if is_leaf {
            part.root = part.leaf(below.first, below.count);
            return part;
        }
        part.nodes.reserve(self.entries.len() / 6);
        part.blocks.reserve(self.entries.len() / 2);
        self.open(tree, ends, &mut part);
        part
    }

    /// Lists the nodes from `root` to the ends, breadth first.
    fn gather<C: WideContainer>(&mut self, tree: &Tree<C>, ends: &impl Ends<C>, root: u32) {
        let entry = |index: u32| {
            let node = &tree.nodes[index as usize];
            prefetch(&tree.nodes, node.first as usize);
            let below = Below { costs: [0.0; WIDTH], first: 0, count: 0 };
            let area = node.container.relative_area();
            Entry { children: node.first, entries: [END; 2], area, below, is_leaf: false }
        };
        let entries = &mut self.entries;
        entries.clear();
        entries.push(entry(root));
        let mut at = 0;
        while at < entries.len() {
            for side in 0..2 {
                let child = entries[at].children + side;
                if !ends.is_end(tree, child) {
                    entries[at].entries[side as usize] = entries.len() as u32;
                    entries.push(entry(child));
                }
            }
            at += 1;
        }
    }

    /// Finds, bottom-up, the least costs and what becomes a leaf.
    fn weigh<C: WideContainer>(&mut self, tree: &Tree<C>, ends: &impl Ends<C>) {
        for at in (0..self.entries.len()).rev() {
            let Entry { children, entries, area, .. } = self.entries[at];
            let below = |side: usize| match self.entries.get(entries[side] as usize) {
                Some(entry) => entry.below,
                None => ends.below(tree, children + side as u32),
            };
            let (left, right) = (below(0), below(1));
            let neighbours =
                left.count <= MAX_LEAF && right.count <= MAX_LEAF && left.first + left.count == right.first;
            let count = if neighbours { left.count + right.count } else { TOO_MANY };
            let whole = if count <= MAX_LEAF { area * blocks_of(count) } else { f32::INFINITY };
            // What fits into a block is hardly worth more than two.
            let mut costs = if count <= BLOCK as u32 {
                [left.costs[0] + right.costs[0]; WIDTH]
            } else {
                shared(&left.costs, &right.costs)
            };
            let split = area * NODE_COST + costs[WIDTH - 1];
            let is_leaf = whole <= split;
            let one = if is_leaf { whole } else { split };
            costs[0] = one;
            for cost in &mut costs {
                *cost = least(*cost, one);
            }
            let entry = &mut self.entries[at];
            entry.below = Below { costs, first: left.first, count };
            entry.is_leaf = is_leaf;
        }
    }

    /// Makes wide nodes, top-down: depth first, what lies below the first lane right after the node.
    fn open<C: WideContainer>(&mut self, tree: &Tree<C>, ends: &impl Ends<C>, part: &mut Part) {
        let mut open = std::mem::take(&mut self.open);
        open.clear();
        open.push((0, None));
        while let Some((entry, parent)) = open.pop() {
            let at = part.nodes.len();
            if let Some((node, lane)) = parent {
                part.nodes[node][lane].child = Child::node(at);
            }
            let (opened, count) = self.opened(tree, ends, entry);
            let mut lanes = [Lane::NONE; WIDTH];
            for (lane, &Opened { node, entry }) in lanes.iter_mut().zip(&opened[..count]) {
                let child = match self.entries.get(entry as usize) {
                    None => ends.child(tree, node, part),
                    Some(entry) if entry.is_leaf => part.leaf(entry.below.first, entry.below.count),
                    Some(_) => Child::node(0),
                };
                *lane = Lane { node, child };
            }
            part.nodes.push(lanes);
            let interior = (0..count).rev().filter(|&lane| !lanes[lane].child.is_leaf());
            open.extend(interior.map(|lane| (opened[lane].entry, Some((at, lane)))));
        }
        self.open = open;
    }

    /// The children of the wide node that an entry becomes, and how many they are.
    fn opened<C: WideContainer>(&self, tree: &Tree<C>, ends: &impl Ends<C>, entry: u32) -> ([Opened; WIDTH], usize) {
        let mut lanes = [Opened::default(); WIDTH];
        let mut count = 0;
        // Nodes with the number of lanes that they may take, the next one last.
        let mut waiting = ArrayVec::<(Opened, usize), WIDTH>::new();
        waiting.push((Opened { node: 0, entry }, WIDTH));
        while let Some((opened, roots)) = waiting.pop() {
            let split = self.entries.get(opened.entry as usize).filter(|_| roots > 1).and_then(|entry| {
                let child = |side: u32| Opened { node: entry.children + side, entry: entry.entries[side as usize] };
                let costs = |child: Opened| match self.entries.get(child.entry as usize) {
                    Some(entry) => entry.below.costs,
                    None => ends.below(tree, child.node).costs,
                };
                let (left, right) = (child(0), child(1));
                let (lanes_of_left, cost) = best_share(&costs(left), &costs(right), roots);
                let is_root = count == 0 && waiting.is_empty();
                (is_root || !entry.is_leaf && cost <= entry.below.costs[0]).then_some((left, right, lanes_of_left))
            });
            if let Some((left, right, lanes_of_left)) = split {
                waiting.push((right, roots - lanes_of_left));
                waiting.push((left, lanes_of_left));
            } else {
                lanes[count] = opened;
                count += 1;
            }
        }
        (lanes, count)
    }
}

/// A binary node in a wide one, and its entry.
#[derive(Debug, Clone, Copy, Default)]
struct Opened {
    node: u32,
    entry: u32,
}

/// The least costs of two subtrees that share at most so many roots. At least two: infinite for one.
fn shared(left: &[f32; WIDTH], right: &[f32; WIDTH]) -> [f32; WIDTH] {
    let mut costs = [f32::INFINITY; WIDTH];
    for (of_left, left) in left[..WIDTH - 1].iter().enumerate() {
        for (cost, right) in costs[of_left + 1..].iter_mut().zip(right) {
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
