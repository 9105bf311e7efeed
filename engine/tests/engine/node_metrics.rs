//! Metrics of single nodes by hand, by sums over the tree, and the nodes that are largest by them.

use bvhscope_engine::builders::build_binary;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Sphere};
use bvhscope_engine::settings::{BuildSettings, BuilderKind};
use bvhscope_engine::tree::largest::largest_nodes;
use bvhscope_engine::tree::node_metrics::{
    area_share, empty_space, intersections_of_children, overlap, sah_share, subtree_sah_shares,
};
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::tree::{AnyTree, Container, ContainerKind, Node, Tree};
use bvhscope_engine::with_tree;
use glam::Vec3;

use crate::random::Random;
use crate::trees;

fn token() -> CancelToken {
    CancelToken::new()
}

/// A root with two leaves.
fn family<C: Container>(root: C, children: [C; 2], counts: [u32; 2]) -> Tree<C> {
    let node = |container, first, count| Node { container, first, count };
    let [left, right] = children;
    let nodes = vec![node(root, 1, 0), node(left, 0, counts[0]), node(right, counts[0], counts[1])];
    Tree { nodes, primitive_indices: (0..counts[0] + counts[1]).collect(), max_depth: 1 }
}

/// The intersection of the root's two children.
fn first_intersection<C: Container>(tree: &Tree<C>, node: u32) -> Option<C> {
    intersections_of_children(tree, node).next()
}

fn cuboid(min: [f32; 3], max: [f32; 3]) -> Aabb {
    Aabb { min: min.into(), max: max.into() }
}

#[test]
fn metrics_of_boxes_are_the_formulas() {
    // Half areas: root 4×2×2 → 20; two cubes of 2 that share a slab of 1×2×2 → 12 each, 8 in common.
    let (left, right) = (cuboid([0.0; 3], [2.0; 3]), cuboid([1.0, 0.0, 0.0], [3.0, 2.0, 2.0]));
    let root = cuboid([0.0; 3], [4.0, 2.0, 2.0]);
    let tree = family(root, [left, right], [1, 3]);
    assert_eq!((area_share(&tree, 0), area_share(&tree, 1)), (1.0, 0.6));
    assert_eq!(empty_space(&tree, 0), Some(1.0 - 24.0 / 40.0));
    assert_eq!(overlap(&tree, 0), Some(0.4));
    assert_eq!(first_intersection(&tree, 0), Some(cuboid([1.0, 0.0, 0.0], [2.0; 3])));
    assert_eq!((empty_space(&tree, 1), overlap(&tree, 1), first_intersection(&tree, 1)), (None, None, None));
    // Costs: 20, 12 and 3 · 12.
    let any = AnyTree::Aabb(tree.clone());
    let stats = tree_stats(&any, &token()).unwrap();
    let shares = [0, 1, 2].map(|node| sah_share(&tree, node, &stats));
    for (share, expected) in shares.into_iter().zip([20.0, 12.0, 36.0]) {
        assert!((share - expected / 68.0).abs() < 1e-6, "{shares:?}");
    }
    // Faces that touch have a surface in common, but only corners that touch have none.
    let beside = family(root, [left, cuboid([2.0, 0.0, 0.0], [4.0, 2.0, 2.0])], [1, 1]);
    assert_eq!((overlap(&beside, 0), empty_space(&beside, 0)), (Some(0.2), Some(1.0 - 24.0 / 40.0)));
    let across = family(cuboid([0.0; 3], [4.0; 3]), [left, cuboid([2.0; 3], [4.0; 3])], [1, 1]);
    assert_eq!((overlap(&across, 0), first_intersection(&across, 0)), (Some(0.0), Some(cuboid([2.0; 3], [2.0; 3]))));
    let apart = family(root, [left, cuboid([3.0, 0.0, 0.0], [4.0, 2.0, 2.0])], [1, 1]);
    assert_eq!((overlap(&apart, 0), first_intersection(&apart, 0)), (Some(0.0), None));
    // Children as large as the node leave nothing empty and overlap wholly.
    let full = family(root, [root, root], [1, 1]);
    assert_eq!((overlap(&full, 0), empty_space(&full, 0)), (Some(1.0), Some(0.0)));
}

