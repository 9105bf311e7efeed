//! Treelets of a tree, and their leaves as items of a top-down build.

use crate::geometry::Aabb;
use crate::kernel::prefetch::prefetch_pair;
use crate::optimize::restructure::item::Item;
use crate::optimize::subtree_costs::SubtreeCost;
use crate::tree::Node;

/// Minimum and maximum number of primitives in a treelet.
const TREELET_SIZE_RANGE: [u32; 2] = [512, 4096];
/// Approximate number of treelets in a small scene.
const TARGET_TREELETS: u32 = 64;

/// A subtree, or the whole tree.
#[derive(Debug, Clone, Copy)]
pub struct Subtree {
    /// Index of the root.
    pub root: u32,
    /// Cost of the root.
    pub cost: SubtreeCost,
}

impl Subtree {
    /// A subtree of about half of the size of a treelet that stands for this one: down by the larger sides.
    pub fn sample(mut self, nodes: &[Node<Aabb>], costs: &[SubtreeCost]) -> Self {
        let max = treelet_size(costs) / 2;
        while self.cost.count > max && !nodes[self.root as usize].is_leaf() {
            let first = nodes[self.root as usize].first;
            let pair = [first, first + 1].map(|root| Self { root, cost: costs[root as usize] });
            self = pair[usize::from(pair[1].cost.count > pair[0].cost.count)];
        }
        self
    }
}

/// Divides a tree into treelets, from left to right.
pub fn treelets(nodes: &[Node<Aabb>], costs: &[SubtreeCost]) -> Vec<Subtree> {
    let size = treelet_size(costs);
    let (mut treelets, mut stack) = (Vec::new(), vec![0]);
    while let Some(root) = stack.pop() {
        let (node, cost) = (&nodes[root as usize], costs[root as usize]);
        if node.is_leaf() || cost.count <= size {
            treelets.push(Subtree { root, cost });
        } else {
            stack.extend([node.first + 1, node.first]);
        }
    }
    treelets
}

/// Maximum number of primitives in a treelet of the tree with these `costs`.
fn treelet_size(costs: &[SubtreeCost]) -> u32 {
    let [min, max] = TREELET_SIZE_RANGE;
    (costs[0].count / TARGET_TREELETS).clamp(min, max)
}

/// Writes the leaves below `root` to `items`, as many as there are, and the indices of all pairs of siblings to
/// `pair_slots`. Breadth first, so that loads do not depend on one another.
pub fn collect_leaves(nodes: &[Node<Aabb>], root: u32, items: &mut [Item], pair_slots: &mut Vec<u32>) {
    let mut items = items.iter_mut();
    let mut add = |node: &Node<Aabb>, pair_slots: &mut Vec<u32>| {
        if !node.is_leaf() {
            pair_slots.push(node.first);
            prefetch_pair(nodes, node.first as usize);
        } else if let Some(item) = items.next() {
            *item = Item::new(&node.container, node.count, node.first);
        }
    };
    pair_slots.clear();
    add(&nodes[root as usize], pair_slots);
    let mut index = 0;
    while let Some(&first) = pair_slots.get(index) {
        for node in &nodes[first as usize..first as usize + 2] {
            add(node, pair_slots);
        }
        index += 1;
    }
}
