//! Ties, which turn agglomerative builders into list makers: equal triangles, equal centres, lines, planes, the ends of the
//! range of floats. No tree becomes a list.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

mod trees;

use bvhscope::bvh::builders::build;
use bvhscope::bvh::{BuildSettings, ContainerKind, Preset};
use bvhscope::cancel::CancelToken;
use bvhscope::geometry::Triangle;
use glam::Vec3;

const COUNT: usize = 20_000;

fn map(triangles: &[Triangle], change: impl Fn(usize, Vec3) -> Vec3) -> Vec<Triangle> {
    let change = |(i, t): (usize, &Triangle)| Triangle { a: change(i, t.a), b: change(i, t.b), c: change(i, t.c) };
    triangles.iter().enumerate().map(change).collect()
}

fn ties(random: &[Triangle]) -> Vec<(&'static str, Vec<Triangle>)> {
    let centered = |t: &Triangle| {
        let center = (t.a + t.b + t.c) / 3.0;
        Triangle { a: t.a - center, b: t.b - center, c: t.c - center }
    };
    let mut outlier = random.to_vec();
    outlier[7] = map(&random[7..8], |_, corner| corner + 1e17)[0];
    vec![
        ("identical", vec![random[0]; COUNT]),
        ("one centre", random.iter().map(centered).collect()),
        ("one centre, many sizes", map(&vec![centered(&random[0]); COUNT], |i, corner| corner * (1.0 + i as f32))),
        ("points", map(random, |i, _| Vec3::splat((i % 7) as f32))),
        ("collinear", map(random, |i, corner| Vec3::X * (i as f32 + corner.x))),
        ("coplanar", map(random, |_, corner| corner.with_z(0.0))),
        ("a row of equal ones", map(&vec![random[0]; COUNT], |i, corner| corner + Vec3::X * i as f32)),
        ("huge", map(random, |_, corner| corner * 1e17)),
        ("denormal", map(random, |_, corner| corner * 1e-41)),
        ("one far outlier", outlier),
        ("two clusters", map(random, |i, corner| corner * 1e-3 + if i % 2 == 0 { 0.0 } else { 1e3 })),
    ]
}

#[test]
fn no_ties_make_a_list() {
    let limit = 2 * COUNT.ilog2() + 16;
    let random = trees::soup(COUNT, 0.01, 77);
    for (name, triangles) in ties(&random) {
        for container in ContainerKind::ALL {
            for preset in Preset::ALL {
                let settings = BuildSettings::preset(preset, container);
                // Containers within one another are no ties: the larger one takes the smaller ones in, one after the other
                // in each list of clusters, and longer lists stand higher up. See `reliability.md`.
                let limit = if name.starts_with("one centre") { COUNT as u32 / 20 } else { limit };
                let (tree, _) = build(&triangles, &settings, &CancelToken::new()).unwrap();
                assert!(tree.max_depth() <= limit, "{name}, {settings:?}: depth {} of {limit}", tree.max_depth());
            }
        }
    }
}
