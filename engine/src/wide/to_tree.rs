//! The wide tree as a [`Tree`] of nodes with up to eight children, by which it is shown, written and measured like any other.

use super::bounds::WideContainer;
use super::child::Child;
use super::tree::{AnyWideTree, WideTree};
use crate::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use crate::tree::{AnyTree, Node, Tree};

impl<C: WideContainer> WideTree<C> {
    /// The same hierarchy with the same leaves, numbered depth first, siblings together. `binary` is the tree that it was made
    /// from: a wide tree does not store the container of its root. A triangle that a leaf holds twice, as splitting may leave it, is
    /// there once.
    pub fn to_tree(&self, binary: &Tree<C>, token: &CancelToken) -> Result<Tree<C>, Cancelled> {
        token.check()?;
        let (Some(first), Some(root)) = (self.root, binary.nodes.first()) else { return Ok(Tree::EMPTY) };
        let mut nodes = vec![Node { container: root.container, first: 0, count: 0 }];
        let mut primitive_indices = Vec::with_capacity(self.leaves.triangle_count());
        let (mut steps, mut max_depth) = (0_usize, 0);
        // Nodes still to be written: the reference, its number and its depth.
        let mut open = vec![(first, 0, 0_u32)];
        while let Some((child, number, depth)) = open.pop() {
            steps += 1;
            token.check_every(MEDIUM_STEPS, steps)?;
            max_depth = depth.max(max_depth);
            let container = nodes[number].container;
            if child.is_leaf() {
                let first = primitive_indices.len();
                for block in self.leaves.blocks(child) {
                    steps += 1;
                    token.check_every(MEDIUM_STEPS, steps)?;
                    for index in (0..block.count()).map(|lane| block.primitive_index(lane)) {
                        if primitive_indices[first..].last() != Some(&index) {
                            primitive_indices.push(index);
                        }
                    }
                }
                let count = (primitive_indices.len() - first) as u32;
                nodes[number] = Node { container, first: first as u32, count };
                continue;
            }
            let first = nodes.len();
            let node = self.node(child);
            for (lane, _) in self.children_of(child).enumerate() {
                nodes.push(Node { container: node.load_within(lane, &container), first: 0, count: 0 });
            }
            nodes[number] = Node::interior(container, first as u32, (nodes.len() - first) as u32);
            let numbers = first..nodes.len();
            let children = self.children_of(child);
            let before = open.len();
            open.extend(children.zip(numbers).map(|(child, number): (Child, usize)| (child, number, depth + 1)));
            open[before..].reverse();
        }
        Ok(Tree { nodes, primitive_indices, max_depth })
    }
}

impl AnyWideTree {
    /// The same hierarchy as a tree of nodes with up to eight children; see [`WideTree::to_tree`]. `binary` is the tree that it
    /// was made from; `None` where that is one of another container.
    pub fn to_tree(&self, binary: &AnyTree, token: &CancelToken) -> Result<Option<AnyTree>, Cancelled> {
        Ok(match (self, binary) {
            (Self::Aabb(wide), AnyTree::Aabb(binary)) => Some(wide.to_tree(binary, token)?.into()),
            (Self::Sphere(wide), AnyTree::Sphere(binary)) => Some(wide.to_tree(binary, token)?.into()),
            (Self::Dop14(wide), AnyTree::Dop14(binary)) => Some(wide.to_tree(binary, token)?.into()),
            (Self::Oriented(wide), AnyTree::Oriented(binary)) => Some(wide.to_tree(binary, token)?.into()),
            _ => None,
        })
    }
}
