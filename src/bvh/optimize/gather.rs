//! Between nodes and the items of a top-down tree.

use super::item::{Item, NEW};
use super::weigh::Weight;
use crate::bvh::Node;
use crate::geometry::Aabb;

/// Least and most primitives of a treelet.
const TREELET_SIZES: [u32; 2] = [512, 4096];
/// A small scene is divided into about so many.
const TREELETS: u32 = 64;

/// The roots of the treelets that the tree is divided into, from left to right.
pub fn treelet_roots(nodes: &[Node<Aabb>], weights: &[Weight]) -> Vec<u32> {
    let [least, most] = TREELET_SIZES;
    let size = (weights[0].count / TREELETS).clamp(least, most);
    let (mut roots, mut open) = (Vec::new(), vec![0]);
    while let Some(at) = open.pop() {
        let node = &nodes[at as usize];
        if node.is_leaf() || weights[at as usize].count <= size {
            roots.push(at);
        } else {
            open.extend([node.first + 1, node.first]);
        }
    }
    roots
}

/// What lies below a node.
#[derive(Debug, Default)]
pub struct Leaves {
    /// Its leaves.
    pub items: Vec<Item>,
    /// Where its pairs of siblings stand.
    pub places: Vec<u32>,
}

impl Leaves {
    /// Everything below `root`. Breadth first, so that loads do not wait for one another.
    pub fn below(nodes: &[Node<Aabb>], root: u32) -> Self {
        let mut leaves = Self::default();
        leaves.add(&nodes[root as usize]);
        let mut at = 0;
        while let Some(&first) = leaves.places.get(at) {
            for node in &nodes[first as usize..first as usize + 2] {
                leaves.add(node);
            }
            at += 1;
        }
        leaves
    }

    fn add(&mut self, node: &Node<Aabb>) {
        if node.is_leaf() {
            self.items.push(Item::new(&node.container, node.count, node.first));
        } else {
            self.places.push(node.first);
        }
    }
}

/// The node that `item` becomes, with the place of the new pair below it.
pub fn node_of(item: &Item, place_of: impl Fn(u32) -> u32) -> Node<Aabb> {
    let container = item.container();
    if item.link & NEW == 0 {
        Node { container, first: item.link, count: item.count }
    } else {
        Node { container, first: place_of(item.link & !NEW), count: 0 }
    }
}
