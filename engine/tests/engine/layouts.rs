//! Described layouts: the hits of a linear scan, the counts of the engine's own wide tree digit for digit, and plans of least cost.

use bvhscope_engine::builders::build_binary;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Triangle};
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::layouts::{
    Collapse, KeptNodes, LaidQuery, LaidTree, Layout, MeasuredLayout, Planes, RayCounts, TRIANGLE_BYTES, WalkMemory,
};
use bvhscope_engine::settings::{BuildSettings, Pass, Passes, Preset};
use bvhscope_engine::tree::ancestry::Ancestry;
use bvhscope_engine::tree::traverse::{RayEvent, RayLog, TestCounts};
use bvhscope_engine::tree::visits::{RayQuery, measure_weighted_visits};
use bvhscope_engine::tree::{AnyTree, ContainerKind, Tree};
use bvhscope_engine::wide::trace::LineProbe;
use bvhscope_engine::wide::{AnyWideTree, NodeForm, WideTree, collapse};
use glam::Vec3;

use crate::trees::{self, scan};

fn token() -> CancelToken {
    CancelToken::new()
}

/// The binary tree of `triangles` that settings make.
fn built(triangles: &[Triangle], settings: BuildSettings) -> Tree<Aabb> {
    match build_binary(triangles, &settings, &token()).unwrap().0 {
        AnyTree::Aabb(tree) => tree,
        other => panic!("a tree of {}", other.container_kind().plural()),
    }
}

fn all_layouts(leaf_sizes: &[u32]) -> Vec<Layout> {
    let mut layouts = Vec::new();
    for children in [2, 3, 4, 8, 16] {
        for collapse in Collapse::ALL {
            for planes in Planes::ALL {
                layouts.extend(leaf_sizes.iter().map(|&leaf_size| Layout { children, collapse, planes, leaf_size }));
            }
        }
    }
    layouts
}

/// Visits of the nodes by some rays.
fn visits(tree: &Tree<Aabb>, triangles: &[Triangle]) -> Vec<u32> {
    let rays = trees::rays(triangles, 100, 5);
    let leaf_triangles = tree.leaf_triangles(triangles, &token()).unwrap();
    let ray = |index: u32| (rays[index as usize], RayQuery::AnyHit, 1);
    measure_weighted_visits(tree, &leaf_triangles, rays.len() as u32, ray, &token()).unwrap().counts
}

fn laid(tree: &Tree<Aabb>, layout: Layout, visits: &[u32]) -> LaidTree {
    LaidTree::new(tree, layout, Some(visits), &token()).unwrap()
}

#[test]
fn every_layout_hits_what_a_scan_hits() {
    let mut scenes = trees::nasty_scenes();
    scenes.push(("soup", trees::soup(150, 0.4, 9)));
    let mut hits = 0;
    for (name, triangles) in scenes {
        let tree = built(&triangles, BuildSettings::default());
        let visits = visits(&tree, &triangles);
        let leaf_triangles = tree.leaf_triangles(&triangles, &token()).unwrap();
        let rays = trees::rays(&triangles, 40, 3);
        let expected: Vec<_> = rays.iter().map(|ray| scan(&triangles, ray)).collect();
        let mut memory = WalkMemory::default();
        for layout in all_layouts(&[1, 4, 32]) {
            let laid = laid(&tree, layout, &visits);
            for (ray, expected) in rays.iter().zip(&expected) {
                let mut trace = |query| laid.trace(&leaf_triangles, ray, query, &mut memory);
                let (closest, counts) = trace(LaidQuery::Closest);
                let (through, all_counts) = trace(LaidQuery::Through);
                let (any, _) = trace(LaidQuery::Any);
                assert_eq!((closest, through), (*expected, *expected), "{name}: {layout:?}, {ray:?}");
                assert_eq!(any.is_some(), expected.is_some(), "{name}: {layout:?}, {ray:?}");
                assert!(counts.nodes <= all_counts.nodes && counts.triangle_tests <= all_counts.triangle_tests);
                hits += usize::from(expected.is_some());
            }
        }
    }
    assert!(hits > 10_000, "{hits}");
}

