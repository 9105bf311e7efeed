//! From the choices for each binary node to the wide nodes and leaves.

use super::block::BLOCK;
use super::choice::{Choice, Link};
use super::prefetch::prefetch;
use super::{Child, WIDTH, WideContainer};
use crate::bvh::Tree;
use crate::cancel::{CancelToken, Cancelled};

/// Wide nodes between two looks at the token.
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

/// A part of the wide tree, with indices of its own.
#[derive(Debug, Default)]
pub(super) struct Part {
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

/// The binary tree, and what becomes of its nodes.
#[derive(Clone, Copy)]
pub(super) struct Opener<'a, C> {
    pub(super) tree: &'a Tree<C>,
    pub(super) choices: &'a [Choice],
    /// Whether every leaf of the tree holds one primitive: then it need not be looked at.
    pub(super) single: bool,
}

/// A binary node that takes a whole lane.
#[derive(Debug, Clone, Copy, Default)]
struct Whole {
    node: u32,
    link: Link,
    /// Where it becomes a leaf: the first slot, and the number of primitives.
    first: u32,
    count: u32,
}

/// A binary node that is looked at, and how many lanes it may take.
#[derive(Debug, Clone, Copy, Default)]
struct Waiting {
    node: u32,
    link: Link,
    lanes: u32,
}

impl<C: WideContainer> Opener<'_, C> {
    /// The children of the wide node that a binary one becomes, and how many they are.
    #[inline(always)]
    fn children_of(self, root: Link) -> ([Whole; WIDTH], usize) {
        let mut children = [Whole::default(); WIDTH];
        let mut count = 0;
        // The next one last.
        let mut waiting = [Waiting::default(); WIDTH];
        waiting[0] = Waiting { node: 0, link: root, lanes: WIDTH as u32 };
        let mut len = 1;
        while len > 0 {
            len -= 1;
            let Waiting { node, link, lanes } = waiting[len % WIDTH];
            let whole = &mut children[count % WIDTH];
            if link.is_leaf() {
                let primitives = if self.single { 1 } else { self.tree.nodes[node as usize].count };
                *whole = Whole { node, link, first: link.first(), count: primitives };
                count += 1;
                continue;
            }
            let choice = self.choices[link.pair()];
            let left = choice.left_of(lanes);
            if left == 0 {
                let (first, primitives) = choice.leaf();
                *whole = Whole { node, link, first, count: primitives };
                count += 1;
                continue;
            }
            let [of_left, of_right] = choice.links;
            waiting[len % WIDTH] = Waiting { node: link.first() + 1, link: of_right, lanes: lanes - left };
            waiting[(len + 1) % WIDTH] = Waiting { node: link.first(), link: of_left, lanes: left };
            len += 2;
        }
        (children, count)
    }

    /// What the root refers to.
    pub(super) fn root(self) -> Link {
        Link::new(&self.tree.nodes[0])
    }

    /// The one leaf that the tree becomes, if it becomes one.
    pub(super) fn root_leaf(self) -> Option<(u32, u32)> {
        let root = &self.tree.nodes[0];
        let leaf = if root.is_leaf() { (root.first, root.count) } else { self.choices[self.root().pair()].leaf() };
        (leaf.1 > 0).then_some(leaf)
    }

    /// Up to `most` wide nodes from the root on, breadth first, and the binary nodes that are left to become others: children
    /// that are nodes have numbers by which these follow those.
    pub(super) fn top(self, most: usize) -> (Part, Vec<Link>) {
        let mut part = Part::default();
        if let Some((first, count)) = self.root_leaf() {
            part.leaf(first, count);
            return (part, Vec::new());
        }
        let mut found = vec![self.root()];
        while part.nodes.len() < most.min(found.len()) {
            let (children, count) = self.children_of(found[part.nodes.len()]);
            let node = |link: Link| {
                found.push(link);
                Child::node(found.len() - 1)
            };
            part.push(&children[..count], node);
        }
        found.drain(..part.nodes.len());
        (part, found)
    }

    /// Everything below the wide node that a binary one becomes: depth first, what lies below the first lane right after the
    /// node.
    pub(super) fn part(self, root: Link, token: &CancelToken) -> Result<Part, Cancelled> {
        let mut part = Part::default();
        // What becomes wide nodes, with the node and lane that refer to them.
        let mut open: Vec<(Link, usize, usize)> = vec![(root, usize::MAX, 0)];
        while let Some((root, parent, lane)) = open.pop() {
            let at = part.nodes.len();
            if at.is_multiple_of(BETWEEN_CHECKS) {
                token.check()?;
            }
            if let Some(lanes) = part.nodes.get_mut(parent) {
                lanes[lane].child = Child::node(at);
            }
            let (children, count) = self.children_of(root);
            part.push(&children[..count], |_| Child::node(0));
            for (lane, child) in children[..count].iter().enumerate().rev() {
                if child.count == 0 {
                    prefetch(self.choices, child.link.pair());
                    open.push((child.link, at, lane));
                }
            }
        }
        Ok(part)
    }
}

impl Part {
    /// Adds a node; `child` tells where children are that are nodes themselves.
    #[inline(always)]
    fn push(&mut self, children: &[Whole], mut child: impl FnMut(Link) -> Child) {
        let mut lanes = [Lane::NONE; WIDTH];
        for (lane, whole) in lanes.iter_mut().zip(children) {
            let child = if whole.count > 0 { self.leaf(whole.first, whole.count) } else { child(whole.link) };
            *lane = Lane { node: whole.node, child };
        }
        self.nodes.push(lanes);
    }

    #[inline(always)]
    fn leaf(&mut self, first: u32, count: u32) -> Child {
        let leaf = Child::leaf(self.blocks.len());
        let mut at = 0;
        loop {
            let left = count - at;
            let is_last = left <= BLOCK as u32;
            self.blocks.push(BlockPlan { first: first + at, count: left.min(BLOCK as u32) as u8, is_last });
            at += BLOCK as u32;
            if is_last {
                return leaf;
            }
        }
    }
}
