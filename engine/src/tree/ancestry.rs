//! Parents and primitive counts of all nodes, and the path from the root to a primitive.

use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use crate::geometry::Triangle;
use crate::kernel::parallel::zeros;

use super::node::{Node, Tree};
use super::validate::containment_slack;
use crate::geometry::Container;

/// Parent and number of primitives of every node. Takes two passes over the tree.
#[derive(Debug, Clone, PartialEq)]
pub struct Ancestry {
    /// Index of the parent of each node; the root has its own.
    pub parents: Vec<u32>,
    /// Number of primitives in the subtree of each node.
    pub primitive_counts: Vec<u32>,
}

impl Ancestry {
    /// The ancestry of the nodes of `tree`.
    pub fn new<C: Container>(tree: &Tree<C>, token: &CancelToken) -> Result<Self, Cancelled> {
        let mut primitive_counts = zeros(tree.nodes.len(), token)?;
        // Backwards, so that children are counted before their parents.
        for (index, node) in tree.nodes.iter().enumerate().rev() {
            token.check_every(LIGHT_STEPS, index)?;
            let below = |child: u32| primitive_counts[child as usize];
            primitive_counts[index] = if node.is_leaf() { node.count } else { node.children().map(below).sum() };
        }
        Ok(Self { parents: tree.parents(token)?, primitive_counts })
    }

    /// Number of steps from the root to `node`.
    pub fn depth(&self, mut node: u32) -> u32 {
        let mut depth = 0;
        while node != 0 {
            node = self.parents[node as usize];
            depth += 1;
        }
        depth
    }
}

/// Indices of the nodes from the root to a leaf of the primitive `primitive_index`, which is `triangle`; empty where no leaf
/// has it. Descends only into nodes whose containers enclose the triangle, which are few. Where none of them has it, as in a
/// tree of split triangles or one whose containers are too small, takes a pass over the tree.
pub fn path_to_primitive<C: Container>(tree: &Tree<C>, triangle: &Triangle, primitive_index: u32) -> Vec<u32> {
    if tree.nodes.is_empty() {
        return Vec::new();
    }
    let slack = containment_slack(tree);
    let corners = [triangle.a, triangle.b, triangle.c];
    let mut path: Vec<u32> = Vec::new();
    let mut stack = vec![(0_u32, 0_usize)];
    while let Some((index, depth)) = stack.pop() {
        path.truncate(depth);
        path.push(index);
        let node = &tree.nodes[index as usize];
        if tree.primitive_indices[node.slots()].contains(&primitive_index) {
            return path;
        }
        for child in node.children().rev() {
            let container = &tree.nodes[child as usize].container;
            if corners.iter().all(|&corner| container.contains_point(corner, slack)) {
                stack.push((child, depth + 1));
            }
        }
    }
    // Parents come before their children: one pass backwards from the leaf finds all nodes above it.
    let holds = |node: &Node<C>| tree.primitive_indices[node.slots()].contains(&primitive_index);
    let Some(leaf) = tree.nodes.iter().position(holds) else { return Vec::new() };
    let mut path = vec![leaf as u32];
    let mut below = leaf as u32;
    for (index, node) in tree.nodes[..leaf].iter().enumerate().rev() {
        if node.children().contains(&below) {
            below = index as u32;
            path.push(below);
        }
    }
    path.reverse();
    path
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::geometry::Aabb;

    fn triangle_at(x: f32) -> Triangle {
        let a = Vec3::new(x, 0.0, 0.0);
        Triangle { a, b: a + Vec3::Y, c: a + Vec3::Z }
    }

    /// Four triangles side by side: ((0 1) (2 3)), stored in reverse.
    fn tree() -> (Tree<Aabb>, [Triangle; 4]) {
        let triangles = [0.0, 1.0, 2.0, 3.0].map(triangle_at);
        let around = |range: std::ops::Range<usize>| {
            triangles[range].iter().fold(Aabb::EMPTY, |bounds, triangle| bounds.union(&triangle.bounds()))
        };
        let node = |container, first, count| Node { container, first, count };
        let nodes = vec![
            node(around(0..4), 1, 0),
            node(around(2..4), 3, 0),
            node(around(0..2), 2, 2),
            node(around(3..4), 0, 1),
            node(around(2..3), 1, 1),
        ];
        (Tree { nodes, primitive_indices: vec![3, 2, 1, 0], max_depth: 2 }, triangles)
    }

    #[test]
    fn counts_and_depths_follow_the_links() {
        let (tree, _) = tree();
        let Ok(ancestry) = Ancestry::new(&tree, &CancelToken::new()) else { panic!("never cancelled") };
        assert_eq!(ancestry.parents, [0, 0, 0, 1, 1]);
        assert_eq!(ancestry.primitive_counts, [4, 2, 2, 1, 1]);
        assert_eq!([0, 1, 2, 3, 4].map(|node| ancestry.depth(node)), [0, 1, 1, 2, 2]);
    }

    #[test]
    fn paths_end_at_the_leaf_of_the_primitive() {
        let (tree, triangles) = tree();
        let paths: Vec<_> = (0..4).map(|i| path_to_primitive(&tree, &triangles[i as usize], i)).collect();
        assert_eq!(paths, [vec![0, 2], vec![0, 2], vec![0, 1, 4], vec![0, 1, 3]]);
        assert_eq!(path_to_primitive(&tree, &triangles[0], 4), Vec::<u32>::new(), "no such primitive");
    }
}
