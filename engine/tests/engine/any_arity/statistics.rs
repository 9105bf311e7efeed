//! Statistics of trees of every arity against sums over their nodes, and what the validator refuses.

use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Aabb, Dop14, Sphere};
use bvhscope_engine::tree::statistics::{INTERSECTION_COST, collapsed_sah_cost, tree_stats};
use bvhscope_engine::tree::validate::validate;
use bvhscope_engine::tree::{AnyTree, Container, Node, Tree};
use bvhscope_engine::with_tree;

use super::{ARITIES, for_each_below, irregular, widened};
use crate::trees;

/// One more in an element of a list, which grows as needed.
fn count(list: &mut Vec<u32>, index: u32) {
    list.resize(list.len().max(index as usize + 1), 0);
    list[index as usize] += 1;
}

/// Least cost of a node's subtree where any subtree may be a leaf, and its number of primitives.
fn collapsed<C: Container>(tree: &Tree<C>, node: u32) -> (f64, u32) {
    let own = &tree.nodes[node as usize];
    let area = f64::from(own.container.relative_area());
    let below = own.children().map(|child| collapsed(tree, child));
    let (cost, count) = below.fold((0.0, own.slots().len() as u32), |sum, below| (sum.0 + below.0, sum.1 + below.1));
    let as_leaf = area * f64::from(count) * f64::from(INTERSECTION_COST);
    (if own.is_leaf() { as_leaf } else { as_leaf.min(area * f64::from(C::KIND.traversal_cost()) + cost) }, count)
}

fn check<C: Container>(name: &str, any: &AnyTree, tree: &Tree<C>) {
    let stats = tree_stats(any, &CancelToken::new()).unwrap();
    let (mut cost, mut depths, mut leaves, mut highest) = (0.0, 0_u64, 0, u32::MAX);
    let (mut per_depth, mut sizes, mut arities) = (Vec::new(), vec![0], Vec::new());
    for_each_below(tree, 0, [0, 0], &mut |node, depth, _| {
        let node = &tree.nodes[node as usize];
        count(&mut per_depth, depth);
        let area = f64::from(node.container.relative_area());
        if node.is_leaf() {
            leaves += 1;
            depths += u64::from(depth);
            highest = highest.min(depth);
            count(&mut sizes, node.count);
            cost += area * f64::from(node.count) * f64::from(INTERSECTION_COST);
        } else {
            count(&mut arities, node.arity());
            cost += area * f64::from(C::KIND.traversal_cost());
        }
    });
    let root = f64::from(tree.nodes[0].container.relative_area());
    let close = |value: f64, expected: f64| assert!((value - expected).abs() <= 1e-6 * expected, "{name}: {value}");
    close(stats.sah_cost.into(), cost / root);
    close(collapsed_sah_cost(any), collapsed(tree, 0).0 / root);
    close(stats.mean_leaf_depth.into(), depths as f64 / f64::from(leaves));
    let interior: u32 = arities.iter().sum();
    close(stats.mean_arity.into(), (tree.nodes.len() - 1) as f64 / f64::from(interior.max(1)));
    assert_eq!((stats.nodes, stats.leaves), (tree.nodes.len(), leaves as usize), "{name}");
    assert_eq!((stats.min_leaf_depth, stats.max_depth as usize), (highest, per_depth.len() - 1), "{name}");
    assert_eq!(stats.max_arity as usize, arities.len().saturating_sub(1), "{name}");
    assert_eq!((stats.nodes_per_depth, stats.leaf_size_histogram), (per_depth, sizes), "{name}");
    assert_eq!(stats.arity_histogram, arities, "{name}");
    assert_eq!(tree.is_binary(&CancelToken::new()), Ok(arities_are_two(tree)), "{name}");
}

fn arities_are_two<C>(tree: &Tree<C>) -> bool {
    tree.nodes.iter().all(|node| node.is_leaf() || node.arity() == 2)
}

