//! From the choices for each binary node to the wide nodes and leaves.

use crate::cancel::{CancelToken, Cancelled};
use crate::tree::Tree;
use crate::wide::bounds::WideContainer;
use crate::wide::collapse::decision::{Branch, Choices, Link};
use crate::wide::layout::BLOCK;
use crate::wide::layout::WIDTH;
use crate::wide::tree::Child;

/// Wide nodes between two looks at the token.
const BETWEEN_CHECKS: usize = 1 << 12;

/// A lane of a wide node to be.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lane {
    /// The binary node whose container it holds.
    pub(crate) node: u32,
    /// Within the part.
    pub(crate) child: Child,
}

impl Lane {
    /// No child: the root never is one.
    pub(crate) const NONE: Self = Self { node: 0, child: Child(0) };
}

/// A part of the wide tree, with indices of its own.
#[derive(Debug, Default)]
pub(crate) struct Part {
    /// The nodes, parents first; lanes without child at the end.
    pub(crate) nodes: Vec<[Lane; WIDTH]>,
    /// The blocks, leaf by leaf.
    pub(crate) blocks: Vec<BlockPlan>,
}

/// The triangles of a block.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BlockPlan {
    /// Slot of the first one in leaf order.
    first: u32,
    count: u8,
    /// Whether its leaf ends with it.
    pub(crate) is_last: bool,
}

impl BlockPlan {
    /// The slots of its triangles.
    pub(crate) fn slots(self) -> std::ops::Range<usize> {
        self.first as usize..self.first as usize + usize::from(self.count)
    }
}

/// The binary tree, and what becomes of its nodes.
#[derive(Clone, Copy)]
pub(crate) struct Opener<'a, C> {
    pub(crate) tree: &'a Tree<C>,
    pub(crate) choices: &'a Choices,
}

/// A binary node that is looked at, and how many lanes it may take.
#[derive(Debug, Clone, Copy, Default)]
struct Waiting {
    branch: Branch,
    lanes: u32,
}

impl<C: WideContainer> Opener<'_, C> {
    /// The children of the wide node that a binary one becomes, and how many they are.
    #[inline(always)]
    fn children_of(self, root: Link) -> ([Branch; WIDTH], usize) {
        let mut children = [Branch::default(); WIDTH];
        let mut count = 0;
        // The next one last.
        let mut waiting = [Waiting::default(); WIDTH];
        waiting[0] = Waiting { branch: Branch::new(0, root, 0), lanes: WIDTH as u32 };
        let mut len = 1;
        while len > 0 {
            len -= 1;
            let Waiting { branch, lanes } = waiting[len % WIDTH];
            if lanes > 1 && !branch.link.is_leaf() {
                let choice = self.choices.get(branch.link);
                let left = choice.left_of(lanes);
                if left > 0 {
                    let [of_left, of_right] = choice.children();
                    waiting[len % WIDTH] = Waiting { branch: of_right, lanes: lanes - left };
                    waiting[(len + 1) % WIDTH] = Waiting { branch: of_left, lanes: left };
                    len += 2;
                    continue;
                }
            }
            children[count % WIDTH] = branch;
            count += 1;
        }
        (children, count)
    }

    /// Adds a node; `child` tells where children are that are nodes themselves.
    #[inline(always)]
    fn push(self, part: &mut Part, children: &[Branch], mut child: impl FnMut(Link) -> Child) {
        let mut lanes = [Lane::NONE; WIDTH];
        for (lane, branch) in lanes.iter_mut().zip(children) {
            let child = if branch.link.is_leaf() { self.leaf(part, *branch) } else { child(branch.link) };
            *lane = Lane { node: branch.node, child };
        }
        part.nodes.push(lanes);
    }

    /// Adds a leaf.
    #[inline(always)]
    fn leaf(self, part: &mut Part, branch: Branch) -> Child {
        part.leaf(branch.link.first(), branch.primitives(|node| self.tree.nodes[node as usize].count))
    }

    /// Up to `most` wide nodes from the root on, breadth first, and the binary nodes that are left to become others: children
    /// that are nodes have numbers by which these follow those.
    pub(crate) fn top(self, most: usize) -> (Part, Vec<Link>) {
        let mut part = Part::default();
        let root = self.choices.root;
        if root.link.is_leaf() {
            self.leaf(&mut part, root);
            return (part, Vec::new());
        }
        let mut found = vec![root.link];
        while part.nodes.len() < most.min(found.len()) {
            let (children, count) = self.children_of(found[part.nodes.len()]);
            let node = |link: Link| {
                found.push(link);
                Child::node(found.len() - 1)
            };
            self.push(&mut part, &children[..count], node);
        }
        found.drain(..part.nodes.len());
        (part, found)
    }

    /// Everything below the wide node that a binary one becomes: depth first, what lies below the first lane right after the
    /// node.
    pub(crate) fn part(self, root: Link, token: &CancelToken) -> Result<Part, Cancelled> {
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
            self.push(&mut part, &children[..count], |_| Child::node(0));
            for (lane, child) in children[..count].iter().enumerate().rev() {
                if !child.link.is_leaf() {
                    self.choices.prefetch(child.link);
                    open.push((child.link, at, lane));
                }
            }
        }
        Ok(part)
    }
}

impl Part {
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
