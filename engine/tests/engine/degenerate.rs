//! Triangles that coincide, cross or stand in one another: the work stays within its bounds, and what is estimated says so.

use bvhscope_engine::builders::build_binary;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Triangle};
use bvhscope_engine::settings::{BuildSettings, BuilderKind};
use bvhscope_engine::tree::overlap::{EndPointOverlap, end_point_overlap};
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::tree::{AnyTree, ContainerKind, Node, Tree};
use glam::Vec3;

use crate::trees;

/// Mean number of nodes that a sample may visit, and number of samples that are looked at whatever they visit.
const VISITS_PER_SAMPLE: u64 = 4096;
const LEAST_SAMPLES: u64 = 16;

fn halved(triangles: &[Triangle], container: ContainerKind) -> AnyTree {
    let settings = BuildSettings { builder: BuilderKind::Lbvh, container, ..BuildSettings::default() };
    build_binary(triangles, &settings, &CancelToken::new()).unwrap().0
}

fn overlap(tree: &AnyTree, triangles: &[Triangle], max_samples: usize) -> EndPointOverlap {
    end_point_overlap(tree, triangles, max_samples, &CancelToken::new()).unwrap()
}

#[test]
fn the_overlap_of_equal_triangles_takes_bounded_work_and_says_what_it_is_made_from() {
    let triangle = trees::soup(1, 0.5, 1)[0];
    let samples = 300;
    for container in ContainerKind::ALL {
        let found = [1_000, 8_000, 64_000].map(|count| {
            let triangles = vec![triangle; count];
            let tree = halved(&triangles, container);
            let found = overlap(&tree, &triangles, samples);
            let nodes = tree.node_count() as u64;
            assert!(
                found.visited <= samples as u64 * VISITS_PER_SAMPLE + LEAST_SAMPLES * nodes,
                "{container:?}, {count} triangles: {found:?}"
            );
            // Each triangle lies in all nodes but those that hold it: its leaf and the nodes above.
            let stats = tree_stats(&tree, &CancelToken::new()).unwrap();
            let foreign = (stats.nodes - stats.leaves) as f32 - stats.mean_leaf_depth;
            let exact = foreign * container.traversal_cost() + stats.leaves as f32 - 1.0;
            assert!((found.value / exact - 1.0).abs() < 1e-2, "{container:?}, {found:?} instead of {exact}");
            assert_eq!((found.triangles, found.is_exact()), (count, false));
            found
        });
        assert_eq!(found[0].sampled, samples, "few nodes, no limit");
        assert!(found[1].sampled < samples && found[1].sampled > LEAST_SAMPLES as usize, "{:?}", found[1]);
        assert_eq!(found[2].sampled, LEAST_SAMPLES as usize, "no fewer");
    }
}

#[test]
fn an_estimate_from_few_triangles_is_near_and_the_same_on_any_number_of_threads() {
    // Most of the triangles coincide, the others are strewn.
    let one = trees::soup(1, 0.5, 1)[0];
    let mut triangles = trees::soup(6_000, 0.5, 2);
    triangles.iter_mut().enumerate().filter(|(at, _)| at % 4 != 0).for_each(|(_, triangle)| *triangle = one);
    let tree = halved(&triangles, ContainerKind::Aabb);
    let exact = overlap(&tree, &triangles, usize::MAX);
    assert!(exact.is_exact() && exact.estimate_note().is_none(), "{exact:?}");
    let with_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| overlap(&tree, &triangles, 100))
    };
    let estimate = with_threads(1);
    assert!(estimate.sampled < 100, "{estimate:?}");
    assert!((estimate.value - exact.value).abs() <= estimate.margin.unwrap(), "{estimate:?} for {exact:?}");
    for threads in [2, 5] {
        assert_eq!(with_threads(threads), estimate, "{threads} threads");
    }
}

/// In a list of boxes, each around all triangles that follow, an exact overlap takes the square of their number.
#[test]
fn an_exact_overlap_that_would_take_too_long_is_an_estimate() {
    let triangles = trees::soup(20_000, 0.02, 3);
    let last = triangles.len() as u32 - 1;
    let mut around = Aabb::EMPTY;
    let mut nodes = Vec::new();
    for (at, triangle) in triangles.iter().enumerate().rev() {
        let at = at as u32;
        let leaf = Node { container: triangle.bounds(), first: at, count: 1 };
        around = around.union(&leaf.container);
        nodes.push(leaf);
        if at < last {
            nodes.push(Node::interior(around, 2 * at + 1, 2));
        }
    }
    nodes.reverse();
    let tree = Tree { nodes, primitive_indices: (0..=last).collect(), max_depth: last }.into();
    let found = overlap(&tree, &triangles, usize::MAX);
    assert!(!found.is_exact() && found.sampled >= LEAST_SAMPLES as usize, "{found:?}");
    assert!(found.margin.is_some_and(|margin| margin > 0.0), "{found:?}");
    let few = overlap(&halved(&triangles, ContainerKind::Aabb), &triangles, usize::MAX);
    assert!(few.is_exact() && few.visited < 1_000 * triangles.len() as u64, "{few:?}");
}

/// Number of times that `work` polls its token: often in proportion to the work.
fn polls(work: impl Fn(&CancelToken)) -> u64 {
    use std::sync::atomic::{AtomicU64, Ordering};
    let polls = std::sync::Arc::new(AtomicU64::new(0));
    let counted = std::sync::Arc::clone(&polls);
    work(&CancelToken::watched(move |_| {
        counted.fetch_add(1, Ordering::Relaxed);
        false
    }));
    polls.load(Ordering::Relaxed)
}

/// Groups of equal triangles at one place each, of different sizes: many pairs at the same distance, few of which are the best.
#[test]
fn clustering_many_small_groups_grows_hardly_faster_than_their_number() {
    let triangle = Triangle { a: Vec3::ZERO, b: Vec3::new(1.0, 0.1, 0.2), c: Vec3::new(0.1, 1.0, 0.3) };
    let stack = |count: usize| -> Vec<Triangle> {
        // Steps below the precision of the coordinates, so that neighbours fall together.
        let at = |index: usize| Vec3::Z * (index as f32 * 0.01 / 1e6);
        (0..count).map(|i| Triangle { a: triangle.a + at(i), b: triangle.b + at(i), c: triangle.c + at(i) }).collect()
    };
    for container in ContainerKind::ALL {
        let settings = BuildSettings {
            threshold: BuildSettings::MAX_THRESHOLD,
            epsilon: 0.0,
            container,
            ..BuildSettings::default()
        };
        let [small, large] = [10_000, 80_000].map(|count| {
            let triangles = stack(count);
            polls(|token| drop(build_binary(&triangles, &settings, token).unwrap()))
        });
        assert!(large <= 10 * small, "{container:?}: {small} polls, and {large} for eight times as many triangles");
    }
}
