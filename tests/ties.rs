//! Ties, which turn agglomerative builders into list makers: equal triangles, equal centres, lines, planes, the ends of the
//! range of floats. They build about as fast as random triangles, and no tree becomes a list.

#![cfg(target_os = "linux")]
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
    ]
}

/// Time that this thread has run, in nanoseconds: what others do on the machine does not count.
fn thread_time() -> u64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    text.split_whitespace().next().unwrap().parse().unwrap()
}

#[test]
fn ties_take_no_longer_than_three_times_random_triangles() {
    let random = trees::soup(COUNT, 0.01, 77);
    let scenes = ties(&random);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    for container in ContainerKind::ALL {
        let settings = BuildSettings::preset(Preset::Hq, container);
        let time = |triangles: &[Triangle]| {
            pool.install(|| {
                let start = thread_time();
                build(triangles, &settings, &CancelToken::new()).unwrap();
                thread_time() - start
            })
        };
        // The shortest of several, taken in turn: whatever disturbs one only makes it longer.
        let mut least = vec![u64::MAX; scenes.len() + 1];
        for _ in 0..5 {
            least[0] = least[0].min(time(&random));
            for (least, (_, triangles)) in least[1..].iter_mut().zip(&scenes) {
                *least = (*least).min(time(triangles));
            }
        }
        for (time, (name, _)) in least[1..].iter().zip(&scenes) {
            let ratio = *time as f64 / least[0] as f64;
            println!("{name}, {container:?}: {ratio:.2} times random");
            assert!(ratio <= 3.0, "{name}, {container:?}: {ratio:.2} times as long as random triangles");
        }
    }
}

#[test]
fn no_ties_make_a_list() {
    let limit = 2 * COUNT.ilog2() + 16;
    let random = trees::soup(COUNT, 0.01, 77);
    for (name, triangles) in ties(&random) {
        for container in ContainerKind::ALL {
            for preset in Preset::ALL {
                let settings = BuildSettings::preset(preset, container);
                let (tree, _) = build(&triangles, &settings, &CancelToken::new()).unwrap();
                assert!(tree.max_depth() <= limit, "{name}, {settings:?}: depth {} of {limit}", tree.max_depth());
            }
        }
    }
}
