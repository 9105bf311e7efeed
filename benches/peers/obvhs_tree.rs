//! The trees of obvhs as trees of this crate.

use bvhscope_engine::geometry::Aabb;
use bvhscope_engine::tree::Tree;
use obvhs::bvh2::Bvh2;
use obvhs::cwbvh::CwBvh;

use crate::foreign::{Below, tree_below};

/// A binary tree.
pub fn binary(tree: &Bvh2) -> Tree<Aabb> {
    if tree.primitive_indices.is_empty() {
        return Tree::EMPTY;
    }
    tree_below(0_u32, |&index| {
        let node = &tree.nodes[index as usize];
        let (first, count) = (node.first_index as usize, node.prim_count as usize);
        let below = if count > 0 {
            Below::Primitives(&tree.primitive_indices[first..first + count])
        } else {
            Below::Children(vec![node.first_index, node.first_index + 1])
        };
        (bounds(*node.aabb()), below)
    })
}

/// A child of a compressed node, with its box in the grid of that node.
struct WideChild {
    bounds: Aabb,
    item: Item,
}

enum Item {
    Node(u32),
    Leaf { first: u32, count: u32 },
}

/// An 8-wide tree, with the boxes that its quantised numbers mean. Each node has a grid of its own, so that the boxes of
/// children may stick out of the node's by a part of a cell.
pub fn wide(tree: &CwBvh) -> Tree<Aabb> {
    if tree.primitive_indices.is_empty() {
        return Tree::EMPTY;
    }
    let root = WideChild { bounds: bounds(tree.total_aabb), item: Item::Node(0) };
    tree_below(root, |child| {
        let below = match child.item {
            Item::Leaf { first, count } => {
                Below::Primitives(&tree.primitive_indices[first as usize..(first + count) as usize])
            }
            Item::Node(index) => {
                let node = &tree.nodes[index as usize];
                let slots = (0..8).filter(|&slot| !node.is_child_empty(slot));
                let child = |slot| {
                    let item = if node.is_leaf(slot) {
                        let (first, count) = node.child_primitives(slot);
                        Item::Leaf { first, count }
                    } else {
                        Item::Node(node.child_node_index(slot))
                    };
                    WideChild { bounds: bounds(node.child_aabb(slot)), item }
                };
                Below::Children(slots.map(child).collect())
            }
        };
        (child.bounds, below)
    })
}

fn bounds(aabb: obvhs::aabb::Aabb) -> Aabb {
    Aabb { min: aabb.min.into(), max: aabb.max.into() }
}