#[test]
fn metrics_of_spheres_are_the_formulas() {
    let at = |x: f32, radius: f32| Sphere { center: Vec3::X * x, radius };
    // Two unit spheres at a distance of 1: each cap is half a radius high, a quarter of a sphere. Together half of one, in a root of
    // radius 1.5.
    let tree = family(at(0.5, 1.5), [at(0.0, 1.0), at(1.0, 1.0)], [1, 1]);
    assert!((overlap(&tree, 0).unwrap() - 0.5 / 2.25).abs() < 1e-6, "{:?}", overlap(&tree, 0));
    assert!((empty_space(&tree, 0).unwrap() - (1.0 - 2.0 / 4.5)).abs() < 1e-6);
    let lens = first_intersection(&tree, 0).unwrap();
    assert!(lens.center.distance(Vec3::X * 0.5) < 1e-6 && (lens.radius - 0.75_f32.sqrt()).abs() < 1e-6);
    let apart = family(at(0.0, 3.0), [at(-2.0, 1.0), at(2.0, 1.0)], [1, 1]);
    assert_eq!((overlap(&apart, 0), first_intersection(&apart, 0)), (Some(0.0), None));
    let nested = family(at(0.0, 2.0), [at(0.0, 2.0), at(0.5, 1.0)], [1, 1]);
    assert_eq!((overlap(&nested, 0), first_intersection(&nested, 0)), (Some(0.25), Some(at(0.5, 1.0))));
}

#[test]
fn shares_of_cost_add_up_and_every_metric_is_a_fraction() {
    for (name, triangles) in trees::nasty_scenes() {
        for container in ContainerKind::ALL {
            let settings = BuildSettings { builder: BuilderKind::Aac, container, ..BuildSettings::default() };
            let (tree, _) = build_binary(&triangles, &settings, &token()).unwrap();
            let stats = tree_stats(&tree, &token()).unwrap();
            with_tree!(&tree, tree => {
                let subtrees = subtree_sah_shares(tree, &token()).unwrap();
                let mut sum = 0.0;
                for (index, node) in tree.nodes.iter().enumerate() {
                    let at = index as u32;
                    let own = sah_share(tree, at, &stats);
                    sum += f64::from(own);
                    let below = if node.is_leaf() { 0.0 } else { subtrees[node.first as usize] + subtrees[node.first as usize + 1] };
                    assert!((subtrees[index] - own - below).abs() < 1e-4, "{name}, {container:?}, node {index}");
                    let metrics = [own, subtrees[index], area_share(tree, at)];
                    let of_interior = [empty_space(tree, at), overlap(tree, at)];
                    assert_eq!(of_interior.map(|metric| metric.is_none()), [node.is_leaf(); 2]);
                    let all = metrics.into_iter().chain(of_interior.into_iter().flatten());
                    all.for_each(|metric| assert!((0.0..=1.0).contains(&metric), "{name}, {container:?}: {metric}"));
                }
                assert!(stats.sah_cost == 0.0 || (sum - 1.0).abs() < 1e-3, "{name}, {container:?}: {sum}");
                assert!(stats.sah_cost == 0.0 || subtrees[0] == 1.0);
            });
        }
    }
    assert!(subtree_sah_shares(&Tree::<Aabb>::EMPTY, &token()).unwrap().is_empty());
}

#[test]
fn the_largest_nodes_are_those_that_sorting_finds() {
    let mut random = Random(3);
    // Few different values, so that many are equal, of all signs.
    let values: Vec<f32> = (0..100_000)
        .map(|_| match random.below(50) {
            0 => f32::NAN,
            1 => f32::INFINITY,
            2 => f32::NEG_INFINITY,
            3 => -0.0,
            4 => 0.0,
            _ => (random.signed() * 2_000.0).round(),
        })
        .collect();
    let mut sorted: Vec<(u32, f32)> = values.iter().enumerate().map(|(node, &value)| (node as u32, value)).collect();
    sorted.retain(|(_, value)| !value.is_nan());
    // Stable, so that equal values stay in the order of nodes; -0 equals 0.
    sorted.sort_by(|a, b| b.1.partial_cmp(&a.1).unwrap());
    for threads in [1, 4] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        for count in [0, 1, 7, 1_000, 3_000, 99_000, 200_000] {
            let found = pool.install(|| largest_nodes(values.len(), count, |node| values[node as usize], &token()));
            assert_eq!(found.unwrap(), sorted[..count.min(sorted.len())], "{count}");
        }
    }
    assert!(largest_nodes(0, 5, |_| 1.0, &token()).unwrap().is_empty());
}
