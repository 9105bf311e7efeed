//! Subtrees beside the exact ones of the same leaves.

use std::collections::BTreeSet;

use bvhscope_engine::builders::{BuildError, build_binary};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::construction::{DifferentMerge, ExactComparison, Timeline, compare_with_exact};
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Passes};
use bvhscope_engine::tree::ancestry::Ancestry;
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::tree::validate::validate;
use bvhscope_engine::tree::{AnyTree, Container, ContainerKind};
use bvhscope_engine::with_tree;

use crate::trees;

fn built(triangles: &[Triangle], settings: &BuildSettings) -> AnyTree {
    build_binary(triangles, settings, &CancelToken::new()).unwrap().0
}

fn compared(tree: &AnyTree, root: u32) -> ExactComparison {
    compare_with_exact(tree, root, &CancelToken::new()).unwrap()
}

#[test]
fn the_exact_tree_is_that_of_the_exact_builder() {
    let triangles = trees::soup(1_200, 0.1, 107);
    for container in ContainerKind::ALL {
        let settings = BuildSettings { container, ..BuildSettings::default() };
        let (aac, exact) = (
            built(&triangles, &settings),
            built(&triangles, &BuildSettings { builder: BuilderKind::Exact, ..settings }),
        );
        let comparison = compared(&aac, 0);
        assert_eq!(comparison.exact, exact);
        assert_eq!(comparison.leaves, 1_200);
        let cost = |tree: &AnyTree| f64::from(tree_stats(tree, &CancelToken::new()).unwrap().sah_cost);
        assert!((comparison.cost / cost(&aac) - 1.0).abs() < 1e-5);
        // Both roots are boxes around everything, and the spheres differ by little.
        assert!(
            (comparison.exact_cost / cost(&exact) - 1.0).abs()
                < if container == ContainerKind::Aabb { 1e-5 } else { 0.2 }
        );
        assert!((comparison.ratio() - comparison.cost / comparison.exact_cost).abs() < 1e-12);
        assert!(comparison.first_difference.is_some() && comparison.exact_difference.is_some());

        let same = compared(&exact, 0);
        assert!((same.exact == exact, same.ratio(), same.first_difference) == (true, 1.0, None));
        assert_eq!(same.exact_difference, None);
    }
}

/// The primitives below `node`.
fn primitives_below(any: &AnyTree, node: u32) -> BTreeSet<u32> {
    with_tree!(any, tree => {
        let (mut found, mut open) = (BTreeSet::new(), vec![node]);
        while let Some(index) = open.pop() {
            let node = &tree.nodes[index as usize];
            if node.is_leaf() {
                found.extend(&tree.primitive_indices[node.first as usize..(node.first + node.count) as usize]);
            } else {
                open.extend([node.first, node.first + 1]);
            }
        }
        found
    })
}

/// Checks that `difference` is the first merge of the subtree under `root`, by distance, whose primitives no node of `other` has.
fn check_first(tree: &AnyTree, root: u32, other: &AnyTree, difference: DifferentMerge) {
    let others: BTreeSet<BTreeSet<u32>> =
        (0..other.node_count() as u32).map(|node| primitives_below(other, node)).collect();
    let within = primitives_below(tree, root);
    let timeline = Timeline::by_distance(tree, &CancelToken::new()).unwrap();
    let merges = timeline.nodes().iter().filter(|&&node| primitives_below(tree, node).is_subset(&within));
    let expected = merges.enumerate().find(|(_, node)| !others.contains(&primitives_below(tree, **node)));
    let (before, &node) = expected.unwrap();
    assert_eq!((difference.merges_before as usize, difference.node), (before, node));
    let areas = with_tree!(tree, tree => [node, root].map(|node| tree.nodes[node as usize].container.relative_area()));
    assert!((difference.area - areas[0] / areas[1]).abs() < 1e-6);
}

#[test]
fn differences_are_sets_that_the_other_tree_has_not() {
    let triangles = trees::soup(3_000, 0.1, 108);
    let mut checked = 0;
    for optimize in [Passes::NONE, Passes::FINISHED] {
        let tree = built(&triangles, &BuildSettings { optimize, ..BuildSettings::default() });
        let counts = with_tree!(&tree, tree => Ancestry::new(tree, &CancelToken::new()).unwrap().primitive_counts);
        let roots = (0..tree.node_count() as u32).filter(|&node| (60..200).contains(&counts[node as usize]));
        for root in roots.step_by(5) {
            let comparison = compared(&tree, root);
            assert_eq!(primitives_below(&comparison.exact, 0), primitives_below(&tree, root));
            if let (Some(first), Some(exact)) = (comparison.first_difference, comparison.exact_difference) {
                check_first(&tree, root, &comparison.exact, first);
                check_first(&comparison.exact, 0, &tree, exact);
                checked += 1;
            }
        }
    }
    assert!(checked > 4, "only {checked} subtrees differ");
}

#[test]
fn leaves_of_several_primitives_stay_whole() {
    let triangles = trees::soup(900, 0.3, 109);
    let tree = built(&triangles, &BuildSettings { optimize: Passes::FINISHED, ..BuildSettings::default() });
    assert!(tree.node_count() < 1_799, "some leaves have several primitives");
    let comparison = compared(&tree, 0);
    assert_eq!(validate(&comparison.exact, &triangles), Ok(()));
    assert_eq!(comparison.leaves, tree.node_count() / 2 + 1);
}

#[test]
fn large_subtrees_and_missing_nodes_are_refused() {
    let triangles = trees::soup(4_097, 0.1, 110);
    let tree = built(&triangles, &BuildSettings::default());
    let refusal = |root, token: &CancelToken| compare_with_exact(&tree, root, token).unwrap_err();
    let token = CancelToken::new();
    assert!(matches!(refusal(0, &token), BuildError::Refused(text) if text.contains("at most 4096 leaves")));
    assert!(matches!(refusal(99_999, &token), BuildError::Refused(text) if text.contains("no node 99999")));
    assert!(compare_with_exact(&tree, 1, &token).is_ok());
    let leaf = (0..tree.node_count() as u32).find(|&node| primitives_below(&tree, node).len() == 1).unwrap();
    let comparison = compared(&tree, leaf);
    assert_eq!((comparison.leaves, comparison.ratio(), comparison.first_difference), (1, 1.0, None));
    let token = CancelToken::watched(|checks| checks > 20);
    assert_eq!(refusal(1, &token), BuildError::Cancelled(Cancelled));
}
