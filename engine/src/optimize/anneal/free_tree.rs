//! A binary tree whose nodes keep their indices wherever they are moved, each with the cost of its subtree.

use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use crate::geometry::Aabb;
use crate::optimize::move_search::{LinkedNodes, NONE};
use crate::optimize::sah::MAX_LEAF_SIZE;
use crate::optimize::simd_box::SimdBox;
use crate::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST};
use crate::tree::{Node, Tree};

/// A node; one cache line.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub struct FreeNode {
    pub bounds: SimdBox,
    /// SAH cost of the subtree, not normalised.
    pub cost: f64,
    /// A leaf has [`NONE`] and its first slot in the primitive indices.
    pub children: [u32; 2],
    /// [`NONE`] for the root.
    pub parent: u32,
    /// Number of primitives; 0 for a node that is no longer part of the tree.
    pub count: u32,
}

/// The tree, with its root at 0.
pub struct FreeTree {
    pub nodes: Vec<FreeNode>,
    /// Subtrees that are dearer than a leaf of their primitives count as that leaf.
    collapses: bool,
}

impl FreeTree {
    /// Takes a tree apart, which may be in any order with siblings together and have unreachable nodes.
    pub fn new(tree: &Tree<Aabb>, collapses: bool, token: &CancelToken) -> Result<Self, Cancelled> {
        let unreachable = FreeNode { bounds: SimdBox::EMPTY, cost: 0.0, children: [NONE; 2], parent: NONE, count: 0 };
        let mut free = Self { nodes: vec![unreachable; tree.nodes.len()], collapses };
        let mut order = vec![0];
        let mut next = 0;
        while let Some(&index) = order.get(next) {
            token.check_every(LIGHT_STEPS, next)?;
            next += 1;
            let node = &tree.nodes[index as usize];
            let bounds = SimdBox::new(&node.container);
            let children = if node.is_leaf() { [NONE, node.first] } else { [node.first, node.first + 1] };
            let free_node = &mut free.nodes[index as usize];
            *free_node = FreeNode { bounds, children, count: node.count, ..*free_node };
            if node.is_leaf() {
                free_node.cost = leaf_cost(&bounds, node.count);
            } else {
                order.extend(children);
                for child in children {
                    free.nodes[child as usize].parent = index;
                }
            }
        }
        for nodes in order.rchunks(LIGHT_STEPS) {
            token.check()?;
            nodes.iter().rev().for_each(|&index| free.refit(index));
        }
        Ok(free)
    }

    /// The tree with its nodes in depth-first order and its leaves' `primitive_indices` from left to right.
    pub fn to_tree(&self, primitive_indices: &[u32], token: &CancelToken) -> Result<Tree<Aabb>, Cancelled> {
        let mut tree = Tree { nodes: vec![EMPTY_NODE], primitive_indices: Vec::new(), max_depth: 0 };
        let mut stack = vec![(0, 0, 0)];
        while let Some((index, slot, depth)) = stack.pop() {
            if tree.nodes.len() % LIGHT_STEPS < 2 {
                token.check()?;
            }
            let FreeNode { bounds, children: [left, right], count, .. } = self.nodes[index as usize];
            let node = &mut tree.nodes[slot];
            node.container = Aabb { min: bounds.min.into(), max: bounds.max.into() };
            tree.max_depth = tree.max_depth.max(depth);
            if left == NONE {
                (node.first, node.count) = (tree.primitive_indices.len() as u32, count);
                let first = right as usize;
                tree.primitive_indices.extend_from_slice(&primitive_indices[first..first + count as usize]);
            } else {
                let first = tree.nodes.len();
                tree.nodes[slot].first = first as u32;
                tree.nodes.extend([EMPTY_NODE; 2]);
                stack.extend([(right, first + 1, depth + 1), (left, first, depth + 1)]);
            }
        }
        Ok(tree)
    }

    /// SAH cost of the tree, not normalised.
    pub fn cost(&self) -> f64 {
        self.nodes[0].cost
    }

    #[inline(always)]
    pub fn is_leaf(&self, index: u32) -> bool {
        self.nodes[index as usize].children[0] == NONE
    }

    /// Whether `index` is part of the tree, but neither the root nor a child of it, which cannot be moved.
    #[inline(always)]
    pub fn is_movable(&self, index: u32) -> bool {
        let node = &self.nodes[index as usize];
        node.count > 0 && node.parent != NONE && node.parent != 0
    }

