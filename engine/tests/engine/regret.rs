//! Regret: a planted defect comes first, an optimal tree has none, and all of it adds up to the gain of the root.

use std::collections::HashSet;
use std::sync::{Arc, Mutex, OnceLock};

use bvhscope_engine::builders::build_binary;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::construction::{RegretLimits, Regrets, regrets};
use bvhscope_engine::geometry::{Aabb, Sphere, Triangle};
use bvhscope_engine::settings::{BuildSettings, Preset};
use bvhscope_engine::tree::ancestry::Ancestry;
use bvhscope_engine::tree::{AnyTree, Container, ContainerKind, Node, Tree};
use bvhscope_engine::with_tree;

use crate::random::Random;
use crate::trees;

fn of(tree: &AnyTree, triangles: &[Triangle]) -> Regrets {
    regrets(tree, triangles, RegretLimits::default(), &CancelToken::new()).unwrap()
}

/// The nodes of greatest regret, greatest first.
fn worst(tree: &AnyTree, regrets: &Regrets) -> Vec<(u32, f32)> {
    let all = 0..tree.node_count() as u32;
    let mut worst: Vec<_> = all.filter_map(|node| Some((node, regrets.regret(node)?))).collect();
    worst.sort_by(|a, b| b.1.total_cmp(&a.1));
    worst
}

/// Shuffles the primitives below `root` and fits all containers again: a subtree without any order.
fn shuffle<C: Container>(tree: &mut Tree<C>, triangles: &[Triangle], root: u32) {
    let (mut slots, mut open) = (Vec::new(), vec![root]);
    while let Some(node) = open.pop() {
        open.extend(tree.nodes[node as usize].children());
        slots.extend(tree.nodes[node as usize].slots());
    }
    let mut random = Random(1);
    for at in (1..slots.len()).rev() {
        tree.primitive_indices.swap(slots[at], slots[random.below(at + 1)]);
    }
    for index in (0..tree.nodes.len()).rev() {
        let own = tree.primitive_indices[tree.nodes[index].slots()].iter();
        let own = own.map(|&triangle| C::of_triangle(&triangles[triangle as usize]));
        let below = tree.nodes[index].children().map(|child| tree.nodes[child as usize].container);
        tree.nodes[index].container = own.chain(below).fold(C::EMPTY, |all, part| all.union(&part));
    }
}

