//! Trees whose nodes have any number of children: made here from binary ones, and compared with counts by hand, with brute
//! force, and with plain recursions over their nodes.

mod binarize;
mod hits;
mod n_ary_by_hand;
mod n_ary_nodes;
mod n_ary_visits;
mod statistics;

use bvhscope_engine::tree::{AnyTree, Container, Node, Tree};
use bvhscope_engine::with_tree;

use crate::random::Random;

/// The numbers of children that trees are tested with.
pub const ARITIES: [usize; 5] = [2, 3, 4, 8, 32];

/// The leaves of a binary tree below nodes of up to `arity` children: each takes in its largest children that are interior
/// nodes until it has as many.
pub fn widened(tree: &AnyTree, arity: usize) -> AnyTree {
    with_tree!(tree, tree => opened(tree, || arity).into())
}

/// [`widened`] with another number of children for each node, up to `arity`, of one node in eight a single child.
pub fn irregular(tree: &AnyTree, arity: usize, seed: u64) -> AnyTree {
    let mut random = Random(seed);
    with_tree!(tree, tree => opened(tree, || if random.below(8) == 0 { 1 } else { 2 + random.below(arity - 1) }).into())
}

/// The leaves of a binary tree below nodes of `arity()` children, as far as there are so many. Leaves keep their slots.
fn opened<C: Container>(tree: &Tree<C>, mut arity: impl FnMut() -> usize) -> Tree<C> {
    let mut wide = Tree { nodes: Vec::new(), primitive_indices: tree.primitive_indices.clone(), max_depth: 0 };
    wide.nodes.extend(tree.nodes.first());
    let mut open: Vec<(u32, usize, u32)> = tree.nodes.first().map(|_| (0, 0, 0)).into_iter().collect();
    while let Some((source, at, depth)) = open.pop() {
        let node = tree.nodes[source as usize];
        wide.max_depth = wide.max_depth.max(depth);
        if node.is_leaf() {
            wide.nodes[at] = node;
            continue;
        }
        let arity = arity();
        let mut children: Vec<u32> = if arity == 1 { vec![source] } else { node.children().collect() };
        while children.len() < arity && arity > 1 {
            let area = |child: &u32| tree.nodes[*child as usize].container.relative_area();
            let interior = (0..children.len()).filter(|&at| !tree.nodes[children[at] as usize].is_leaf());
            let Some(largest) = interior.max_by(|&a, &b| area(&children[a]).total_cmp(&area(&children[b]))) else {
                break;
            };
            children.splice(largest..=largest, tree.nodes[children[largest] as usize].children());
        }
        let first = wide.nodes.len();
        wide.nodes[at] = Node::interior(node.container, first as u32, children.len() as u32);
        wide.nodes.extend(children.iter().map(|_| node));
        open.extend(children.iter().zip(first..).map(|(&child, at)| (child, at, depth + 1)));
    }
    wide
}

/// Calls `visit` with each node from `node` down, its depth and its parent: parents first, children in order.
pub fn for_each_below<C: Container>(
    tree: &Tree<C>,
    node: u32,
    [depth, parent]: [u32; 2],
    visit: &mut impl FnMut(u32, u32, u32),
) {
    visit(node, depth, parent);
    for child in tree.nodes[node as usize].children() {
        for_each_below(tree, child, [depth + 1, node], visit);
    }
}

#[test]
fn nodes_say_what_they_are() {
    for arity in 1..=32 {
        let node = Node::interior((), 7, arity);
        assert!(!node.is_leaf() && node.slots().is_empty());
        assert_eq!((node.arity(), node.children()), (arity, 7..7 + arity));
        assert_eq!(node.count == 0, arity == 2, "as the builders make them");
    }
    for count in [1, 2, 1_000_000, i32::MAX as u32] {
        let leaf = Node { container: (), first: 7, count };
        assert!(leaf.is_leaf() && leaf.children().is_empty());
        assert_eq!((leaf.arity(), leaf.slots()), (0, 7..7 + count as usize));
    }
}

#[test]
fn the_trees_of_these_tests_have_the_arity_they_claim() {
    let tree = crate::trees::halved::<bvhscope_engine::Aabb>(&crate::trees::soup(5_000, 0.2, 1), 1);
    for arity in ARITIES {
        let largest = |tree: &AnyTree| with_tree!(tree, tree => tree.nodes.iter().map(Node::arity).max().unwrap());
        assert_eq!(largest(&widened(&tree, arity)), arity as u32);
        let AnyTree::Aabb(mixed) = irregular(&tree, arity, 3) else { unreachable!("boxes stay boxes") };
        for children in [1, arity as u32] {
            assert!(mixed.nodes.iter().any(|node| node.arity() == children), "{children} of {arity}");
        }
    }
    assert_eq!(widened(&tree, 2).node_count(), tree.node_count());
}