#[test]
fn trees_have_the_children_and_leaves_that_their_layout_allows() {
    let triangles = [trees::soup(500, 0.2, 4), trees::grid(12, 1, 0.0)].concat();
    let settings = [
        BuildSettings::default(),
        BuildSettings { optimize: Passes::NONE.with(Pass::Collapse), ..BuildSettings::default() },
        BuildSettings::preset(Preset::Swift, ContainerKind::Aabb),
    ];
    for tree in settings.map(|settings| built(&triangles, settings)) {
        let visits = visits(&tree, &triangles);
        let largest = tree.nodes.iter().filter(|node| node.is_leaf()).map(|node| node.count).max().unwrap();
        for layout in all_layouts(&[1, 2, 7, 32]) {
            let laid = laid(&tree, layout, &visits);
            let mut slots = vec![0; tree.primitive_indices.len()];
            let (mut nodes, mut leaves, mut children, mut references) = (0, 0, 0, 0);
            for node in &laid.tree.nodes {
                if node.is_leaf() {
                    assert!(node.count <= layout.leaf_size.max(largest), "{layout:?}: {} triangles", node.count);
                    node.slots().for_each(|slot| slots[slot] += 1);
                    leaves += 1;
                    continue;
                }
                assert!((2..=layout.children).contains(&node.arity()), "{layout:?}: {} children", node.arity());
                references += node.arity();
                nodes += 1;
                children += layout.children;
            }
            assert!(slots.iter().all(|&leaves| leaves == 1), "{layout:?}: each slot is in one leaf");
            let numbers = laid.numbers(&token()).unwrap();
            assert_eq!((numbers.nodes, numbers.leaves), (nodes, leaves));
            assert_eq!(numbers.node_bytes, nodes * layout.node_bytes());
            assert_eq!(numbers.triangle_bytes, slots.len() * TRIANGLE_BYTES);
            assert_eq!(numbers.fullness, f64::from(references) / f64::from(children.max(1)));
        }
    }
}

/// Cost of a laid tree, relative: of each node with children and of each triangle of a leaf, by area.
fn cost(tree: &Tree<Aabb>, [node_cost, triangle_cost]: [f64; 2]) -> f64 {
    let of_node = |node: &bvhscope_engine::tree::Node<Aabb>| {
        let cost = if node.is_leaf() { triangle_cost * f64::from(node.count) } else { node_cost };
        f64::from(node.container.half_area()) * cost
    };
    tree.nodes.iter().map(of_node).sum()
}

/// The least cost of a node of a binary tree that takes at most so many of `lanes`, by definition, and its number of triangles.
fn least_cost(tree: &Tree<Aabb>, layout: Layout, costs: [f64; 2], at: u32, lanes: u32) -> (f64, u32) {
    let node = &tree.nodes[at as usize];
    let area = f64::from(node.container.half_area());
    if node.is_leaf() {
        return (area * costs[1] * f64::from(node.count), node.count);
    }
    let divided = |lanes: u32| {
        let of = |left: u32| {
            let cost = |side: u32, lanes: u32| least_cost(tree, layout, costs, node.first + side, lanes).0;
            cost(0, left) + cost(1, lanes - left)
        };
        (1..lanes).map(of).fold(f64::INFINITY, f64::min)
    };
    let count = [0, 1].map(|side| least_cost(tree, layout, costs, node.first + side, 1).1).iter().sum();
    let leaf = if count <= layout.leaf_size { area * costs[1] * f64::from(count) } else { f64::INFINITY };
    let node = area * costs[0] + divided(layout.children);
    (leaf.min(node).min(divided(lanes)), count)
}

