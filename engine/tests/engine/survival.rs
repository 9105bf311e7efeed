//! Nodes that two trees have in common, compared with the sets of their primitives themselves.

use std::collections::BTreeSet;

use bvhscope_engine::builders::build_binary;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Sphere};
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Pass, Passes};
use bvhscope_engine::tree::survival::{Survival, surviving_nodes};
use bvhscope_engine::tree::{AnyTree, Container, ContainerKind, Node, Tree};
use bvhscope_engine::with_tree;

use crate::random::Random;
use crate::trees;

/// The primitives below each node.
fn sets<C: Container>(tree: &Tree<C>) -> Vec<BTreeSet<u32>> {
    let mut sets = vec![BTreeSet::new(); tree.nodes.len()];
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        let mut set: BTreeSet<u32> = tree.primitive_indices[node.slots()].iter().copied().collect();
        node.children().for_each(|child| set.extend(&sets[child as usize]));
        sets[index] = set;
    }
    sets
}

/// The survival of the nodes of `a` in `b`, which must be what the sets say.
pub fn checked(name: &str, a: &AnyTree, b: &AnyTree) -> Survival {
    with_tree!(a, a => with_tree!(b, b => {
        let sets_of_b = sets(b);
        let others: BTreeSet<_> = sets_of_b.iter().cloned().collect();
        let survival = surviving_nodes(a, b, &CancelToken::new()).unwrap();
        let (mut nodes, mut interior) = (0, 0);
        for (index, set) in sets(a).iter().enumerate() {
            let survives = others.contains(set);
            assert_eq!(survival.survives(index as u32), survives, "{name}: node {index}, {set:?}");
            let partner = survival.partner(index as u32).map(|partner| &sets_of_b[partner as usize]);
            assert_eq!(partner, survives.then_some(set), "{name}: the other node of node {index}");
            nodes += usize::from(survives);
            interior += usize::from(survives && !a.nodes[index].is_leaf());
        }
        assert_eq!((survival.nodes, survival.interior), (nodes, interior), "{name}");
        let mut of_depth = vec![0; survival.nodes_per_depth.len()];
        let mut open = vec![(0, 0)];
        while let Some((node, depth)) = open.pop().filter(|_| !a.nodes.is_empty()) {
            of_depth[depth] += u32::from(survival.survives(node));
            open.extend(a.nodes[node as usize].children().map(|child| (child, depth + 1)));
        }
        assert_eq!(survival.nodes_per_depth, of_depth, "{name}");
        assert!(!survival.survives(a.nodes.len() as u32));
        survival
    }))
}

#[test]
fn nodes_with_the_same_primitives_survive() {
    let settings = |builder, container, passes: &[Pass]| BuildSettings {
        builder,
        container,
        optimize: passes.iter().fold(Passes::NONE, |all, &pass| all.with(pass)),
        ..BuildSettings::default()
    };
    let (boxes, spheres) = (ContainerKind::Aabb, ContainerKind::Sphere);
    let all = [
        settings(BuilderKind::Aac, boxes, &[]),
        settings(BuilderKind::Aac, spheres, &[]),
        settings(BuilderKind::Lbvh, boxes, &[]),
        settings(BuilderKind::BinnedSah, boxes, &[Pass::Collapse]),
        settings(BuilderKind::Aac, boxes, &[Pass::Split]),
        settings(BuilderKind::Lbvh, boxes, &[Pass::Split, Pass::Collapse]),
    ];
    let (mut repeated, mut some) = (0, 0);
    for seed in 0..6 {
        let triangles = trees::soup(40 + 30 * seed as usize, 0.4, seed);
        let built: Vec<AnyTree> =
            all.iter().map(|settings| build_binary(&triangles, settings, &CancelToken::new()).unwrap().0).collect();
        for (i, a) in built.iter().enumerate() {
            repeated += usize::from(a.primitive_indices().len() > triangles.len());
            for (j, b) in built.iter().enumerate() {
                let survival = checked(&format!("{seed}: {i} in {j}"), a, b);
                assert!(i != j || survival.nodes == a.node_count(), "all survive in the same tree");
                some += usize::from(survival.interior > 1 && survival.nodes < a.node_count());
            }
        }
    }
    assert!(repeated >= 6 && some > 50, "{repeated} trees with split triangles, {some} with some survivors");
}

#[test]
fn topology_decides_not_the_container() {
    let triangles = trees::soup(300, 0.2, 4);
    let (AnyTree::Aabb(boxes), spheres) =
        (trees::halved::<Aabb>(&triangles, 2), trees::halved::<Sphere>(&triangles, 2))
    else {
        unreachable!("asked for boxes")
    };
    let survival = checked("boxes in spheres", &AnyTree::Aabb(boxes.clone()), &spheres);
    assert_eq!(survival.nodes, boxes.nodes.len());
    assert_eq!(survival.interior, boxes.nodes.iter().filter(|node| !node.is_leaf()).count());
    let empty = surviving_nodes(&boxes, &Tree::<Sphere>::EMPTY, &CancelToken::new()).unwrap();
    assert_eq!((empty.nodes, empty.survives(0)), (0, false));
    assert_eq!(surviving_nodes(&Tree::<Aabb>::EMPTY, &boxes, &CancelToken::new()).unwrap().nodes, 0);
}

/// A random tree of up to four children per node over random leaves, whose primitives may repeat within a leaf and between
/// leaves.
fn random_tree(random: &mut Random, primitives: usize) -> AnyTree {
    fn grow(random: &mut Random, tree: &mut Tree<Aabb>, at: usize, leaves: usize, primitives: usize) {
        if leaves == 1 {
            let (first, count) = (tree.primitive_indices.len() as u32, 1 + random.below(3) as u32);
            tree.primitive_indices.extend((0..count).map(|_| random.below(primitives) as u32));
            tree.nodes[at] = Node { container: Aabb::EMPTY, first, count };
            return;
        }
        let (first, arity) = (tree.nodes.len(), 1 + random.below(leaves.min(4)));
        tree.nodes.extend((0..arity).map(|_| Node { container: Aabb::EMPTY, first: 0, count: 0 }));
        tree.nodes[at] = Node::interior(Aabb::EMPTY, first as u32, arity as u32);
        let mut rest = leaves;
        for child in 0..arity {
            let others = arity - 1 - child;
            let own = if others == 0 { rest } else { 1 + random.below(rest - others) };
            grow(random, tree, first + child, own, primitives);
            rest -= own;
        }
    }
    let mut tree = Tree { nodes: vec![Node { container: Aabb::EMPTY, first: 0, count: 0 }], ..Tree::EMPTY };
    let leaves = 1 + random.below(12);
    grow(random, &mut tree, 0, leaves, primitives);
    AnyTree::Aabb(tree)
}

#[test]
fn repeated_primitives_count_once() {
    let mut random = Random(12);
    let (mut survivors, mut lost) = (0, 0);
    for round in 0..2_000 {
        let [a, b] = [0, 1].map(|_| random_tree(&mut random, 2 + round % 7));
        let survival = checked(&format!("round {round}"), &a, &b);
        survivors += survival.interior;
        lost += a.node_count() - survival.nodes;
    }
    assert!(survivors > 500 && lost > 500, "{survivors} and {lost}");
}
