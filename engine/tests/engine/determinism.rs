//! The same triangles and settings give the identical tree, node for node, on any number of threads.

use bvhscope_engine::BinaryBvh;
use bvhscope_engine::build_cache::BuildCache;
use bvhscope_engine::builders::build_binary;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve};
use bvhscope_engine::tree::statistics::{TreeStats, tree_stats};
use bvhscope_engine::tree::{AnyTree, ContainerKind};
use bvhscope_engine::wide::collapse;
use bvhscope_engine::wide::tree::AnyWideTree;
use bvhscope_engine::with_tree;
use glam::Vec3;

/// A bumpy sheet of `2 · side²` triangles, in no helpful order, every tenth one twice.
fn sheet(side: u32) -> Vec<Triangle> {
    let at = |x: u32, y: u32| {
        let (x, y) = (x as f32 / side as f32, y as f32 / side as f32);
        Vec3::new(x, y, 0.1 * (7.0 * x).sin() * (11.0 * y).cos())
    };
    let mut triangles = Vec::new();
    for x in 0..side {
        for y in 0..side {
            triangles.push(Triangle { a: at(x, y), b: at(x + 1, y), c: at(x + 1, y + 1) });
            triangles.push(Triangle { a: at(x, y), b: at(x + 1, y + 1), c: at(x, y + 1) });
        }
    }
    let twice: Vec<Triangle> = triangles.iter().step_by(10).copied().collect();
    triangles.extend(twice);
    let count = triangles.len();
    (0..count).map(|index| triangles[index * 7919 % count]).collect()
}

fn build_with_threads(triangles: &[Triangle], settings: &BuildSettings, threads: usize) -> AnyTree {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| build_binary(triangles, settings, &CancelToken::new())).unwrap().0
}

fn widen_with_threads(triangles: &[Triangle], tree: &AnyTree, threads: usize) -> AnyWideTree {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    with_tree!(tree, tree => pool.install(|| collapse(tree, triangles, &CancelToken::new()).unwrap().into()))
}

#[test]
fn trees_do_not_depend_on_the_number_of_threads() {
    let triangles = sheet(120);
    let others = [BuilderKind::Lbvh, BuilderKind::BinnedSah].map(|builder| (builder, Curve::Morton));
    for (builder, curve) in Curve::ALL.into_iter().map(|curve| (BuilderKind::Aac, curve)).chain(others) {
        for container in ContainerKind::ALL {
            let settings = BuildSettings { builder, container, curve, ..BuildSettings::default() };
            if settings.refusal(triangles.len()).is_some() {
                continue;
            }
            let one = build_with_threads(&triangles, &settings, 1);
            for threads in [2, 3, 7] {
                let many = build_with_threads(&triangles, &settings, threads);
                assert!(one == many, "{} {}: {threads} threads make another tree", builder.name(), container.name());
                let equal = widen_with_threads(&triangles, &one, 1) == widen_with_threads(&triangles, &many, threads);
                assert!(equal, "{} {}: {threads} threads make another wide tree", builder.name(), container.name());
            }
        }
    }
}

/// A build with a cache sums them up while it writes the nodes, task by task.
#[test]
fn statistics_of_a_build_with_a_cache_are_those_of_its_tree() {
    let triangles = sheet(120);
    for container in ContainerKind::ALL {
        let settings = BuildSettings { container, ..BuildSettings::default() };
        let mut cache = BuildCache::default();
        let built = BinaryBvh::build_with_cache(&triangles, &settings, Some(&mut cache), &CancelToken::new()).unwrap();
        let (summed, counted) = (built.report.stats, tree_stats(&built.tree, &CancelToken::new()).unwrap());
        assert!(
            (summed.sah_cost / counted.sah_cost - 1.0).abs() < 1e-5,
            "{} and {}",
            summed.sah_cost,
            counted.sah_cost
        );
        assert_eq!(TreeStats { sah_cost: counted.sah_cost, ..summed }, counted, "{container:?}");
    }
}

#[test]
fn a_build_repeats() {
    let triangles = sheet(30);
    for builder in BuilderKind::ALL {
        for threshold in [2, 6, 64] {
            let settings = BuildSettings { builder, threshold, ..BuildSettings::default() };
            let first = build_binary(&triangles, &settings, &CancelToken::new()).unwrap().0;
            let second = build_binary(&triangles, &settings, &CancelToken::new()).unwrap().0;
            assert!(first == second, "{} with threshold {threshold}", builder.name());
        }
    }
}

#[test]
fn the_tree_follows_the_triangles_not_the_pool_it_was_built_in_before() {
    let (small, large) = (sheet(10), sheet(60));
    let settings = BuildSettings::default();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let fresh = build_with_threads(&small, &settings, 2);
    let after_another = pool.install(|| {
        build_binary(&large, &settings, &CancelToken::new()).unwrap();
        build_binary(&small, &settings, &CancelToken::new()).unwrap().0
    });
    assert!(fresh == after_another);
}
