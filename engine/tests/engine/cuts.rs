//! Standing clusters and cuts against brute force.

use std::collections::HashSet;

use bvhscope_engine::builders::{BuildError, build_binary};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::construction::{Construction, Cut, CutError, MergeOrder, SplitTree, Timeline};
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Passes};
use bvhscope_engine::tree::ancestry::Ancestry;
use bvhscope_engine::tree::{AnyTree, Container, ContainerKind, Tree};
use bvhscope_engine::with_tree;

use crate::construction::construct;
use crate::random::Random;
use crate::spatial_splits::long_scenes;
use crate::trees;

fn timelines(construction: &Construction) -> [Timeline; 3] {
    MergeOrder::ALL.map(|order| construction.timeline(order, &CancelToken::new()).unwrap())
}

/// The nodes that stand at `step`, by the definition alone.
fn standing<C: Container>(tree: &Tree<C>, merged: &[u32], step: u32) -> Vec<u32> {
    let mut stands: Vec<bool> = tree.nodes.iter().map(|node| node.is_leaf()).collect();
    for &node in &merged[..step as usize] {
        let first = tree.nodes[node as usize].first as usize;
        assert!(stands[first] && stands[first + 1], "a parent comes after its children");
        (stands[node as usize], stands[first], stands[first + 1]) = (true, false, false);
    }
    (0..tree.nodes.len() as u32).filter(|&node| stands[node as usize]).collect()
}

fn check_standing<C: Container>(tree: &Tree<C>, timeline: &Timeline) {
    let mut random = Random(98);
    let last = timeline.steps();
    let mut steps: Vec<u32> = (0..12).map(|_| random.below(last as usize + 1) as u32).collect();
    steps.extend([0, last, last / 2, 4095, 4096, 4097].into_iter().filter(|&step| step <= last));
    for step in steps {
        let mut expected = standing(tree, timeline.nodes(), step);
        assert_eq!(timeline.standing(step) as usize, expected.len());
        assert!((0..tree.nodes.len() as u32).filter(|&node| timeline.stands(node, step)).eq(expected.iter().copied()));
        let area = |node: u32| tree.nodes[node as usize].container.relative_area();
        expected.sort_by(|&a, &b| area(b).total_cmp(&area(a)).then(a.cmp(&b)));
        for count in [0, 1, 10, 500, Timeline::MAX_LARGEST, 100_000] {
            let largest = timeline.largest_at(step, count);
            let count = count.min(Timeline::MAX_LARGEST).min(expected.len());
            assert_eq!(largest, expected[..count], "step {step} of {last}, {:?}", timeline.order());
        }
    }
    assert_eq!(timeline.largest_at(u32::MAX, 3), [0], "beyond the last step the root stands");
}

#[test]
fn the_largest_clusters_are_those_of_a_pass_over_the_tree() {
    // More clusters than a snapshot takes, few sizes, and less than one snapshot.
    for triangles in [trees::soup(30_000, 0.2, 99), trees::grid(110, 2, 0.0), trees::soup(700, 0.3, 100)] {
        for container in ContainerKind::ALL {
            let construction = construct(&triangles, &BuildSettings { container, ..BuildSettings::default() });
            for timeline in timelines(&construction) {
                with_tree!(&construction.tree, tree => check_standing(tree, &timeline));
            }
        }
    }
}

#[test]
fn orders_are_what_they_are_called() {
    for container in ContainerKind::ALL {
        let construction =
            construct(&trees::soup(9_000, 0.1, 101), &BuildSettings { container, ..BuildSettings::default() });
        let [built, distance, level] = timelines(&construction);
        assert_eq!(built.nodes(), construction.record.nodes());
        let levels: Vec<u32> = level.nodes().iter().map(|&node| construction.record.level_of(node).unwrap()).collect();
        assert!(levels.is_sorted_by(|a, b| a >= b), "deepest first");
        let areas: Vec<f32> = with_tree!(&construction.tree, tree => {
            distance.nodes().iter().map(|&node| tree.nodes[node as usize].container.relative_area()).collect()
        });
        // Only a parent that is no larger than its child can break the order, and those are rounding errors of spheres.
        let descents = areas.windows(2).filter(|pair| pair[1] < pair[0] * 0.999_999).count();
        assert_eq!(descents, 0, "{container:?}: by distance is not by area");
    }
}

/// The nodes that stand after `step` splits, by the definition alone.
fn standing_after_splits<C: Container>(tree: &Tree<C>, split: &[u32], step: u32) -> Vec<u32> {
    let mut stands = vec![false; tree.nodes.len()];
    stands[0] = true;
    for &node in &split[..step as usize] {
        let first = tree.nodes[node as usize].first as usize;
        assert!(std::mem::take(&mut stands[node as usize]), "a child comes after its parent");
        stands[first..first + 2].fill(true);
    }
    (0..tree.nodes.len() as u32).filter(|&node| stands[node as usize]).collect()
}

