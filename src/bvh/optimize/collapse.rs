//! Leaf collapse: a subtree becomes one leaf where testing its primitives one after the other is cheaper by the surface area
//! heuristic (Goldsmith, Salmon, *Automatic Creation of Object Hierarchies*, 1987; its best cut is found bottom-up).

use super::below::below;
use crate::bvh::{Container, Node};

/// Most primitives in a leaf that a collapse makes: flat and coinciding triangles would give leaves without end.
const MAX_LEAF_SIZE: u32 = 32;

/// For each node whether it becomes a leaf. `nodes` may stand in any order.
pub fn cheaper_as_leaves<C: Container>(nodes: &[Node<C>]) -> Vec<bool> {
    below(nodes)
        .iter()
        .zip(nodes)
        .map(|(below, node)| below.primitives <= MAX_LEAF_SIZE && below.is_best_as_leaf(node.container.relative_area()))
        .collect()
}
