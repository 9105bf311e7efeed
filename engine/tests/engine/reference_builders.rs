//! The builders that papers compare with, against their definitions written down plainly.

use bvhscope_engine::builders::build_binary;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Triangle};
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve};
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::tree::{AnyTree, ContainerKind, Tree};
use glam::Vec3;

use crate::random::Random;
use crate::trees;

fn built(triangles: &[Triangle], builder: BuilderKind) -> Tree<Aabb> {
    let settings = BuildSettings { builder, ..BuildSettings::default() };
    match build_binary(triangles, &settings, &CancelToken::new()).unwrap().0 {
        AnyTree::Aabb(tree) => tree,
        _ => panic!("not boxes"),
    }
}

/// The triangles below each node, sorted.
fn below(tree: &Tree<Aabb>) -> Vec<Vec<u32>> {
    let mut lists = vec![Vec::new(); tree.nodes.len()];
    for (at, node) in tree.nodes.iter().enumerate().rev() {
        let first = node.first as usize;
        lists[at] = if node.is_leaf() {
            tree.primitive_indices[first..first + node.count as usize].to_vec()
        } else {
            [&lists[first][..], &lists[first + 1][..]].concat()
        };
        lists[at].sort_unstable();
    }
    lists
}

fn box_of(triangles: &[Triangle], list: &[u32]) -> Aabb {
    list.iter().fold(Aabb::EMPTY, |all, &index| all.union(&triangles[index as usize].bounds()))
}

/// Area times number of triangles of both sides.
fn split_cost(triangles: &[Triangle], sides: [&[u32]; 2]) -> f64 {
    sides.iter().map(|side| f64::from(box_of(triangles, side).half_area()) * side.len() as f64).sum()
}

/// Cost of the cheapest division of `list` by its order along an axis, found by trying all.
fn best_cost(triangles: &[Triangle], list: &[u32]) -> f64 {
    let mut best = f64::INFINITY;
    for axis in 0..3 {
        let mut order = list.to_vec();
        order.sort_by(|&a, &b| {
            let centre = |index: u32| triangles[index as usize].bounds().center()[axis];
            centre(a).total_cmp(&centre(b)).then(a.cmp(&b))
        });
        for left in 1..order.len() {
            let (first, second) = order.split_at(left);
            best = best.min(split_cost(triangles, [first, second]));
        }
    }
    best
}

/// Sizes from fine to coarse, many centres alike along an axis.
fn mixed(count: usize, seed: u64) -> Vec<Triangle> {
    let mut random = Random(seed);
    (0..count)
        .map(|at| {
            let snapped = (random.vector() * 4.0).round() / 4.0;
            let a = if at % 3 == 0 { snapped } else { random.vector() };
            let size = 0.02 + random.signed().powi(4);
            Triangle { a, b: a + random.vector() * size, c: a + random.vector() * size }
        })
        .collect()
}

#[test]
fn each_split_of_the_sweep_is_the_best_of_all() {
    for (seed, count) in [2, 3, 4, 5, 17, 64, 150].into_iter().enumerate() {
        for triangles in [mixed(count, seed as u64), trees::soup(count, 0.4, seed as u64), trees::grid(6, 1, 0.0)] {
            let tree = built(&triangles, BuilderKind::Sweep);
            let lists = below(&tree);
            for (at, node) in tree.nodes.iter().enumerate().filter(|(_, node)| !node.is_leaf()) {
                let first = node.first as usize;
                let cost = split_cost(&triangles, [&lists[first], &lists[first + 1]]);
                let best = best_cost(&triangles, &lists[at]);
                assert!(cost <= best * (1.0 + 1e-6), "{count} triangles, node {at}: {cost} instead of {best}");
            }
        }
    }
}

