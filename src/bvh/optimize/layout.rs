//! Brings nodes that were moved about back into the order that a tree promises: depth first, siblings together.

use crate::bvh::{Container, Node, Tree};

/// The same tree with parents before children. Nodes for which `becomes_leaf` is set (none where it is empty) take all primitives
/// below them.
pub fn depth_first<C: Container>(tree: &Tree<C>, becomes_leaf: &[bool]) -> Tree<C> {
    let Some(&root) = tree.nodes.first() else { return tree.clone() };
    let mut nodes = Vec::with_capacity(tree.nodes.len());
    let mut primitive_indices = Vec::with_capacity(tree.primitive_indices.len());
    let mut max_depth = 0;
    nodes.push(root);
    // Where a node was, where it goes, its depth.
    let mut open = vec![(0_u32, 0_u32, 0_u32)];
    let mut below = Vec::new();
    while let Some((from, to, depth)) = open.pop() {
        let node = tree.nodes[from as usize];
        max_depth = max_depth.max(depth);
        if node.is_leaf() || becomes_leaf.get(from as usize) == Some(&true) {
            let first = primitive_indices.len();
            below.push(node);
            while let Some(part) = below.pop() {
                let start = part.first as usize;
                if part.is_leaf() {
                    primitive_indices.extend_from_slice(&tree.primitive_indices[start..start + part.count as usize]);
                } else {
                    below.extend([tree.nodes[start + 1], tree.nodes[start]]);
                }
            }
            let count = (primitive_indices.len() - first) as u32;
            nodes[to as usize] = Node { container: node.container, first: first as u32, count };
        } else {
            let first = nodes.len() as u32;
            nodes.extend_from_slice(&tree.nodes[node.first as usize..node.first as usize + 2]);
            nodes[to as usize].first = first;
            open.extend([(node.first + 1, first + 1, depth + 1), (node.first, first, depth + 1)]);
        }
    }
    Tree { nodes, primitive_indices, max_depth }
}
