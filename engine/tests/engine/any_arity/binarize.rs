//! Binary trees made from those of any arity. That they find the same hits is tested in `hits`.

use std::borrow::Cow;

use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Aabb, Dop14, Sphere};
use bvhscope_engine::tree::binarize::binarize;
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::tree::validate::validate;
use bvhscope_engine::tree::{AnyTree, Container, ContainerKind, Node, Tree};
use bvhscope_engine::with_tree;
use glam::Vec3;

use super::{ARITIES, irregular, widened};
use crate::trees;

fn token() -> CancelToken {
    CancelToken::new()
}

/// The primitives of each leaf with its container, in no particular order.
fn leaves<C: Container>(tree: &Tree<C>) -> Vec<(Vec<u32>, String)> {
    let of = |node: &Node<C>| (tree.primitive_indices[node.slots()].to_vec(), format!("{:?}", node.container));
    let mut leaves: Vec<_> = tree.nodes.iter().filter(|node| node.is_leaf()).map(of).collect();
    leaves.sort();
    leaves
}

#[test]
fn a_binary_tree_has_the_same_leaves_and_is_sound() {
    for (name, triangles) in trees::nasty_scenes() {
        for binary in [
            trees::halved::<Aabb>(&triangles, 1),
            trees::halved::<Sphere>(&triangles, 3),
            trees::halved::<Dop14>(&triangles, 3),
        ] {
            for arity in ARITIES {
                for tree in [widened(&binary, arity), irregular(&binary, arity, 2)] {
                    with_tree!(&tree, tree => {
                        let made = binarize(tree, &token()).unwrap();
                        let name = format!("{name}, {arity}");
                        assert_eq!(made.is_binary(&token()), Ok(true), "{name}");
                        assert_eq!(leaves(&made), leaves(tree), "{name}");
                        assert_eq!(matches!(made, Cow::Borrowed(_)), tree.is_binary(&token()).unwrap(), "{name}");
                        assert_eq!(made, binarize(tree, &token()).unwrap(), "{name}");
                        // The sphere around two children may stick out of that around all of them.
                        if binary.container_kind() == ContainerKind::Aabb {
                            let made = AnyTree::from(made.into_owned());
                            validate(&made, &triangles).unwrap_or_else(|broken| panic!("{name}: {broken}"));
                        }
                    });
                }
            }
        }
    }
}

#[test]
fn the_nearest_children_are_joined_first() {
    let at = |from: f32, to: f32| Aabb { min: Vec3::X * from, max: Vec3::new(to, 1.0, 1.0) };
    let starts = [0.0, 10.0, 3.0, 11.5, 1.0];
    let mut nodes = vec![Node::interior(at(0.0, 12.5), 1, 5)];
    nodes.extend(starts.iter().zip(0..).map(|(&x, first)| Node { container: at(x, x + 1.0), first, count: 1 }));
    let tree = Tree { nodes, primitive_indices: vec![7, 8, 9, 5, 6], max_depth: 1 };
    let made = binarize(&tree, &token()).unwrap();
    // 0 with 1; 10 with 11.5; 0 to 2 with 3. What is joined takes the place of its first part.
    let expected = [
        (at(0.0, 12.5), 1, 0),
        (at(0.0, 4.0), 3, 0),
        (at(10.0, 12.5), 7, 0),
        (at(0.0, 2.0), 5, 0),
        (at(3.0, 4.0), 2, 1),
        (at(0.0, 1.0), 0, 1),
        (at(1.0, 2.0), 1, 1),
        (at(10.0, 11.0), 3, 1),
        (at(11.5, 12.5), 4, 1),
    ];
    let nodes: Vec<_> = made.nodes.iter().map(|node| (node.container, node.first, node.count)).collect();
    assert_eq!(nodes, expected);
    assert_eq!((&made.primitive_indices[..], made.max_depth), (&[7, 6, 9, 8, 5][..], 3));
    // Equally near: the first two, then the result with the third.
    let same = vec![Node { container: at(0.0, 1.0), first: 0, count: 1 }; 4];
    let nodes = std::iter::once(Node::interior(at(0.0, 1.0), 1, 4)).chain(same).collect();
    let tree = Tree { nodes, primitive_indices: vec![0], max_depth: 1 };
    let made = binarize(&tree, &token()).unwrap();
    assert_eq!(made.nodes.iter().map(Node::is_leaf).collect::<Vec<_>>(), [false, false, true, false, true, true, true]);
}

#[test]
fn nodes_with_one_child_are_passed_over() {
    let unit = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
    let leaf = Node { container: unit, first: 0, count: 3 };
    let chain: Vec<_> = (1..=50).map(|next| Node::interior(unit, next, 1)).chain([leaf]).collect();
    let tree = Tree { nodes: chain, primitive_indices: vec![4, 5, 6], max_depth: 50 };
    let made = binarize(&tree, &token()).unwrap();
    assert_eq!(*made, Tree { nodes: vec![leaf], primitive_indices: vec![4, 5, 6], max_depth: 0 });
    assert!(matches!(binarize(&Tree::<Aabb>::EMPTY, &token()), Ok(Cow::Borrowed(_))));
}

/// Joined greedily, a widened tree costs hardly more than the binary one that it was made from.
#[test]
fn joining_keeps_the_quality() {
    let triangles = trees::ball(Vec3::ZERO, 1.0, 40);
    let binary = trees::halved::<Aabb>(&triangles, 1);
    let cost = |tree: &AnyTree| tree_stats(tree, &token()).unwrap().sah_cost;
    for arity in ARITIES {
        let AnyTree::Aabb(wide) = widened(&binary, arity) else { unreachable!("boxes stay boxes") };
        let made = AnyTree::Aabb(binarize(&wide, &token()).unwrap().into_owned());
        assert!(cost(&made) < 1.1 * cost(&binary), "{arity}: {} against {}", cost(&made), cost(&binary));
    }
}

#[test]
fn a_cancelled_tree_is_not_made() {
    let tree = widened(&trees::halved::<Aabb>(&trees::soup(50_000, 0.1, 1), 1), 8);
    let cancelled = CancelToken::new();
    cancelled.cancel();
    with_tree!(&tree, tree => assert_eq!(binarize(tree, &cancelled).err(), Some(Cancelled)));
}