#[test]
fn plans_cost_least_by_their_own_measure() {
    for (children, leaf_size, count) in [(2, 1, 9), (2, 3, 9), (3, 2, 8), (4, 1, 7), (4, 4, 7)] {
        for seed in 0..6 {
            let tree = built(&trees::soup(count, 0.5, seed), BuildSettings::default());
            for collapse in [Collapse::Optimal, Collapse::Memory] {
                let layout = Layout { children, collapse, planes: Planes::F32, leaf_size };
                let costs = match collapse {
                    Collapse::Memory => [layout.node_bytes() as f64, TRIANGLE_BYTES as f64],
                    _ => [1.0, 0.3],
                };
                let (found, least) =
                    (cost(&laid(&tree, layout, &[]).tree, costs), least_cost(&tree, layout, costs, 0, 1).0);
                assert!((found - least).abs() <= least * 1e-5, "{layout:?}, seed {seed}: {found}, at best {least}");
            }
        }
    }
}

#[test]
fn no_other_plan_is_better_by_the_measure_of_one() {
    let triangles = [trees::soup(900, 0.1, 4), trees::ball(Vec3::ZERO, 1.0, 20)].concat();
    let tree = built(&triangles, BuildSettings::default());
    for children in [2, 4, 8, 16] {
        for leaf_size in [1, 4, 16] {
            let of = |collapse| {
                let layout = Layout { children, collapse, planes: Planes::F32, leaf_size };
                let laid = laid(&tree, layout, &[]);
                (cost(&laid.tree, [1.0, 0.3]), laid.numbers(&token()).unwrap().msah_bytes)
            };
            let [greedy, optimal, memory] = [Collapse::Greedy, Collapse::Optimal, Collapse::Memory].map(of);
            let slack = 1.0 + 1e-5;
            assert!(optimal.0 <= greedy.0 * slack && optimal.0 <= memory.0 * slack, "{children}, {leaf_size}");
            assert!(memory.1 <= greedy.1 * slack && memory.1 <= optimal.1 * slack, "{children}, {leaf_size}");
        }
    }
}

/// The engine's wide trees of a scene, in both forms, each with the binary tree that it was made from.
fn wide_trees(triangles: &[Triangle]) -> Vec<(Tree<Aabb>, WideTree<Aabb>)> {
    let boxes = BuildSettings::default();
    let settings = [
        boxes,
        BuildSettings::preset(Preset::Swift, ContainerKind::Aabb),
        BuildSettings { optimize: Passes::NONE.with(Pass::Split), ..boxes },
        BuildSettings { optimize: Passes::NONE.with(Pass::Collapse), ..boxes },
    ];
    let mut made = Vec::new();
    for settings in settings {
        let tree = built(triangles, settings);
        for form in [NodeForm::Full, NodeForm::Compact] {
            made.push((tree.clone(), collapse(&tree, triangles, form, &token()).unwrap()));
        }
    }
    made
}

/// The most nodes that wait on the stack at once.
fn greatest_stack(events: &[RayEvent]) -> u64 {
    let (mut waiting, mut most) = (0_u64, 0);
    for event in events {
        match event {
            RayEvent::Push { .. } => waiting += 1,
            RayEvent::Pop { .. } => waiting -= 1,
            _ => {}
        }
        most = most.max(waiting);
    }
    most
}