#[test]
fn a_subtree_without_order_comes_first() {
    let triangles = trees::soup(6_000, 0.02, 5);
    for container in ContainerKind::ALL {
        let settings = BuildSettings::preset(Preset::AacHq, container);
        let (mut tree, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
        let before = of(&tree, &triangles);
        // A twentieth of all triangles, below many nodes of greater cost.
        let counts = with_tree!(&tree, tree => Ancestry::new(tree, &CancelToken::new())).unwrap().primitive_counts;
        let defect = (0..counts.len() as u32).min_by_key(|&node| counts[node as usize].abs_diff(300)).unwrap();
        with_tree!(&mut tree, tree => shuffle(tree, &triangles, defect));
        let after = of(&tree, &triangles);
        let list = worst(&tree, &after);
        assert_eq!(list[0].0, defect, "{container:?}: {:?}", &list[..8]);
        assert!(list[0].1 > 2.0 * before.regret(defect).unwrap(), "{container:?}");
        // Gains say less: those of all nodes above are as large.
        assert!(after.gain(0).unwrap() >= after.gain(defect).unwrap());
    }
}

#[test]
fn gains_contain_those_below() {
    let triangles = trees::soup(700, 0.1, 3);
    for tree in
        [trees::halved::<Aabb>(&triangles, 1), trees::halved::<Aabb>(&triangles, 5), trees::chain::<Sphere>(&triangles)]
    {
        let regrets = of(&tree, &triangles);
        let gain = |node: u32| regrets.gain(node).unwrap_or(0.0);
        for node in 0..tree.node_count() as u32 {
            let below: f32 = with_tree!(&tree, tree => tree.nodes[node as usize].children().map(gain).sum());
            let regret = regrets.regret(node).unwrap();
            assert!(gain(node) > below - 1e-5 && regret < gain(node) + 1e-5, "{node}");
            assert!((regret - (gain(node) - below)).abs() < 1e-5 || (regret - gain(node)).abs() < 1e-5, "{node}");
        }
        assert!(gain(0) > 0.01);
    }
    // Each merge of a list is as bad as those below it.
    let list = trees::chain::<Aabb>(&triangles);
    let regrets = of(&list, &triangles);
    assert_eq!((worst(&list, &regrets)[0].0, regrets.regret(0)), (0, regrets.gain(0)));
}

/// The cheapest tree of the triangles in the bit set `set`, found by trying all: its cost and its first half.
fn best(boxes: &[Aabb], costs: &mut [Option<(f64, u32)>], set: u32) -> f64 {
    if let Some((cost, _)) = costs[set as usize] {
        return cost;
    }
    let area = f64::from(around(boxes, set).relative_area());
    let mut found = (if set.count_ones() == 1 { area } else { f64::INFINITY }, 0);
    let mut half = (set - 1) & set;
    while half > 0 {
        let cost = area + best(boxes, costs, half) + best(boxes, costs, set & !half);
        if cost < found.0 {
            found = (cost, half);
        }
        half = (half - 1) & set;
    }
    costs[set as usize] = Some(found);
    found.0
}

fn around(boxes: &[Aabb], set: u32) -> Aabb {
    let inside = boxes.iter().enumerate().filter(|(at, _)| set >> at & 1 == 1);
    inside.fold(Aabb::EMPTY, |all, (_, part)| all.union(part))
}

/// Writes the tree that [`best`] found into `node`.
fn write(tree: &mut Tree<Aabb>, boxes: &[Aabb], costs: &[Option<(f64, u32)>], node: usize, set: u32) {
    let container = around(boxes, set);
    let half = costs[set as usize].unwrap().1;
    if half == 0 {
        tree.nodes[node] = Node { container, first: tree.primitive_indices.len() as u32, count: 1 };
        tree.primitive_indices.push(set.trailing_zeros());
        return;
    }
    let first = tree.nodes.len();
    tree.nodes[node] = Node { container, first: first as u32, count: 0 };
    tree.nodes.extend([Node { container, first: 0, count: 0 }; 2]);
    write(tree, boxes, costs, first, half);
    write(tree, boxes, costs, first + 1, set & !half);
}

#[test]
fn an_optimal_tree_has_no_regret() {
    let mut is_any_better = false;
    for seed in 0..20 {
        let triangles = trees::soup(9, 0.5, seed);
        let boxes: Vec<Aabb> = triangles.iter().map(Aabb::of_triangle).collect();
        let all = (1 << boxes.len()) - 1;
        let mut costs = vec![None; all as usize + 1];
        best(&boxes, &mut costs, all);
        let mut tree = Tree { nodes: Vec::new(), primitive_indices: Vec::new(), max_depth: 8 };
        tree.nodes.push(Node { container: Aabb::EMPTY, first: 0, count: 0 });
        write(&mut tree, &boxes, &costs, 0, all);
        let tree = AnyTree::from(tree);
        let optimal = of(&tree, &triangles);
        assert!(worst(&tree, &optimal).iter().all(|&(_, regret)| regret <= 0.0), "{seed}");
        assert_eq!(optimal.gain(0), Some(0.0));
        let list = trees::chain::<Aabb>(&triangles);
        is_any_better |= of(&list, &triangles).regret(0).unwrap() > 0.0;
    }
    assert!(is_any_better);
}

#[test]
fn a_leaf_regrets_that_it_is_not_split() {
    let triangles = trees::soup(40, 0.01, 2);
    let tree = trees::halved::<Aabb>(&triangles, 40);
    assert_eq!(tree.node_count(), 1);
    let regret = of(&tree, &triangles).regret(0).unwrap();
    assert!(regret > 0.5, "{regret}");
}

#[test]
fn only_what_is_rebuilt_is_known() {
    let triangles = trees::soup(3_000, 0.05, 4);
    let tree = trees::halved::<Aabb>(&triangles, 1);
    let token = CancelToken::new();
    let few = regrets(&tree, &triangles, RegretLimits { work: 200_000, ..RegretLimits::default() }, &token).unwrap();
    assert!((3..100).contains(&few.rebuilt), "{}", few.rebuilt);
    assert!(few.regret(0).is_some());
    // The lowest rebuilt nodes gain what all below them regret.
    assert!((0..tree.node_count() as u32).any(|node| few.gain(node).is_some() && few.regret(node).is_none()));
    // Not the root, but all others.
    let limits = RegretLimits { triangles: 2_000, ..RegretLimits::default() };
    let small = regrets(&tree, &triangles, limits, &token).unwrap();
    assert_eq!((small.regret(0), small.gain(0)), (None, None));
    assert!(small.regret(1).is_some());
    assert_eq!(small.regret(1_000_000), None);
    assert_eq!(of(&AnyTree::Aabb(Tree::EMPTY), &[]), Regrets::default());
}

#[test]
fn progress_is_reported_between_beginning_and_end() {
    let triangles = trees::soup(2_000, 0.05, 4);
    let tree = trees::halved::<Aabb>(&triangles, 1);
    let (watched, seen) = (Arc::new(OnceLock::<CancelToken>::new()), Arc::new(Mutex::new(Vec::new())));
    let token = CancelToken::watched({
        let (watched, seen) = (Arc::clone(&watched), Arc::clone(&seen));
        move |_| {
            seen.lock().unwrap().extend(watched.get().map(CancelToken::progress));
            false
        }
    });
    watched.set(token.clone()).unwrap();
    regrets(&tree, &triangles, RegretLimits::default(), &token).unwrap();
    let seen = seen.lock().unwrap();
    let tenths: HashSet<u32> = seen.iter().map(|progress| (progress * 10.0) as u32).collect();
    assert!(tenths.len() >= 8, "{tenths:?}");
    assert_eq!(token.progress(), 1.0);
}
