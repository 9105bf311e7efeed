//! Why two clusters were merged: by hand, and the builder's rule in every merge of random scenes.

use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::construction::{Construction, MergeChoice, merge_area};
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Preset};
use bvhscope_engine::tree::{Container, ContainerKind, Tree};
use bvhscope_engine::with_tree;
use glam::Vec3;

use crate::construction::construct;
use crate::trees;

fn choice(construction: &Construction, merge: u32) -> MergeChoice {
    construction.choice(merge, &CancelToken::new()).unwrap().unwrap()
}

/// Half a unit square across the x axis.
fn at(x: f32) -> Triangle {
    let a = Vec3::X * x;
    Triangle { a, b: a + Vec3::Y, c: a + Vec3::Z }
}

#[test]
fn four_in_a_row_by_hand() {
    // A box of length x has half the area 2x + 1. Closest are 0 and 1 (3), then 7 and 10 (7), then everything (21).
    let triangles = [0.0, 1.0, 10.0, 7.0].map(at);
    let construction = construct(&triangles, &BuildSettings { threshold: 64, ..BuildSettings::default() });
    let [first, second, last] = [0, 1, 2].map(|merge| choice(&construction, merge));
    let leaf_of = |primitive: u32| {
        with_tree!(&construction.tree, tree => {
            let is_leaf = |node: &u32| tree.nodes[*node as usize].is_leaf();
            let leaves = (0..tree.nodes.len() as u32).filter(is_leaf);
            leaves.into_iter().find(|&leaf| tree.first_primitive_below(leaf) == Some(primitive)).unwrap()
        })
    };
    let pair = |a: u32, b: u32| [a.min(b), a.max(b)];
    let [zero, one, ten, seven] = [0, 1, 2, 3].map(leaf_of);
    assert_eq!((first.winner.nodes, first.winner.distance, first.winner.primitives), (pair(zero, one), 3.0, 2));
    let runner_up = first.runner_up.unwrap();
    assert_eq!((runner_up.nodes, runner_up.distance), (pair(seven, ten), 7.0));
    assert_eq!(first.margin(), Some(7.0 / 3.0 - 1.0));
    let distances: Vec<f32> = first.pairs.iter().map(|pair| pair.distance).collect();
    assert_eq!(distances, [3.0, 7.0, 13.0, 15.0, 19.0, 21.0], "all pairs, the closest first");
    let nearest: Vec<f32> = first.clusters.iter().map(|cluster| cluster.distance).collect();
    assert_eq!((first.clusters.len(), nearest), (4, vec![3.0, 3.0, 7.0, 7.0]));
    assert_eq!(first.clusters[0].nearest, first.clusters[1].node);
    let infinite = f32::INFINITY;
    assert_eq!(first.distances[0..2], [infinite, 3.0]);
    assert!((0..4).all(|i| (0..4).all(|j| first.distances[4 * i + j] == first.distances[4 * j + i])));

    assert_eq!((second.winner.nodes, second.winner.distance), (pair(seven, ten), 7.0));
    let runner_up = second.runner_up.unwrap();
    assert_eq!((runner_up.distance, runner_up.primitives), (15.0, 3), "0 and 1 together with 7");
    assert_eq!((last.winner.distance, last.winner.primitives, last.runner_up, last.margin()), (21.0, 4, None, None));
    assert_eq!((last.node, last.clusters.len()), (0, 2));
    assert_eq!(merge_area(ContainerKind::Aabb, 21.0), 42.0);
    assert_eq!(merge_area(ContainerKind::Dop14, 21.0), 42.0);
    assert!((merge_area(ContainerKind::Sphere, 2.0) - 50.265_48).abs() < 1e-4);
    assert_eq!(construction.choice(3, &CancelToken::new()), Ok(None));
}

