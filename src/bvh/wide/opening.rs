//! One task of the collapse: which binary nodes become leaves and which stand side by side in a wide node.

use super::block::BLOCK;
use super::prefetch::prefetch;
use super::{Child, WIDTH, WideContainer};
use crate::bvh::{Node, Tree};

/// Cost of one binary node's part in a wide node, in the unit of testing a block.
const NODE_COST: f32 = 0.4;
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
#[derive(Debug)]
pub(super) struct Part {
    pub(super) root: Child,
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

impl Default for Part {
    fn default() -> Self {
        Self { root: Child::node(0), nodes: Vec::new(), blocks: Vec::new() }
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

/// An interior node of a task's subtree.
#[derive(Debug, Clone, Copy)]
struct Entry {
    /// The first of its two children in the tree.
    children: u32,
    /// Where the children are in the list of entries; [`LEAF`] for a leaf of the binary tree.
    entries: [u32; 2],
    area: f32,
    /// Surface area times cost, summed over everything below.
    cost: f32,
    /// Slot of the first primitive below.
    first: u32,
    /// Primitives below; [`TOO_MANY`] where no leaf can hold them or they are not neighbours.
    count: u32,
    /// Whether it becomes a leaf.
    is_leaf: bool,
}

const LEAF: u32 = u32::MAX;
const TOO_MANY: u32 = u32::MAX;

/// Memory that a thread keeps from task to task.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    entries: Vec<Entry>,
    /// Entries that become wide nodes, with the node and lane that refer to them.
    open: Vec<(u32, Option<(usize, usize)>)>,
}

impl Scratch {
    /// The part of the wide tree below a node.
    pub(super) fn part<C: WideContainer>(&mut self, tree: &Tree<C>, root: u32) -> Part {
        let mut part = Part::default();
        let node = &tree.nodes[root as usize];
        if node.is_leaf() {
            part.root = part.leaf(node.first, node.count);
            return part;
        }
        self.gather(tree, root);
        self.weigh(tree);
        if self.entries[0].is_leaf {
            part.root = part.leaf(self.entries[0].first, self.entries[0].count);
            return part;
        }
        part.nodes.reserve(self.entries.len() / 6);
        part.blocks.reserve(self.entries.len() / 2);
        self.open(tree, &mut part);
        part
    }

    /// Lists the interior nodes below `root`, breadth first.
    fn gather<C: WideContainer>(&mut self, tree: &Tree<C>, root: u32) {
        let entry = |node: &Node<C>| {
            prefetch(&tree.nodes, node.first as usize);
            let area = node.container.relative_area();
            Entry { children: node.first, entries: [LEAF; 2], area, cost: 0.0, first: 0, count: 0, is_leaf: false }
        };
        let entries = &mut self.entries;
        entries.clear();
        entries.push(entry(&tree.nodes[root as usize]));
        let mut at = 0;
        while at < entries.len() {
            let first = entries[at].children as usize;
            for (side, child) in tree.nodes[first..first + 2].iter().enumerate() {
                if !child.is_leaf() {
                    entries[at].entries[side] = entries.len() as u32;
                    entries.push(entry(child));
                }
            }
            at += 1;
        }
    }

    /// Decides, bottom-up, what becomes a leaf.
    fn weigh<C: WideContainer>(&mut self, tree: &Tree<C>) {
        for at in (0..self.entries.len()).rev() {
            let Entry { children, entries, area, .. } = self.entries[at];
            let below = |side: usize| {
                if let Some(entry) = self.entries.get(entries[side] as usize) {
                    return (entry.cost, entry.first, entry.count);
                }
                let node = &tree.nodes[children as usize + side];
                (node.container.relative_area() * blocks_of(node.count), node.first, node.count)
            };
            let (left, right) = (below(0), below(1));
            let split = area * NODE_COST + left.0 + right.0;
            let neighbours = left.2 <= MAX_LEAF && right.2 <= MAX_LEAF && left.1 + left.2 == right.1;
            let count = if neighbours { left.2 + right.2 } else { TOO_MANY };
            let whole = if count <= MAX_LEAF { area * blocks_of(count) } else { f32::INFINITY };
            let entry = &mut self.entries[at];
            (entry.first, entry.count) = (left.1, count);
            entry.is_leaf = whole <= split;
            entry.cost = if entry.is_leaf { whole } else { split };
        }
    }

    /// Makes wide nodes, top-down: depth first, what lies below the first lane right after the node.
    fn open<C: WideContainer>(&mut self, tree: &Tree<C>, part: &mut Part) {
        let Self { entries, open } = self;
        let children = |parent: Opened| {
            let parent = &entries[parent.entry as usize];
            let child = |side: u32| {
                let child = Opened { node: parent.children + side, entry: parent.entries[side as usize] };
                let interior = entries.get(child.entry as usize).filter(|entry| !entry.is_leaf);
                (child, interior.map_or(NOT_OPENED, |entry| entry.area))
            };
            [child(0), child(1)]
        };
        open.clear();
        open.push((0, None));
        while let Some((entry, parent)) = open.pop() {
            let at = part.nodes.len();
            if let Some((node, lane)) = parent {
                part.nodes[node][lane].child = Child::node(at);
            }
            let (opened, count) = open_largest(Opened { node: 0, entry }, children);
            let mut lanes = [Lane::NONE; WIDTH];
            for (lane, &Opened { node, entry }) in lanes.iter_mut().zip(&opened[..count]) {
                let child = match entries.get(entry as usize) {
                    None => part.leaf(tree.nodes[node as usize].first, tree.nodes[node as usize].count),
                    Some(entry) if entry.is_leaf => part.leaf(entry.first, entry.count),
                    Some(_) => Child::node(0),
                };
                *lane = Lane { node, child };
            }
            part.nodes.push(lanes);
            let interior = (0..count).rev().filter(|&lane| !lanes[lane].child.is_leaf());
            open.extend(interior.map(|lane| (opened[lane].entry, Some((at, lane)))));
        }
    }
}

/// A binary node in a wide one, and its entry.
#[derive(Debug, Clone, Copy, Default)]
struct Opened {
    node: u32,
    entry: u32,
}

/// The area of what stays closed.
pub(super) const NOT_OPENED: f32 = -1.0;

/// The children of a wide node: those of `root`, the largest opened as long as there is room. `children` gives both children
/// of a binary node with their areas, [`NOT_OPENED`] where that is not allowed.
#[inline]
pub(super) fn open_largest<N: Copy + Default>(root: N, children: impl Fn(N) -> [(N, f32); 2]) -> ([N; WIDTH], usize) {
    let mut lanes = [N::default(); WIDTH];
    let mut areas = [NOT_OPENED; WIDTH];
    let (mut count, mut lane) = (1, 0);
    lanes[0] = root;
    loop {
        let [left, right] = children(lanes[lane]);
        (lanes[lane], areas[lane]) = left;
        (lanes[count], areas[count]) = right;
        count += 1;
        lane = 0;
        for other in 1..count {
            if areas[other] > areas[lane] {
                lane = other;
            }
        }
        if count == WIDTH || areas[lane] < 0.0 {
            return (lanes, count);
        }
    }
}

/// Blocks of so many triangles, as a cost.
fn blocks_of(primitives: u32) -> f32 {
    primitives.div_ceil(BLOCK as u32) as f32
}
