//! The wide tree as a [`Tree`] of nodes with up to eight children, by which it is shown, written and measured like any other.

use super::block::TriangleBlock;
use super::bounds::WideContainer;
use super::tree::{AnyWideTree, Child, WideTree};
use crate::cancel::{CancelToken, Cancelled};
use crate::tree::{AnyTree, Node, Tree};

/// Nodes and blocks between two polls for cancellation.
const STEPS_BETWEEN_CHECKS: usize = 1 << 14;

impl<C: WideContainer> WideTree<C> {
    /// The same hierarchy with the same leaves, numbered depth first, siblings together. `root` is the container of the whole
    /// tree, which a wide tree does not store. A triangle that a leaf holds twice, as splitting may leave it, is there once.
    pub fn to_tree(&self, root: C, token: &CancelToken) -> Result<Tree<C>, Cancelled> {
        token.check()?;
        let Some(first) = self.root else { return Ok(Tree::EMPTY) };
        let mut nodes = vec![Node { container: root, first: 0, count: 0 }];
        let mut primitive_indices = Vec::with_capacity(self.blocks.len());
        let (mut steps, mut max_depth) = (0_usize, 0);
        // What is still to be written: the reference, its number and its depth.
        let mut open = vec![(first, 0, 0_u32)];
        while let Some((child, number, depth)) = open.pop() {
            steps += 1;
            if steps.is_multiple_of(STEPS_BETWEEN_CHECKS) {
                token.check()?;
            }
            max_depth = depth.max(max_depth);
            let container = nodes[number].container;
            if child.is_leaf() {
                let first = primitive_indices.len();
                for block in &self.blocks[child.index()..] {
                    steps += 1;
                    if steps.is_multiple_of(STEPS_BETWEEN_CHECKS) {
                        token.check()?;
                    }
                    primitive_indices.extend(distinct(block));
                    if block.is_last() {
                        break;
                    }
                }
                let count = (primitive_indices.len() - first) as u32;
                nodes[number] = Node { container, first: first as u32, count };
                continue;
            }
            let first = nodes.len();
            for (_, container) in self.children_of(child.index()) {
                nodes.push(Node { container, first: 0, count: 0 });
            }
            nodes[number] = Node::interior(container, first as u32, (nodes.len() - first) as u32);
            let numbers = first..nodes.len();
            let children = self.children_of(child.index()).map(|(child, _)| child);
            let before = open.len();
            open.extend(children.zip(numbers).map(|(child, number): (Child, usize)| (child, number, depth + 1)));
            open[before..].reverse();
        }
        Ok(Tree { nodes, primitive_indices, max_depth })
    }
}

/// The triangles of a block without those that fill its unused lanes: repetitions of the last.
fn distinct(block: &TriangleBlock) -> impl Iterator<Item = u32> {
    (0..crate::wide::layout::BLOCK)
        .filter(|&lane| lane == 0 || block.primitive_index(lane) != block.primitive_index(lane - 1))
        .map(|lane| block.primitive_index(lane))
}

impl AnyWideTree {
    /// The same hierarchy as a tree of nodes with up to eight children; see [`WideTree::to_tree`]. `binary` is the tree that it
    /// was made from; `None` where that is one of the other container.
    pub fn to_tree(&self, binary: &AnyTree, token: &CancelToken) -> Result<Option<AnyTree>, Cancelled> {
        match (self, binary) {
            (Self::Aabb(wide), AnyTree::Aabb(binary)) => {
                let Some(root) = binary.nodes.first() else {
                    return Ok(Some(Tree::<crate::geometry::Aabb>::EMPTY.into()));
                };
                wide.to_tree(root.container, token).map(|tree| Some(tree.into()))
            }
            (Self::Sphere(wide), AnyTree::Sphere(binary)) => {
                let Some(root) = binary.nodes.first() else {
                    return Ok(Some(Tree::<crate::geometry::Sphere>::EMPTY.into()));
                };
                wide.to_tree(root.container, token).map(|tree| Some(tree.into()))
            }
            _ => Ok(None),
        }
    }
}
