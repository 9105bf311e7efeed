//! The nodes of the tree that those of the traversed tree stand for.

use std::collections::HashMap;

use crate::accel::Accel;
use bvhscope_engine::tree::{Node, Tree};
use bvhscope_engine::wide::{AnyWideTree, Child, WideContainer, WideTree};
use bvhscope_engine::{AnyTree, with_tree};

/// Levels of the tree that a wide node can span: of eight children one may hang on a chain of seven nodes.
const LEVELS: u32 = 7;
/// Most nodes of a level that are compared; of a binary tree there are no more than 128.
const MOST_ON_LEVEL: usize = 1 << 12;

/// Names of nodes, found as the traversal visits them.
pub(super) struct TreeNodes<'a> {
    accel: &'a Accel,
    /// The wide tree; `None` where the tree itself is traversed, whose nodes stand for themselves.
    wide: Option<&'a AnyWideTree>,
    known: HashMap<u32, u32>,
}

impl<'a> TreeNodes<'a> {
    pub(super) fn new(accel: &'a Accel, is_wide: bool) -> Self {
        Self { accel, wide: is_wide.then(|| &accel.wide().tree), known: HashMap::new() }
    }

    /// The tree's node of `node`, whose parent was visited; the root's else.
    pub(super) fn of(&self, node: u32) -> u32 {
        if self.wide.is_some() { self.known.get(&node).copied().unwrap_or(0) } else { node }
    }

    /// `node` is a leaf of the traversed tree.
    pub(super) fn is_leaf(&self, node: u32) -> bool {
        match self.wide {
            Some(_) => Child::from_bits(node).is_leaf(),
            None => {
                with_tree!(&self.accel.tree, tree => tree.nodes.get(node as usize).is_none_or(Node::is_leaf))
            }
        }
    }

    /// Names the children of `node`, which is visited.
    pub(super) fn visit(&mut self, node: u32) {
        let child = Child::from_bits(node);
        let Some(wide) = self.wide.filter(|_| !child.is_leaf()) else { return };
        let root = self.of(node);
        let found = match (wide, &self.accel.tree) {
            (AnyWideTree::Aabb(wide), AnyTree::Aabb(tree)) => children(wide, child, tree, root),
            (AnyWideTree::Sphere(wide), AnyTree::Sphere(tree)) => children(wide, child, tree, root),
            (AnyWideTree::Dop14(wide), AnyTree::Dop14(tree)) => children(wide, child, tree, root),
            (AnyWideTree::Oriented(wide), AnyTree::Oriented(tree)) => children(wide, child, tree, root),
            _ => Vec::new(),
        };
        self.known.extend(found);
    }
}

/// The children of a wide node that replaces the node `root`, each with the node whose container it holds. What stands for some
/// of the many children of a node has no node of its own: that one is named instead.
fn children<C: WideContainer>(wide: &WideTree<C>, node: Child, tree: &Tree<C>, root: u32) -> Vec<(u32, u32)> {
    let wide_node = wide.node(node);
    let mut unnamed: Vec<(usize, Child)> = wide.children_of(node).enumerate().collect();
    let mut found = Vec::new();
    let mut level = vec![root];
    for _ in 0..LEVELS {
        level = level.into_iter().flat_map(|node| tree.nodes[node as usize].children()).collect();
        if unnamed.is_empty() || level.len() > MOST_ON_LEVEL {
            break;
        }
        level.retain(|&node| {
            let container = tree.nodes[node as usize].container;
            let named = unnamed.iter().position(|&(lane, _)| wide_node.holds(lane, &container));
            if let Some(at) = named {
                found.push((unnamed.swap_remove(at).1.bits(), node));
            }
            // Descendants of a child belong to it.
            named.is_none()
        });
    }
    found.extend(unnamed.iter().map(|(_, child)| (child.bits(), root)));
    found
}
