//! From nodes to the items of a top-down tree.

use crate::geometry::Aabb;
use crate::kernel::prefetch::prefetch_pair;
use crate::optimize::restructure::item::Item;
use crate::optimize::subtree_costs::Weight;
use crate::tree::Node;

/// Least and most primitives of a treelet.
const TREELET_SIZES: [u32; 2] = [512, 4096];
/// A small scene is divided into about so many.
const TREELETS: u32 = 64;

/// A part of a tree, or all of it.
#[derive(Debug, Clone, Copy)]
pub struct Subtree {
    /// Number of its root.
    pub root: u32,
    /// Its root's.
    pub weight: Weight,
}

/// The treelets that the tree is divided into, from left to right.
pub fn treelets(nodes: &[Node<Aabb>], weights: &[Weight]) -> Vec<Subtree> {
    let [least, most] = TREELET_SIZES;
    let size = (weights[0].count / TREELETS).clamp(least, most);
    let (mut treelets, mut open) = (Vec::new(), vec![0]);
    while let Some(root) = open.pop() {
        let (node, weight) = (&nodes[root as usize], weights[root as usize]);
        if node.is_leaf() || weight.count <= size {
            treelets.push(Subtree { root, weight });
        } else {
            open.extend([node.first + 1, node.first]);
        }
    }
    treelets
}

/// Writes the leaves below `root` to `items`, as many as there are, and where the pairs of siblings on the way stand to `places`.
/// Breadth first, so that loads do not wait for one another.
pub fn gather(nodes: &[Node<Aabb>], root: u32, items: &mut [Item], places: &mut Vec<u32>) {
    let mut items = items.iter_mut();
    let mut add = |node: &Node<Aabb>, places: &mut Vec<u32>| {
        if !node.is_leaf() {
            places.push(node.first);
            prefetch_pair(nodes, node.first as usize);
        } else if let Some(item) = items.next() {
            *item = Item::new(&node.container, node.count, node.first);
        }
    };
    places.clear();
    add(&nodes[root as usize], places);
    let mut at = 0;
    while let Some(&first) = places.get(at) {
        for node in &nodes[first as usize..first as usize + 2] {
            add(node, places);
        }
        at += 1;
    }
}