    /// The indices of all nodes, children before their parents.
    pub fn bottom_up(&self, token: &CancelToken) -> Result<Vec<u32>, Cancelled> {
        let mut order = vec![0];
        let mut next = 0;
        while let Some(&index) = order.get(next) {
            token.check_every(LIGHT_STEPS, next)?;
            if !self.is_leaf(index) {
                order.extend(self.nodes[index as usize].children);
            }
            next += 1;
        }
        order.reverse();
        Ok(order)
    }

    /// Computes bounds, size and cost of `index` from its children; a leaf stays as it is.
    #[inline(always)]
    pub fn refit(&mut self, index: u32) {
        let [left, right] = self.nodes[index as usize].children;
        if left == NONE {
            return;
        }
        let (left, right) = (&self.nodes[left as usize], &self.nodes[right as usize]);
        let bounds = left.bounds.union(&right.bounds);
        let count = left.count + right.count;
        let cost = self.subtree_cost(&bounds, count, left.cost + right.cost);
        let node = &mut self.nodes[index as usize];
        *node = FreeNode { bounds, cost, count, ..*node };
    }

    /// [`Self::refit`] for `index` and its ancestors below `end`.
    #[inline(always)]
    pub fn refit_up(&mut self, mut index: u32, end: u32) {
        while index != end {
            self.refit(index);
            index = self.nodes[index as usize].parent;
        }
    }

    /// SAH cost of an interior node, or of a leaf where that is less.
    #[inline(always)]
    pub fn subtree_cost(&self, bounds: &SimdBox, count: u32, children_cost: f64) -> f64 {
        let cost = f64::from(bounds.half_area() * TRAVERSAL_COST) + children_cost;
        if self.collapses && count <= MAX_LEAF_SIZE { cost.min(leaf_cost(bounds, count)) } else { cost }
    }

    /// Makes `pair` the children of `parent`.
    #[inline(always)]
    pub fn link(&mut self, parent: u32, pair: [u32; 2]) {
        self.nodes[parent as usize].children = pair;
        for child in pair {
            self.nodes[child as usize].parent = parent;
        }
    }

    /// Takes `node` and its parent out: its sibling replaces the parent. Nothing is refitted.
    #[inline(always)]
    pub fn detach(&mut self, node: u32) -> Detached {
        let parent = self.parent(node);
        let (sibling, above) = (self.sibling(node), self.parent(parent));
        self.replace_child(above, parent, sibling);
        Detached { node, parent, sibling, above }
    }

    /// Joins what was taken out with `target`: the parent takes the place of `target`. Nothing is refitted.
    #[inline(always)]
    pub fn attach(&mut self, detached: &Detached, target: u32) {
        self.replace_child(self.parent(target), target, detached.parent);
        self.link(detached.parent, [target, detached.node]);
    }

    #[inline(always)]
    fn replace_child(&mut self, parent: u32, old: u32, new: u32) {
        let children = &mut self.nodes[parent as usize].children;
        children[usize::from(children[0] != old)] = new;
        self.nodes[new as usize].parent = parent;
    }
}

/// A node that was taken out of the tree with its parent.
#[derive(Clone, Copy)]
pub struct Detached {
    pub node: u32,
    /// Its parent.
    pub parent: u32,
    /// Its former sibling.
    pub sibling: u32,
    /// Its former grandparent, now the sibling's parent.
    pub above: u32,
}

const EMPTY_NODE: Node<Aabb> = Node { container: Aabb::EMPTY, first: 0, count: 0 };

/// SAH cost of a leaf, not normalised.
#[inline(always)]
pub fn leaf_cost(bounds: &SimdBox, primitives: u32) -> f64 {
    f64::from(bounds.half_area() * INTERSECTION_COST) * f64::from(primitives)
}

impl LinkedNodes for FreeTree {
    type Bounds = SimdBox;

    #[inline(always)]
    fn parent(&self, node: u32) -> u32 {
        self.nodes[node as usize].parent
    }

    #[inline(always)]
    fn sibling(&self, node: u32) -> u32 {
        let [left, right] = self.nodes[self.parent(node) as usize].children;
        if left == node { right } else { left }
    }

    #[inline(always)]
    fn children(&self, node: u32) -> Option<[u32; 2]> {
        let children = self.nodes[node as usize].children;
        (children[0] != NONE).then_some(children)
    }

    #[inline(always)]
    fn bounds(&self, node: u32) -> SimdBox {
        self.nodes[node as usize].bounds
    }
}
