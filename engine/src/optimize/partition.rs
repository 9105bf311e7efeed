//! The top of a tree and the subtrees below it, which are enough for many threads and small enough for one.

use crate::tree::Node;

/// Nodes of a subtree below the top, on average: what a task makes of it should fit a core's second cache.
const SHARE_NODES: usize = 1024;
/// Nodes from which on a subtree is divided further.
pub const MAX_SHARE_NODES: usize = 8 * SHARE_NODES;
/// Most nodes of the top, which one thread looks at.
const MAX_TOP_NODES: usize = 4096;
/// Nodes by which the top grows where a subtree is too large.
const MORE_TOP_NODES: usize = 32;

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
    let mut list = vec![Share { node: 0, children: 0 }];
    open(&mut list, nodes, 0, (nodes.len() / SHARE_NODES).min(MAX_TOP_NODES));
    list
}

/// Divides the subtree at `at` in `list`; the new ones are put behind.
pub fn divide<C>(list: &mut Vec<Share>, nodes: &[Node<C>], at: usize) {
    open(list, nodes, at, MORE_TOP_NODES);
}

/// Takes `most` nodes to the top: that at `at`, then those behind the end, breadth first.
fn open<C>(list: &mut Vec<Share>, nodes: &[Node<C>], mut at: usize, most: usize) {
    let (mut next, mut opened) = (list.len(), 0);
    while at < list.len() && opened < most {
        let node = &nodes[list[at].node as usize];
        if !node.is_leaf() {
            list[at].children = list.len() as u32;
            list.extend([node.first, node.first + 1].map(|node| Share { node, children: 0 }));
            opened += 1;
        }
        (at, next) = (next, next + 1);
    }
}