#[test]
fn the_engines_own_tree_described_has_its_counts_digit_for_digit() {
    let level = SimdLevel::best().level();
    let (mut rays_with_stack, mut compact, mut blocks) = (0, 0, 0);
    for triangles in [
        [trees::soup(700, 0.3, 3), trees::ball(Vec3::ZERO, 1.0, 12)].concat(),
        trees::grid(30, 0, 0.5),
        trees::soup(1, 1.0, 2),
        trees::soup(3, 0.1, 2),
    ] {
        let rays = trees::rays(&triangles, 300, 17);
        for (tree, wide) in wide_trees(&triangles) {
            let laid = LaidTree::of_wide(&wide, &tree, &token()).unwrap();
            let numbers = laid.numbers(&token()).unwrap();
            compact += wide.compact_nodes.len();
            assert_eq!(numbers.nodes, wide.nodes.len() + wide.compact_nodes.len());
            assert_eq!(numbers.node_bytes, wide.node_bytes());
            // Behind the last triangle the engine keeps the values that make the last block whole.
            assert!((1..64).contains(&((wide.leaf_bytes() - numbers.triangle_bytes) / 4)));
            let leaf_triangles = tree.leaf_triangles(&triangles, &token()).unwrap();
            let wide = AnyWideTree::Aabb(wide);
            let (mut probe, mut memory) = (LineProbe::new(&wide), WalkMemory::default());
            for (ray, query) in rays.iter().flat_map(|ray| [(ray, LaidQuery::Closest), (ray, LaidQuery::Any)]) {
                let (hit, found) = laid.trace(&leaf_triangles, ray, query, &mut memory);
                let (mut tests, mut log) = (TestCounts::default(), RayLog::default());
                if query == LaidQuery::Any {
                    assert_eq!(wide.any_hit_with(level, ray, &mut tests), hit.is_some());
                    wide.any_hit_with(level, ray, &mut probe);
                    wide.any_hit_with(level, ray, &mut log);
                } else {
                    assert_eq!(wide.closest_hit_with(level, ray, &mut tests), hit);
                    wide.closest_hit_with(level, ray, &mut probe);
                    wide.closest_hit_with(level, ray, &mut log);
                }
                let events = log.events();
                let count = |is_one: fn(&RayEvent) -> bool| events.iter().filter(|event| is_one(event)).count() as u64;
                let visits = count(|event| matches!(event, RayEvent::Visit { .. }));
                let boxes = count(|event| matches!(event, RayEvent::Enter { .. } | RayEvent::Miss { .. }));
                let triangles = count(|event| matches!(event, RayEvent::Triangle { .. }));
                assert_eq!([found.nodes, found.block_tests], [tests.containers, tests.primitives], "{query:?} {ray:?}");
                assert_eq!(found.nodes + found.leaves, visits, "{query:?} {ray:?}");
                assert_eq!([found.container_tests, found.triangle_tests], [boxes, triangles], "{query:?} {ray:?}");
                assert_eq!(found.lines[0], probe.take(), "{query:?} {ray:?}");
                assert_eq!(found.greatest_stack, greatest_stack(events), "{query:?} {ray:?}");
                rays_with_stack += u64::from(found.greatest_stack > 2);
                blocks += found.block_tests;
            }
        }
    }
    assert!(rays_with_stack > 500 && compact > 100 && blocks > 5_000, "{rays_with_stack}, {compact}, {blocks}");
}

/// Checks the kept nodes of a laid tree by the ancestors of each binary node.
fn check_kept(laid: &LaidTree, binary: &Tree<Aabb>) {
    let kept = KeptNodes::new(laid.clone(), binary, &token()).unwrap();
    assert_eq!(kept.len(), laid.tree.nodes.len());
    let ancestry = Ancestry::new(binary, &token()).unwrap();
    let mut found = 0;
    let mut by_depth = vec![0; laid.tree.max_depth as usize + 1];
    for node in 0..binary.nodes.len() as u32 {
        let above = |node: &u32| (*node > 0).then(|| ancestry.parents[*node as usize]);
        let ancestors = std::iter::successors(above(&node), above).filter(|node| kept.keeps(*node));
        if !kept.keeps(node) {
            assert!(kept.children(node).is_empty() && kept.depth(node).is_none() && kept.parent(node).is_none());
            continue;
        }
        found += 1;
        let ancestors: Vec<u32> = ancestors.collect();
        assert_eq!((kept.parent(node), kept.depth(node)), (ancestors.first().copied(), Some(ancestors.len() as u32)));
        by_depth[ancestors.len()] += 1;
        let children = kept.children(node);
        assert!(children.iter().all(|&child| kept.parent(child) == Some(node)));
        let count = |node: u32| ancestry.primitive_counts[node as usize];
        let below = if children.is_empty() { kept.leaf_size(node) } else { children.iter().map(|&at| count(at)).sum() };
        assert_eq!(below, count(node), "a node has all triangles of its binary node");
        let (stored, own) = (kept.stored_box(node).unwrap(), binary.nodes[node as usize].container);
        assert_eq!(stored.union(&own), stored, "stored boxes enclose it");
    }
    assert_eq!(found, kept.len(), "each node is another binary node");
    let levels: Vec<usize> = kept.levels().ranges.iter().map(ExactSizeIterator::len).collect();
    assert_eq!(levels, by_depth);
}