#[test]
fn after_each_split_the_largest_parts_are_those_of_a_pass_over_the_tree() {
    let token = CancelToken::new();
    let triangles = trees::soup(20_000, 0.2, 103);
    for builder in SplitTree::BUILDERS {
        let settings = BuildSettings { builder, optimize: Passes::FINISHED, ..BuildSettings::default() };
        let split = SplitTree::new(&triangles, &settings, &token).unwrap();
        let plain = BuildSettings { optimize: Passes::NONE, ..settings };
        assert!(split.tree == build_binary(&triangles, &plain, &token).unwrap().0, "before all passes");
        let AnyTree::Aabb(tree) = &split.tree else { panic!("not boxes") };
        for order in MergeOrder::ALL {
            let timeline = split.timeline(order, &token).unwrap();
            let last = timeline.steps();
            for step in [0, 1, 2, 777, 4095, 4096, 4097, 9_000, last - 1, last] {
                let mut expected = standing_after_splits(tree, timeline.nodes(), step);
                assert_eq!((timeline.standing(step), timeline.step_with(step + 1)), (step + 1, step));
                let cut = Cut::Step { order, step }.nodes(&split.tree, Some(&timeline), &token).unwrap();
                check_cut(tree, &cut, "splits");
                let mut sorted = cut.clone();
                sorted.sort_unstable();
                assert_eq!(sorted, expected, "{builder:?} {order:?}");
                assert!((0..tree.nodes.len() as u32).filter(|&node| timeline.stands(node, step)).eq(sorted));
                let area = |node: u32| tree.nodes[node as usize].container.relative_area();
                expected.sort_by(|&a, &b| area(b).total_cmp(&area(a)).then(a.cmp(&b)));
                expected.truncate(1000);
                assert_eq!(timeline.largest_at(step, 1000), expected, "{builder:?} {order:?}, step {step}");
            }
            let steps = (1..=last).map(|step| timeline.step_of(timeline.nodes()[step as usize - 1]));
            assert!(steps.eq((1..=last).map(Some)));
        }
    }
    let refused = SplitTree::new(&triangles, &BuildSettings::default(), &token);
    assert!(matches!(refused, Err(BuildError::Refused(text)) if text.contains("splits nothing")));
}

#[test]
fn orders_of_splits_are_what_they_are_called() {
    let token = CancelToken::new();
    let settings = BuildSettings { builder: BuilderKind::Sweep, ..BuildSettings::default() };
    let split = SplitTree::new(&trees::soup(3_000, 0.1, 104), &settings, &token).unwrap();
    let AnyTree::Aabb(tree) = &split.tree else { panic!("not boxes") };
    let nodes = |order| split.timeline(order, &token).unwrap().nodes().to_vec();
    let depths = tree.depths(&token).unwrap();
    assert!(nodes(MergeOrder::Level).is_sorted_by_key(|&node| depths[node as usize]));
    let area = |node: u32| tree.nodes[node as usize].container.half_area();
    assert!(nodes(MergeOrder::Distance).is_sorted_by(|&a, &b| area(a) >= area(b)));
    // The left side as a whole before the right one: nodes lie depth first.
    assert!(nodes(MergeOrder::Built).is_sorted_by_key(|&node| tree.nodes[node as usize].first));
}

#[test]
fn duplicates_of_spatial_splits_are_the_triangles_of_both_sides() {
    let token = CancelToken::new();
    let settings = BuildSettings { builder: BuilderKind::Sbvh, ..BuildSettings::default() };
    let [(_, triangles, _), ..] = long_scenes();
    let split = SplitTree::new(&triangles, &settings, &token).unwrap();
    let AnyTree::Aabb(tree) = &split.tree else { panic!("not boxes") };
    let mut below = vec![HashSet::new(); tree.nodes.len()];
    for (at, node) in tree.nodes.iter().enumerate().rev() {
        below[at] = tree.primitive_indices[node.slots()].iter().copied().collect();
        let children = node.children().flat_map(|child| below[child as usize].clone()).collect::<Vec<u32>>();
        below[at].extend(children);
        let children = node.children().map(|child| &below[child as usize]).collect::<Vec<_>>();
        let expected = if let [left, right] = children[..] { left.intersection(right).count() } else { 0 };
        assert_eq!(split.duplicates(at as u32) as usize, expected, "node {at}");
    }
    let all: u32 = (0..tree.nodes.len() as u32).map(|node| split.duplicates(node)).sum();
    assert!(all > 50, "{all} references were added");
    assert_eq!(all as usize + triangles.len(), tree.primitive_indices.len());
    let sweep = BuildSettings { builder: BuilderKind::Sweep, ..settings };
    assert_eq!(SplitTree::new(&triangles, &sweep, &token).unwrap().duplicates(0), 0);
}