/// More than one task, and the order of whole lists after many divisions.
#[test]
fn the_first_splits_of_a_large_sweep_cost_no_more_than_bins() {
    for seed in 0..3 {
        let triangles = mixed(12_000, seed);
        let [sweep, binned] = [BuilderKind::Sweep, BuilderKind::BinnedSah].map(|builder| built(&triangles, builder));
        let first = |tree: &Tree<Aabb>| {
            let lists = below(tree);
            let at = tree.nodes[0].first as usize;
            split_cost(&triangles, [&lists[at], &lists[at + 1]])
        };
        assert!(first(&sweep) <= first(&binned) * (1.0 + 1e-6), "{} and {}", first(&sweep), first(&binned));
        let lists = below(&sweep);
        for (at, node) in sweep.nodes.iter().enumerate().filter(|(_, node)| !node.is_leaf()) {
            if (2..300).contains(&lists[at].len()) {
                let at_children = node.first as usize;
                let cost = split_cost(&triangles, [&lists[at_children], &lists[at_children + 1]]);
                assert!(cost <= best_cost(&triangles, &lists[at]) * (1.0 + 1e-6), "node {at}");
            }
        }
    }
}

/// Box and sorted triangles of a cluster.
type PlainCluster = (Aabb, Vec<u32>);

/// A round of parallel locally-ordered clustering by its text, one cluster after the other. Adds the triangles that each merge joins to
/// `merged`.
fn plain_round(clusters: &[PlainCluster], merged: &mut Vec<Vec<u32>>) -> Vec<PlainCluster> {
    const RADIUS: usize = 8;
    let nearest = |at: usize| {
        let near = at.saturating_sub(RADIUS)..=(at + RADIUS).min(clusters.len() - 1);
        let others = near.filter(|&other| other != at);
        let distance = |other: usize| clusters[at].0.union(&clusters[other].0).half_area();
        others.min_by(|&a, &b| distance(a).total_cmp(&distance(b)).then((at ^ a).cmp(&(at ^ b)))).unwrap()
    };
    let mut next = Vec::new();
    for at in 0..clusters.len() {
        let other = nearest(at);
        if nearest(other) != at {
            next.push(clusters[at].clone());
        } else if at < other {
            let mut list = [&clusters[at].1[..], &clusters[other].1[..]].concat();
            list.sort_unstable();
            merged.push(list.clone());
            next.push((clusters[at].0.union(&clusters[other].0), list));
        }
    }
    next
}

/// The triangles of each merge of PLOC along the curve of an LBVH.
fn plain_ploc(triangles: &[Triangle], lbvh: &Tree<Aabb>) -> Vec<Vec<u32>> {
    let mut clusters: Vec<PlainCluster> =
        lbvh.primitive_indices.iter().map(|&index| (triangles[index as usize].bounds(), vec![index])).collect();
    let mut merged = Vec::new();
    while clusters.len() > 1 {
        clusters = plain_round(&clusters, &mut merged);
    }
    merged
}

/// The triangles of each merge of H-PLOC along the nodes of an LBVH: a node above more than 16 triangles leaves 16 clusters or fewer.
fn plain_hploc(triangles: &[Triangle], lbvh: &Tree<Aabb>) -> Vec<Vec<u32>> {
    const HALF_WAVE: usize = 16;
    let mut merged = Vec::new();
    let mut left_by: Vec<Vec<PlainCluster>> = vec![Vec::new(); lbvh.nodes.len()];
    for (at, node) in lbvh.nodes.iter().enumerate().rev() {
        let first = node.first as usize;
        let mut clusters = if node.is_leaf() {
            let index = lbvh.primitive_indices[first];
            vec![(triangles[index as usize].bounds(), vec![index])]
        } else {
            [std::mem::take(&mut left_by[first]), std::mem::take(&mut left_by[first + 1])].concat()
        };
        assert!(clusters.len() <= 2 * HALF_WAVE, "more than a wave");
        let below: usize = clusters.iter().map(|cluster| cluster.1.len()).sum();
        let target = if at == 0 { 1 } else { HALF_WAVE };
        while (at == 0 || below > HALF_WAVE) && clusters.len() > target {
            clusters = plain_round(&clusters, &mut merged);
        }
        left_by[at] = clusters;
    }
    assert_eq!(left_by[0].len(), 1, "one tree");
    merged
}

