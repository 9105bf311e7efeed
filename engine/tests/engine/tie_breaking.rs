//! Equal merge distances, which can degenerate an agglomerative tree into a list: equal triangles, equal centres, lines, planes, the
//! ends of the range of floats. No tree becomes a list, and none takes much more work than one of random triangles.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use bvhscope_engine::builders::build_binary;
use bvhscope_engine::builders::depth_limit::depth_limit;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::settings::{BuildSettings, Preset};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::with_tree;
use glam::Vec3;

use crate::trees;

const COUNT: usize = 20_000;

fn map_corners(triangles: &[Triangle], change: impl Fn(usize, Vec3) -> Vec3) -> Vec<Triangle> {
    let change = |(i, t): (usize, &Triangle)| Triangle { a: change(i, t.a), b: change(i, t.b), c: change(i, t.c) };
    triangles.iter().enumerate().map(change).collect()
}

/// Scenes of as many triangles.
fn ties(random: &[Triangle]) -> Vec<(&'static str, Vec<Triangle>)> {
    let count = random.len();
    let centered = |t: &Triangle| {
        let center = (t.a + t.b + t.c) / 3.0;
        Triangle { a: t.a - center, b: t.b - center, c: t.c - center }
    };
    let mut outlier = random.to_vec();
    outlier[7] = map_corners(&random[7..8], |_, corner| corner + 1e17)[0];
    vec![
        ("identical", vec![random[0]; count]),
        ("one centre", random.iter().map(centered).collect()),
        (
            "one centre, many sizes",
            map_corners(&vec![centered(&random[0]); count], |i, corner| corner * (1.0 + i as f32)),
        ),
        ("points", map_corners(random, |i, _| Vec3::splat((i % 7) as f32))),
        ("collinear", map_corners(random, |i, corner| Vec3::X * (i as f32 + corner.x))),
        ("coplanar", map_corners(random, |_, corner| corner.with_z(0.0))),
        ("a row of equal ones", map_corners(&vec![random[0]; count], |i, corner| corner + Vec3::X * i as f32)),
        ("huge", map_corners(random, |_, corner| corner * 1e17)),
        ("denormal", map_corners(random, |_, corner| corner * 1e-41)),
        ("one far outlier", outlier),
        ("two clusters", map_corners(random, |i, corner| corner * 1e-3 + if i % 2 == 0 { 0.0 } else { 1e3 })),
    ]
}

/// Number of times that the builder polls for cancellation: once before each search for another best match, which is nearly all
/// the work where a list would be made, and besides once per some hundred primitives.
fn polls(triangles: &[Triangle], settings: &BuildSettings) -> u64 {
    let polls = Arc::new(AtomicU64::new(0));
    let counted = Arc::clone(&polls);
    let token = CancelToken::watched(move |_| {
        counted.fetch_add(1, Ordering::Relaxed);
        false
    });
    build_binary(triangles, settings, &token).unwrap();
    polls.load(Ordering::Relaxed)
}

#[test]
fn ties_search_hardly_more_than_random_triangles() {
    let random = trees::soup(COUNT, 0.01, 77);
    let mut scenes = ties(&random);
    scenes.push(("grid", trees::grid(100, 2, 0.0)));
    scenes.push(("pairs", (0..COUNT).map(|i| random[i / 2]).collect()));
    scenes.push(("hundreds", (0..COUNT).map(|i| random[i / 100]).collect()));
    for container in ContainerKind::ALL {
        let [fast, hq] = [Preset::Fast, Preset::Hq]
            .map(|preset| BuildSettings { rounds: 6, ..BuildSettings::preset(preset, container) });
        for settings in [fast, hq, BuildSettings { threshold: BuildSettings::MAX_THRESHOLD, ..hq }] {
            let usual = polls(&random, &settings);
            for (name, triangles) in &scenes {
                let polls = polls(triangles, &settings);
                assert!(polls <= 3 * usual, "{name}, {settings:?}: {polls} polls, random triangles take {usual}");
            }
        }
    }
}

#[test]
fn no_ties_make_a_list() {
    // Of a tenth more, into which triangles are split, the limit is the same.
    let count = 9_000;
    let limit = depth_limit(count);
    assert_eq!(limit, 2 * 13 + 16);
    let random = trees::soup(count, 0.01, 77);
    for (name, triangles) in ties(&random) {
        for container in ContainerKind::ALL {
            // Of the passes, other containers take the collapse alone, which makes no tree deeper.
            let presets = Preset::ALL
                .into_iter()
                .filter(|preset| container == ContainerKind::Aabb || !matches!(preset, Preset::Best | Preset::Finest));
            for preset in presets {
                let settings = BuildSettings { rounds: 6, ..BuildSettings::preset(preset, container) };
                let (tree, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
                assert!(tree.max_depth() <= limit, "{name}, {settings:?}: depth {} of {limit}", tree.max_depth());
            }
        }
    }
}

/// Scaled down to the size of everything else, small triangles would have areas of a few bits.
#[test]
fn a_far_outlier_costs_the_others_no_precision() {
    let random = trees::soup(COUNT, 0.01, 77);
    for container in ContainerKind::ALL {
        for preset in [Preset::Fast, Preset::Hq] {
            let settings = BuildSettings { rounds: 6, ..BuildSettings::preset(preset, container) };
            // The first is built as it is, the others over scaled coordinates.
            let shapes = [1e14, 1e16, 1e17].map(|distance| {
                let mut triangles = random.clone();
                triangles[7] = map_corners(&random[7..8], |_, corner| corner + distance)[0];
                let (tree, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
                with_tree!(&tree, tree => {
                    let links: Vec<_> = tree.nodes.iter().map(|node| (node.first, node.count)).collect();
                    (links, tree.primitive_indices.clone())
                })
            });
            assert!(shapes[1] == shapes[0] && shapes[2] == shapes[0], "{settings:?}");
        }
    }
}