/// Fails where `cut` is not an antichain that holds every primitive, from left to right.
fn check_cut<C: Container>(tree: &Tree<C>, cut: &[u32], name: &str) {
    let ancestry = Ancestry::new(tree, &CancelToken::new()).unwrap();
    let mut next = 0;
    for &node in cut {
        let mut leftmost = tree.nodes[node as usize];
        while !leftmost.is_leaf() {
            leftmost = tree.nodes[leftmost.first as usize];
        }
        assert_eq!(leftmost.first, next, "{name}: node {node} does not follow the one before");
        next += ancestry.primitive_counts[node as usize];
    }
    assert_eq!(next as usize, tree.primitive_indices.len(), "{name}: every primitive is in the cut");
}

fn check_cuts(any: &AnyTree, leaves: u32, name: &str) {
    let token = CancelToken::new();
    let nodes = |cut: Cut| cut.nodes(any, None, &token).unwrap();
    with_tree!(any, tree => {
        for clusters in [0, 1, 2, 7, leaves / 3, leaves, leaves + 5] {
            let cut = nodes(Cut::Clusters(clusters));
            check_cut(tree, &cut, name);
            assert_eq!(cut.len() as u32, clusters.clamp(1, leaves), "{name}");
            let at_step = Cut::Step { order: MergeOrder::Distance, step: leaves.saturating_sub(clusters.max(1)) };
            assert_eq!(nodes(at_step), cut, "{name}: so many steps before the end");
        }
        let ancestry = Ancestry::new(tree, &token).unwrap();
        let area = |node: u32| tree.nodes[node as usize].container.relative_area();
        for fraction in [0.0, 1e-4, 0.01, 0.3, 1.0] {
            let cut = nodes(Cut::Area(fraction));
            check_cut(tree, &cut, name);
            for node in cut {
                let parent = ancestry.parents[node as usize];
                assert!(tree.nodes[node as usize].is_leaf() || area(node) <= fraction * area(0), "{name}: too large");
                assert!(node == 0 || area(parent) > fraction * area(0), "{name}: its parent is small enough");
            }
        }
        for most in [0, 1, 10, 1000, u32::MAX] {
            let cut = nodes(Cut::Primitives(most));
            check_cut(tree, &cut, name);
            for node in cut {
                let parent = ancestry.parents[node as usize];
                let counts = [node, parent].map(|node| ancestry.primitive_counts[node as usize]);
                assert!(tree.nodes[node as usize].is_leaf() || counts[0] <= most, "{name}: too many primitives");
                assert!(node == 0 || counts[1] > most, "{name}: its parent has few enough");
            }
        }
    });
}

#[test]
fn cuts_hold_each_primitive_once_in_any_tree() {
    let triangles = trees::soup(5_000, 0.1, 102);
    let builders =
        [(BuilderKind::Aac, Passes::NONE), (BuilderKind::Aac, Passes::ALL), (BuilderKind::Lbvh, Passes::NONE)];
    for (builder, optimize) in builders {
        for container in ContainerKind::ALL {
            let settings = BuildSettings { builder, optimize, container, rounds: 6, ..BuildSettings::default() };
            let (tree, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
            let leaves = tree.node_count() as u32 / 2 + 1;
            check_cuts(&tree, leaves, &format!("{settings:?}"));
        }
    }
    for (name, triangles) in trees::nasty_scenes() {
        let tree = construct(&triangles, &BuildSettings::default()).tree;
        let token = CancelToken::new();
        for cut in [Cut::Clusters(5), Cut::Area(0.1), Cut::Primitives(3)] {
            with_tree!(&tree, tree_ => check_cut(tree_, &cut.nodes(&tree, None, &token).unwrap(), name));
        }
    }
}

#[test]
fn a_cut_at_a_step_has_the_clusters_that_stand() {
    let triangles: Vec<Triangle> = trees::soup(3_000, 0.1, 103);
    let construction = construct(&triangles, &BuildSettings::default());
    let token = CancelToken::new();
    for timeline in timelines(&construction) {
        for step in [0, 1, 1_234, 2_998, 2_999, 9_999] {
            let cut = Cut::Step { order: timeline.order(), step };
            let mut nodes = cut.nodes(&construction.tree, Some(&timeline), &token).unwrap();
            with_tree!(&construction.tree, tree => {
                check_cut(tree, &nodes, timeline.order().name());
                nodes.sort_unstable();
                assert_eq!(nodes, standing(tree, timeline.nodes(), step.min(2_999)));
            });
        }
    }
    let level = Cut::Step { order: MergeOrder::Level, step: 3 };
    assert_eq!(level.nodes(&construction.tree, None, &token), Err(CutError::NeedsTimeline));
    let [built, ..] = timelines(&construction);
    assert_eq!(level.nodes(&construction.tree, Some(&built), &token), Err(CutError::NeedsTimeline), "of another order");
    token.cancel();
    assert_eq!(Cut::Primitives(1).nodes(&construction.tree, None, &token), Err(CutError::Cancelled(Cancelled)));
}

#[test]
fn no_tree_has_an_empty_cut() {
    let empty = AnyTree::Sphere(Tree::EMPTY);
    for cut in [Cut::Clusters(3), Cut::Area(0.5), Cut::Primitives(3)] {
        assert_eq!(cut.nodes(&empty, None, &CancelToken::new()), Ok(vec![]));
    }
}
