//! Levels, ancestry, paths, metrics and survival of nodes in trees of every arity, against plain recursions.

use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Dop14, Sphere, Triangle};
use bvhscope_engine::tree::ancestry::{Ancestry, path_to_primitive};
use bvhscope_engine::tree::levels::Levels;
use bvhscope_engine::tree::node_metrics::{empty_space, overlap, sah_share, subtree_sah_shares};
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::tree::{AnyTree, Container, Node, Tree};
use bvhscope_engine::with_tree;

use super::{ARITIES, for_each_below, irregular, widened};
use crate::survival::checked;
use crate::trees;

fn token() -> CancelToken {
    CancelToken::new()
}

/// Trees of boxes and of spheres of every arity over `triangles`, each with its name.
fn wide_trees(triangles: &[Triangle]) -> Vec<(String, AnyTree)> {
    let binary = [
        trees::halved::<Aabb>(triangles, 1),
        trees::halved::<Sphere>(triangles, 3),
        trees::halved::<Dop14>(triangles, 3),
    ];
    let of = |tree: &AnyTree, arity: usize| {
        let kind = tree.container_kind();
        [
            (format!("{kind:?}, {arity}"), widened(tree, arity)),
            (format!("{kind:?}, 1 to {arity}"), irregular(tree, arity, arity as u64)),
        ]
    };
    binary.iter().flat_map(|tree| ARITIES.into_iter().flat_map(|arity| of(tree, arity))).collect()
}

#[test]
fn depths_parents_and_counts_are_those_of_a_recursion() {
    // More nodes than levels list at once.
    let triangles = trees::soup(10_000, 0.1, 7);
    for (name, tree) in wide_trees(&triangles) {
        let stats = tree_stats(&tree, &token()).unwrap();
        with_tree!(&tree, tree => {
            let (mut depths, mut parents) = (vec![0; tree.nodes.len()], vec![0; tree.nodes.len()]);
            for_each_below(tree, 0, [0, 0], &mut |node, depth, parent| {
                (depths[node as usize], parents[node as usize]) = (depth, parent);
            });
            assert_eq!(tree.depths(&token()).unwrap(), depths, "{name}");
            assert_eq!(tree.parents(&token()).unwrap(), parents, "{name}");

            let ancestry = Ancestry::new(tree, &token()).unwrap();
            assert_eq!(ancestry.parents, parents, "{name}");
            let mut counts: Vec<u32> = tree.nodes.iter().map(|node| node.slots().len() as u32).collect();
            (1..counts.len()).rev().for_each(|node| counts[parents[node] as usize] += counts[node]);
            assert_eq!(ancestry.primitive_counts, counts, "{name}");
            let last = tree.nodes.len() - 1;
            assert_eq!(ancestry.depth(last as u32), depths[last], "{name}");

            let levels = Levels::new(tree, &stats.nodes_per_depth);
            let mut sorted: Vec<u32> = (0..tree.nodes.len() as u32).collect();
            sorted.sort_by_key(|&node| depths[node as usize]);
            for listed in [1, tree.nodes.len() as u32] {
                let list = levels.first(tree, listed);
                assert_eq!(list, &sorted[..list.len()], "{name}");
                assert!(list.len() >= listed as usize);
            }
            let first = (0..tree.nodes.len() as u32).map(|node| {
                let mut slots = Vec::new();
                for_each_below(tree, node, [0, 0], &mut |node, _, _| slots.extend(tree.nodes[node as usize].slots()));
                slots.first().map(|&slot| tree.primitive_indices[slot])
            });
            let few = first.enumerate().step_by(97);
            few.for_each(|(node, first)| assert_eq!(tree.first_primitive_below(node as u32), first, "{name}, {node}"));
        });
    }
}

fn check_path<C: Container>(name: &str, tree: &Tree<C>, path: &[u32], primitive: u32) {
    assert_eq!(path[0], 0, "{name}: from the root");
    for step in path.windows(2) {
        assert!(tree.nodes[step[0] as usize].children().contains(&step[1]), "{name}: {path:?}");
    }
    let leaf = &tree.nodes[path[path.len() - 1] as usize];
    assert!(tree.primitive_indices[leaf.slots()].contains(&primitive), "{name}: {primitive} at the end of {path:?}");
}