/// The order of the builders along the curve is that of the leaves of an LBVH.
#[test]
fn ploc_and_hploc_merge_mutual_nearest_neighbours_within_their_radius() {
    type Plain = fn(&[Triangle], &Tree<Aabb>) -> Vec<Vec<u32>>;
    let builders: [(BuilderKind, Plain); 2] = [(BuilderKind::Ploc, plain_ploc), (BuilderKind::Hploc, plain_hploc)];
    for curve in Curve::ALL {
        for (seed, count) in [2, 3, 9, 16, 17, 33, 40, 400, 3000].into_iter().enumerate() {
            for triangles in [mixed(count, seed as u64), trees::soup(count, 0.2, seed as u64)] {
                let tree = |builder| {
                    let settings = BuildSettings { builder, curve, ..BuildSettings::default() };
                    let AnyTree::Aabb(tree) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap().0
                    else {
                        panic!("not boxes")
                    };
                    tree
                };
                let lbvh = tree(BuilderKind::Lbvh);
                for (builder, plain) in builders {
                    let mut expected = plain(&triangles, &lbvh);
                    expected.sort();
                    let built = tree(builder);
                    let lists = below(&built);
                    let interior = built.nodes.iter().zip(&lists).filter(|(node, _)| !node.is_leaf());
                    let mut merged: Vec<Vec<u32>> = interior.map(|(_, list)| list.clone()).collect();
                    merged.sort();
                    assert!(merged == expected, "{} of {count} triangles along {}", builder.name(), curve.name());
                }
            }
        }
    }
}

/// More primitives than one task, of any container.
#[test]
fn hploc_is_nearly_as_good_as_ploc() {
    let triangles = mixed(20_000, 5);
    for container in ContainerKind::ALL {
        let cost = |builder| {
            let settings = BuildSettings { builder, container, ..BuildSettings::default() };
            let tree = build_binary(&triangles, &settings, &CancelToken::new()).unwrap().0;
            tree_stats(&tree, &CancelToken::new()).unwrap().sah_cost
        };
        let [lbvh, ploc, hploc] = [BuilderKind::Lbvh, BuilderKind::Ploc, BuilderKind::Hploc].map(cost);
        assert!((0.95 * ploc..1.1 * ploc).contains(&hploc), "{}: PLOC {ploc}, H-PLOC {hploc}", container.name());
        assert!(hploc < 0.9 * lbvh, "{}: LBVH {lbvh}, H-PLOC {hploc}", container.name());
    }
}

/// How often a build polls its token: often in proportion to the work.
fn polls(triangles: &[Triangle], settings: &BuildSettings) -> u64 {
    use std::sync::atomic::{AtomicU64, Ordering};
    let polls = std::sync::Arc::new(AtomicU64::new(0));
    let counted = std::sync::Arc::clone(&polls);
    let token = CancelToken::watched(move |_| {
        counted.fetch_add(1, Ordering::Relaxed);
        false
    });
    build_binary(triangles, settings, &token).unwrap();
    polls.load(Ordering::Relaxed)
}

/// A name, and each triangle by its index.
type Scene = (&'static str, fn(usize) -> Triangle);

/// Of nested triangles only the two smallest are each other's nearest, of steps that grow only the two closest.
#[test]
fn the_rounds_of_ploc_stay_few_where_hardly_any_clusters_are_mutual_neighbours() {
    fn at(position: f32, size: f32) -> Triangle {
        let a = Vec3::splat(position);
        Triangle { a: a - size, b: a + size, c: a + Vec3::new(size, -size, size) }
    }
    for container in ContainerKind::ALL {
        let nested = |k: usize| at(0.0, 1.0 + k as f32);
        let growing = |k: usize| at((k as f32).powi(2), 0.1);
        let equal = |_: usize| at(0.0, 1.0);
        let scenes: [Scene; 3] = [("nested", nested), ("growing steps", growing), ("equal", equal)];
        for (name, triangle) in scenes {
            for builder in [BuilderKind::Ploc, BuilderKind::Hploc, BuilderKind::Sweep] {
                let settings = BuildSettings { builder, container, ..BuildSettings::default() };
                if settings.refusal(0).is_some() {
                    continue;
                }
                let scene = |count: usize| (0..count).map(triangle).collect::<Vec<_>>();
                let [small, large] = [4_000, 32_000].map(|count| polls(&scene(count), &settings));
                let what = format!("{} {name} {}", builder.name(), container.name());
                assert!(large <= 12 * small, "{what}: {small} polls, and {large} for eight times as many triangles");
            }
        }
    }
}