#[test]
fn kept_nodes_are_those_of_the_wide_tree_by_their_binary_numbers() {
    let triangles = [trees::soup(900, 0.1, 4), trees::ball(Vec3::ZERO, 1.0, 20)].concat();
    for (tree, wide) in wide_trees(&triangles) {
        check_kept(&LaidTree::of_wide(&wide, &tree, &token()).unwrap(), &tree);
        for layout in all_layouts(&[1, 6]) {
            let layout = if layout.collapse == Collapse::Visits { continue } else { layout };
            check_kept(&laid(&tree, layout, &[]), &tree);
        }
    }
    let layout = Layout { children: 8, collapse: Collapse::Optimal, planes: Planes::F32, leaf_size: 4 };
    for triangles in [trees::soup(3, 0.1, 4), trees::soup(1, 0.1, 4)] {
        let tree = built(&triangles, BuildSettings::default());
        check_kept(&laid(&tree, layout, &[]), &tree);
    }
    let kept = KeptNodes::new(laid(&Tree::EMPTY, layout, &[]), &Tree::EMPTY, &token()).unwrap();
    assert!(kept.is_empty() && kept.levels().ranges.is_empty());
}

#[test]
fn lines_of_128_bytes_are_pairs_of_those_of_64() {
    let triangles = trees::soup(400, 0.3, 8);
    let tree = built(&triangles, BuildSettings::default());
    let leaf_triangles = tree.leaf_triangles(&triangles, &token()).unwrap();
    // Nodes of 64 bytes, one a line of 64.
    let layout = Layout { children: 4, collapse: Collapse::Optimal, planes: Planes::Bits8, leaf_size: 4 };
    let laid = laid(&tree, layout, &[]);
    let mut memory = WalkMemory::default();
    for ray in trees::rays(&triangles, 200, 1) {
        let (_, counts) = laid.trace(&leaf_triangles, &ray, LaidQuery::Closest, &mut memory);
        let [small, large] = counts.lines;
        assert_eq!(small.nodes, counts.nodes);
        assert!(large.nodes <= small.nodes && small.nodes <= 2 * large.nodes);
        assert!(large.triangles <= small.triangles && small.triangles <= 2 * large.triangles);
        assert_eq!(counts.bytes, 64 * counts.nodes + 40 * counts.triangle_tests);
    }
}

#[test]
fn rays_count_as_many_times_as_rays_they_stand_for_on_any_number_of_threads() {
    let triangles = trees::soup(900, 0.2, 6);
    let tree = built(&triangles, BuildSettings::default());
    let leaf_triangles = tree.leaf_triangles(&triangles, &token()).unwrap();
    let wide = AnyWideTree::new(&AnyTree::Aabb(tree.clone()), &triangles, NodeForm::Full, &token()).unwrap();
    let rays = trees::rays(&triangles, 1500, 2);
    let layout = Layout { children: 8, collapse: Collapse::Greedy, planes: Planes::Bits8, leaf_size: 4 };
    let laid = laid(&tree, layout, &[]);
    let query = |index: usize| [LaidQuery::Closest, LaidQuery::Any, LaidQuery::Through][index % 3];
    let measure = |threads: usize, weight: fn(usize) -> u32| {
        let ray = |index: usize| (rays[index], query(index), weight(index));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| laid.measure(&leaf_triangles, &wide, rays.len(), ray, &token()).unwrap())
    };
    let mut expected = MeasuredLayout::default();
    let mut memory = WalkMemory::default();
    for (index, ray) in rays.iter().enumerate() {
        let (hit, counts) = laid.trace(&leaf_triangles, ray, query(index), &mut memory);
        expected.counts += counts;
        expected.hits += u64::from(hit.is_some());
        expected.rays += 1;
    }
    let once = measure(1, |_| 1);
    assert_eq!(once, expected);
    assert_eq!(once, measure(3, |_| 1));
    let thrice = measure(2, |_| 3);
    assert_eq!((thrice.rays, thrice.hits), (3 * once.rays, 3 * once.hits));
    assert_eq!(thrice.counts.bytes, 3 * once.counts.bytes);
    assert_eq!(thrice.counts.lines[1].nodes, 3 * once.counts.lines[1].nodes);
    assert_eq!(thrice.counts.greatest_stack, once.counts.greatest_stack);
    assert_eq!(measure(2, |_| 0), MeasuredLayout::default());
}

