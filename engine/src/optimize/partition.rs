//! Partition of a tree into a top and the subtrees below it: enough for many threads, each small enough for one.

use crate::tree::Node;

/// Average number of nodes of a subtree, whose data should fit a core's second-level cache.
const SUBTREE_NODES: usize = 1024;
/// Number of nodes from which on a subtree is subdivided.
pub const MAX_SUBTREE_NODES: usize = 8 * SUBTREE_NODES;
/// Maximum number of nodes in the top, which is processed sequentially.
const MAX_TOP_NODES: usize = 4096;
/// Number of nodes by which the top grows where a subtree is too large.
const EXTRA_TOP_NODES: usize = 32;

/// A node of the top, or the root of a subtree below it.
#[derive(Debug, Clone, Copy)]
pub struct PartitionNode {
    /// Index in the tree.
    pub node: u32,
    /// Index of the first child in the partition; 0 for the root of a subtree.
    pub children: u32,
}

/// Partitions a tree. The list is breadth first: parents precede their children.
pub fn partition<C>(nodes: &[Node<C>]) -> Vec<PartitionNode> {
    let mut list = vec![PartitionNode { node: 0, children: 0 }];
    expand(&mut list, nodes, 0, (nodes.len() / SUBTREE_NODES).min(MAX_TOP_NODES));
    list
}

/// Subdivides the subtree at `index` in `list`, to which the new ones are appended.
pub fn subdivide<C>(list: &mut Vec<PartitionNode>, nodes: &[Node<C>], index: usize) {
    expand(list, nodes, index, EXTRA_TOP_NODES);
}

/// Moves up to `max_nodes` nodes to the top, breadth first: the one at `index`, then those appended to `list`.
fn expand<C>(list: &mut Vec<PartitionNode>, nodes: &[Node<C>], mut index: usize, max_nodes: usize) {
    let (mut next, mut expanded) = (list.len(), 0);
    while index < list.len() && expanded < max_nodes {
        let node = &nodes[list[index].node as usize];
        if !node.is_leaf() {
            list[index].children = list.len() as u32;
            list.extend([node.first, node.first + 1].map(|node| PartitionNode { node, children: 0 }));
            expanded += 1;
        }
        (index, next) = (next, next + 1);
    }
}