#[test]
fn statistics_are_sums_over_all_nodes() {
    // The larger trees have more than the 4,096 pairs at a depth from which threads share the work.
    for triangles in [trees::soup(1, 0.2, 1), trees::soup(700, 0.2, 2), trees::soup(20_000, 0.05, 3)] {
        for binary in [
            trees::halved::<Aabb>(&triangles, 1),
            trees::halved::<Sphere>(&triangles, 3),
            trees::halved::<Dop14>(&triangles, 3),
        ] {
            for arity in ARITIES {
                for tree in [widened(&binary, arity), irregular(&binary, arity, 5)] {
                    let name = format!("{} triangles, {arity}", triangles.len());
                    with_tree!(&tree, tree => check(&name, &tree.clone().into(), tree));
                }
            }
        }
    }
}

/// A single node of another arity far below, where the sums are made by many threads.
#[test]
fn one_node_of_three_children_is_not_overlooked() {
    let triangles = trees::soup(20_000, 0.05, 3);
    let AnyTree::Aabb(mut tree) = trees::halved::<Aabb>(&triangles, 1) else { unreachable!("asked for boxes") };
    let stats = |tree: &Tree<Aabb>| tree_stats(&AnyTree::Aabb(tree.clone()), &CancelToken::new()).unwrap();
    let before = stats(&tree);
    assert!(before.is_binary() && tree.is_binary(&CancelToken::new()).unwrap());
    // A leaf becomes a node with three leaves, one of which has its triangle and two that of its neighbour again.
    let leaf = tree.nodes.iter().rposition(Node::is_leaf).unwrap();
    let old = tree.nodes[leaf];
    let first = tree.nodes.len() as u32;
    tree.nodes.extend([old; 3]);
    tree.nodes[leaf] = Node::interior(old.container, first, 3);
    check("one of three", &AnyTree::Aabb(Tree { max_depth: depth(&tree), ..tree.clone() }), &tree);
    let after = stats(&tree);
    assert_eq!((after.max_arity, after.arity_histogram[3], after.is_binary()), (3, 1, false));
    assert_eq!(tree.is_binary(&CancelToken::new()), Ok(false));
    let token = CancelToken::new();
    token.cancel();
    assert_eq!(tree.is_binary(&token), Err(Cancelled));
    assert_eq!(tree_stats(&AnyTree::Aabb(tree), &token), Err(Cancelled));
}

fn depth<C: Container>(tree: &Tree<C>) -> u32 {
    tree.depths(&CancelToken::new()).unwrap().into_iter().max().unwrap()
}

#[test]
fn the_validator_finds_damage_in_wide_nodes() {
    let triangles = trees::soup(60, 0.2, 1);
    let AnyTree::Aabb(sound) = widened(&trees::halved::<Aabb>(&triangles, 3), 4) else { unreachable!("boxes") };
    assert_eq!(validate(&AnyTree::Aabb(sound.clone()), &triangles), Ok(()));
    let found = |damage: fn(&mut Tree<Aabb>), words: &str| {
        let mut tree = sound.clone();
        damage(&mut tree);
        let complaint = validate(&AnyTree::Aabb(tree), &triangles).expect_err("the damage must be found");
        assert!(complaint.contains(words), "'{complaint}' should say '{words}'");
    };
    found(|tree| tree.nodes[0].count = 1 << 31, "has 0 children instead of 1 to 32");
    found(|tree| tree.nodes[0].count = 1 << 31 | 33, "has 33 children");
    found(|tree| tree.nodes[0].count = 1 << 31 | 3, "not reached");
    found(|tree| tree.nodes[0].count = 1 << 31 | 5, "two parents");
    found(|tree| tree.nodes[4].container.max.z += 10.0, "node 4 sticks out of its parent 0");
    // The last two children of the root change places: the slots below it are no longer in order.
    found(
        |tree| {
            let (third, fourth) = (tree.nodes[3], tree.nodes[4]);
            (tree.nodes[3], tree.nodes[4]) = (fourth, third);
        },
        "no neighbours",
    );
}