#[test]
fn hits_that_differ_are_counted() {
    let triangles = trees::ball(Vec3::ZERO, 1.0, 12);
    let tree = built(&triangles, BuildSettings::default());
    let leaf_triangles = tree.leaf_triangles(&triangles, &token()).unwrap();
    // A tree of other triangles.
    let others = trees::ball(Vec3::ZERO, 0.5, 12);
    let other = AnyTree::Aabb(built(&others, BuildSettings::default()));
    let wide = AnyWideTree::new(&other, &others, NodeForm::Full, &token()).unwrap();
    let layout = Layout { children: 4, collapse: Collapse::Optimal, planes: Planes::F32, leaf_size: 4 };
    let rays = trees::rays(&triangles, 300, 2);
    let ray = |index: usize| (rays[index], LaidQuery::Closest, 1);
    let measured = laid(&tree, layout, &[]).measure(&leaf_triangles, &wide, rays.len(), ray, &token()).unwrap();
    assert!(measured.differing_hits > 50, "{measured:?}");
}

#[test]
fn an_empty_tree_has_no_nodes_and_a_single_leaf_no_boxes() {
    let layout = Layout { children: 8, collapse: Collapse::Optimal, planes: Planes::Bits8, leaf_size: 4 };
    let empty = laid(&Tree::EMPTY, layout, &[]);
    let numbers = empty.numbers(&token()).unwrap();
    assert_eq!((numbers.nodes, numbers.node_bytes, numbers.msah_bytes, numbers.leaf_size), (0, 0, 0.0, 0.0));
    let triangles = trees::soup(3, 1.0, 1);
    let ray = trees::rays(&triangles, 1, 1)[0];
    let mut memory = WalkMemory::default();
    assert_eq!(empty.trace(&[], &ray, LaidQuery::Closest, &mut memory), (None, RayCounts::default()));
    let AnyTree::Aabb(tree) = trees::halved::<Aabb>(&triangles, 4) else { panic!("a tree of boxes") };
    let leaf = laid(&tree, layout, &[]);
    let numbers = leaf.numbers(&token()).unwrap();
    assert_eq!((numbers.nodes, numbers.leaves, numbers.fullness, numbers.leaf_size), (0, 1, 0.0, 3.0));
    assert_eq!((numbers.node_bytes, numbers.triangle_bytes, numbers.msah_bytes), (0, 120, 120.0));
}

#[test]
fn laying_out_and_measuring_are_cancelled() {
    let triangles = trees::soup(200, 0.2, 6);
    let tree = built(&triangles, BuildSettings::default());
    let cancelled = token();
    cancelled.cancel();
    for layout in all_layouts(&[4]) {
        assert!(LaidTree::new(&tree, layout, None, &cancelled).is_err());
    }
    let layout = all_layouts(&[4])[0];
    let laid = laid(&tree, layout, &[]);
    assert!(laid.numbers(&cancelled).is_err());
    let wide = AnyWideTree::new(&AnyTree::Aabb(tree.clone()), &triangles, NodeForm::Full, &token()).unwrap();
    let ray = |_| (trees::rays(&triangles, 1, 1)[0], LaidQuery::Closest, 1);
    let leaf_triangles = tree.leaf_triangles(&triangles, &token()).unwrap();
    assert!(laid.measure(&leaf_triangles, &wide, 5, ray, &cancelled).is_err());
}
