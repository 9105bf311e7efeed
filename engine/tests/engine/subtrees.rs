//! The part of a tree below a node as a tree of its own, compared with a plain recursion over the tree that it is taken from.

use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Sphere};
use bvhscope_engine::tree::{AnyTree, Container, Tree};
use bvhscope_engine::with_tree;

use crate::any_arity::{ARITIES, irregular, widened};
use crate::trees;

/// Compares `node` of `tree`, whose first primitive in leaf order is at `slot`, with `own` of `below`; adds to `seen` and `depth` what is there.
fn compare<C: Container>(
    (tree, node): (&Tree<C>, u32),
    (below, own): (&Tree<C>, u32),
    depth: u32,
    seen: &mut (Vec<u32>, usize, u32),
) {
    let (node, own_node) = (&tree.nodes[node as usize], &below.nodes[own as usize]);
    assert_eq!((node.container, node.arity()), (own_node.container, own_node.arity()));
    let primitives = &tree.primitive_indices[node.slots()];
    assert_eq!(primitives, &below.primitive_indices[own_node.slots()]);
    assert!(!own_node.is_leaf() || own_node.first as usize == seen.0.len(), "leaves from left to right");
    seen.0.extend(primitives);
    seen.1 += 1;
    seen.2 = seen.2.max(depth);
    for (child, own_child) in node.children().zip(own_node.children()) {
        assert!(own_child > own, "children follow their parents");
        compare((tree, child), (below, own_child), depth + 1, seen);
    }
}

fn check(tree: &AnyTree) {
    with_tree!(tree, tree => {
        for node in 0..tree.nodes.len() as u32 {
            let below = tree.below(node, &CancelToken::new()).unwrap();
            let mut seen = (Vec::new(), 0, 0);
            compare((tree, node), (&below, 0), 0, &mut seen);
            assert_eq!(seen, (below.primitive_indices.clone(), below.nodes.len(), below.max_depth), "node {node}");
        }
        assert_eq!(&tree.below(0, &CancelToken::new()).unwrap().primitive_indices, &tree.primitive_indices);
    });
}

#[test]
fn what_is_below_a_node_is_a_tree_of_its_own() {
    let triangles = trees::soup(300, 0.1, 41);
    for leaf_size in [1, 3, 300] {
        let binary = trees::halved::<Aabb>(&triangles, leaf_size);
        check(&binary);
        check(&trees::halved::<Sphere>(&triangles, leaf_size));
        for arity in ARITIES {
            check(&widened(&binary, arity));
            check(&irregular(&binary, arity, 7));
        }
    }
}