/// The smallest distance and number of primitives of any pair of `list`, by unions of containers.
fn closest<C: Container>(tree: &Tree<C>, list: &[u32]) -> f32 {
    let container = |node: u32| tree.nodes[node as usize].container;
    let pairs = list.iter().enumerate().flat_map(|(at, &a)| list[at + 1..].iter().map(move |&b| (a, b)));
    pairs.map(|(a, b)| container(a).union(&container(b)).relative_area()).fold(f32::INFINITY, f32::min)
}

#[test]
fn the_closest_pair_wins_every_merge() {
    let settings = ContainerKind::ALL.into_iter().flat_map(|container| {
        let [fast, hq] = [Preset::Fast, Preset::AacHq].map(|preset| BuildSettings::preset(preset, container));
        // One list of all, and lists that are moved while they are merged.
        let exact = BuildSettings { builder: BuilderKind::Exact, ..fast };
        [(fast, 1_500), (hq, 1_500), (BuildSettings { threshold: 64, epsilon: 0.0, ..hq }, 1_500), (exact, 150)]
    });
    for (settings, count) in settings {
        let construction = construct(&trees::soup(count, 0.1, 104), &settings);
        for merge in 0..construction.record.len() as u32 {
            let choice = choice(&construction, merge);
            let key = |pair: &bvhscope_engine::construction::ClusterPair| (pair.distance, pair.primitives);
            assert_eq!(choice.winner, choice.pairs[0], "merge {merge}, {settings:?}");
            assert!(choice.runner_up.is_none_or(|other| key(&other) >= key(&choice.winner)));
            assert_eq!(choice.clusters.len() as u32, construction.record.list_length(merge).unwrap());
            if merge % 7 == 0 {
                let closest = with_tree!(&construction.tree, tree => closest(tree, &construction.list_before(merge)));
                let area = match settings.container {
                    ContainerKind::Aabb | ContainerKind::Dop14 | ContainerKind::Oriented => choice.winner.distance,
                    ContainerKind::Sphere => choice.winner.distance * choice.winner.distance,
                };
                assert!((area / closest - 1.0).abs() < 1e-5, "merge {merge}, {settings:?}: {area}, not {closest}");
            }
        }
    }
}

#[test]
fn of_equal_pairs_the_one_with_fewer_primitives_wins() {
    let triangles = trees::grid(30, 1, 0.0);
    let construction = construct(&triangles, &BuildSettings::default());
    let mut ties = 0;
    for merge in 0..construction.record.len() as u32 {
        let choice = choice(&construction, merge);
        let key = (choice.winner.distance, choice.winner.primitives);
        assert_eq!(key, (choice.pairs[0].distance, choice.pairs[0].primitives), "merge {merge}");
        ties += usize::from(choice.margin() == Some(0.0));
    }
    assert!(ties > 500, "only {ties} merges had a tie");
}

#[test]
fn long_lists_are_bounded_and_can_be_cancelled() {
    let settings = BuildSettings { builder: BuilderKind::Exact, ..BuildSettings::default() };
    let construction = construct(&trees::soup(1_000, 0.1, 105), &settings);
    let choice = choice(&construction, 0);
    assert_eq!((choice.clusters.len(), choice.matrix_size()), (1_000, 64));
    assert_eq!((choice.distances.len(), choice.pairs.len()), (64 * 64, 64));
    let token = CancelToken::watched(|checks| checks > 10);
    assert_eq!(construction.choice(0, &token), Err(Cancelled));
}

#[test]
fn huge_coordinates_have_finite_distances() {
    let huge: Vec<Triangle> =
        trees::soup(300, 0.1, 106).iter().map(|t| Triangle { a: t.a * 1e25, b: t.b * 1e25, c: t.c * 1e25 }).collect();
    for container in ContainerKind::ALL {
        let construction = construct(&huge, &BuildSettings { container, ..BuildSettings::default() });
        for merge in 0..construction.record.len() as u32 {
            let choice = choice(&construction, merge);
            assert!(choice.winner.distance.is_finite() && choice.winner == choice.pairs[0], "{choice:?}");
        }
    }
}