#[test]
fn paths_lead_to_the_leaf_of_each_primitive() {
    let triangles = trees::soup(300, 0.3, 9);
    for (name, tree) in wide_trees(&triangles) {
        with_tree!(&tree, tree => {
            // Where containers are too small to descend by, too, as in a tree with faults.
            let mut shrunk = tree.clone();
            let last = tree.nodes[tree.nodes.len() - 1].container;
            shrunk.nodes.iter_mut().skip(1).step_by(3).for_each(|node| node.container = last);
            for (primitive, triangle) in (0..).zip(&triangles) {
                for (kind, tree) in [("sound", tree), ("faulty", &shrunk)] {
                    let name = format!("{name}, {kind}");
                    check_path(&name, tree, &path_to_primitive(tree, triangle, primitive), primitive);
                }
            }
            assert!(path_to_primitive(tree, &triangles[0], 300).is_empty(), "no such primitive");
        });
    }
}

fn close(value: f32, expected: f64, name: &str) {
    assert!((f64::from(value) - expected).abs() <= 1e-4 * expected.max(1.0), "{name}: {value} instead of {expected}");
}

#[test]
fn metrics_of_nodes_are_their_formulas() {
    let triangles = trees::soup(400, 0.4, 11);
    for (name, tree) in wide_trees(&triangles) {
        let stats = tree_stats(&tree, &token()).unwrap();
        with_tree!(&tree, tree => {
            let subtrees = subtree_sah_shares(tree, &token()).unwrap();
            for (index, node) in tree.nodes.iter().enumerate() {
                let at = index as u32;
                let below: f64 = node.children().map(|child| f64::from(subtrees[child as usize])).sum();
                close(subtrees[index], f64::from(sah_share(tree, at, &stats)) + below, &name);
                let children: Vec<_> = node.children().map(|child| &tree.nodes[child as usize]).collect();
                if children.is_empty() {
                    assert_eq!((empty_space(tree, at), overlap(tree, at)), (None, None), "{name}");
                    continue;
                }
                let area = f64::from(node.container.relative_area());
                let shares: f64 = children.iter().map(|child| f64::from(child.container.relative_area()) / area).sum();
                close(empty_space(tree, at).unwrap(), (1.0 - shares / children.len() as f64).max(0.0), &name);
                let mut in_common = 0.0;
                for (first, a) in children.iter().enumerate() {
                    for b in &children[..first] {
                        in_common += (f64::from(a.container.intersection_area(&b.container)) / area).min(1.0);
                    }
                }
                close(overlap(tree, at).unwrap(), in_common, &name);
            }
        });
    }
}

#[test]
fn nodes_survive_across_arities() {
    let triangles = trees::soup(200, 0.3, 12);
    let binary = trees::halved::<Aabb>(&triangles, 1);
    let count = |tree: &AnyTree| with_tree!(tree, tree => tree.nodes.iter().filter(|node| !node.is_leaf()).count());
    for (name, tree) in wide_trees(&triangles) {
        // Each node of a tree widened from the same binary one was there before; nodes with one child have the same primitives.
        let forth = checked(&name, &tree, &binary);
        let back = checked(&name, &binary, &tree);
        if name.starts_with("Aabb") {
            assert_eq!((forth.nodes, forth.interior), (tree.node_count(), count(&tree)), "{name}");
            assert!(back.interior <= forth.interior, "{name}");
        }
    }
    let leaf: Node<Aabb> = Node { container: Aabb::EMPTY, first: 0, count: 2 };
    let chain = Tree {
        nodes: vec![Node::interior(Aabb::EMPTY, 1, 1), Node::interior(Aabb::EMPTY, 2, 1), leaf],
        primitive_indices: vec![0, 1],
        max_depth: 2,
    };
    assert_eq!(checked("single children", &chain.into(), &binary).nodes, 0, "no node of the other has these two");
}
