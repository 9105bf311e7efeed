//! The top of a tree and the subtrees below it, which are enough for many threads and small enough for one.

use crate::bvh::Node;

/// Nodes of a subtree below the top, on average: what a task makes of it should fit a core's second cache.
const SHARE_NODES: usize = 1024;
/// Most nodes of the top, which one thread looks at.
const MAX_TOP_NODES: usize = 4096;

/// A node of the top, or the root of a subtree below it.
#[derive(Debug, Clone, Copy)]
pub struct Share {
    /// Its number in the tree.
    pub node: u32,
    /// Where its children are in the list; 0 for the root of a subtree.
    pub children: u32,
}

/// Breadth first, so that parents come before their children.
pub fn shares<C>(nodes: &[Node<C>]) -> Vec<Share> {
    let top_nodes = (nodes.len() / SHARE_NODES).min(MAX_TOP_NODES);
    let mut list = vec![Share { node: 0, children: 0 }];
    let (mut at, mut opened) = (0, 0);
    while at < list.len() && opened < top_nodes {
        let node = &nodes[list[at].node as usize];
        if !node.is_leaf() {
            list[at].children = list.len() as u32;
            list.extend([node.first, node.first + 1].map(|node| Share { node, children: 0 }));
            opened += 1;
        }
        at += 1;
    }
    list
}
