//! A short form of the benchmark without peers: every setting and interface that it measures has the hits of a test of every
//! triangle.

#![allow(clippy::pedantic, reason = "tests and measurements may be plainer than the libraries")]

#[path = "../benches/peers/engine.rs"]
#[allow(dead_code, reason = "costs and bytes are the benchmark's")]
mod engine;
#[path = "../benches/peers/peer.rs"]
#[allow(dead_code, reason = "times and bytes are the benchmark's")]
mod peer;
#[path = "../benches/peers/rays.rs"]
#[allow(dead_code, reason = "how coherent rays are is the benchmark's")]
mod rays;
#[path = "../benches/peers/scenes.rs"]
#[allow(dead_code, reason = "the models' names are the benchmark's")]
mod scenes;

use std::path::Path;

use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{PreparedRay, Shear};
use rays::{Query, Tally, Workload, workloads};

/// Width and height of the picture.
const SIZE: u32 = 32;
/// One ray in this many is tested against every triangle.
const SCANNED: usize = 37;

fn scan(subject: &scenes::Subject, work: &Workload) -> Tally {
    let mut tally = Tally::default();
    for ray in &work.rays {
        let (ray, shear) = (PreparedRay::new(*ray), Shear::new(ray.direction));
        let hits = subject.triangles.iter().filter_map(|triangle| triangle.intersect(&ray, &shear, ray.ray.t_max));
        let nearest = hits.map(|hit| hit.t).fold(f32::INFINITY, f32::min);
        match work.query {
            Query::Closest => tally.add(nearest),
            Query::Any => tally.hits += u64::from(nearest < f32::INFINITY),
        }
    }
    tally
}

#[test]
fn every_measured_interface_finds_the_same_hits() {
    for name in ["builtin:teapot:4", "builtin:cornell", "builtin:sphereflake:2", "builtin:terrain:3000"] {
        let subject = scenes::Subject::load(name, Path::new("."), &CancelToken::new()).expect("a built-in scene");
        let ready = engine::ready(&subject.triangles);
        let works = workloads(&ready[0].tree, &subject.triangles, &subject.bounds, &subject.camera, SIZE);
        assert_eq!(works[0].rays.len(), (SIZE * SIZE) as usize);
        for work in works {
            let rays = work.rays.iter().copied().step_by(SCANNED).collect();
            let sample = Workload { rays, ..work };
            let expected = scan(&subject, &sample);
            let mut reference = None;
            for ready in &ready {
                for interface in engine::interfaces(ready) {
                    let run = |work| (interface.prepare)(work).map(|mut run| run());
                    if let Some(tally) = run(&sample) {
                        assert_eq!(tally, expected, "{name}, {}, {}", work.name, interface.name);
                    }
                    let Some(tally) = run(&work) else { continue };
                    assert!(tally.hits > 0, "{name}, {}: nothing is hit", work.name);
                    assert_eq!(tally, *reference.get_or_insert(tally), "{name}, {}, {}", work.name, interface.name);
                }
            }
        }
    }
}

#[test]
fn every_measured_setting_builds() {
    let subject = scenes::Subject::load("builtin:cornell", Path::new("."), &CancelToken::new()).expect("built in");
    for builder in engine::builders(&subject.triangles, 2) {
        assert!((builder.build)().as_nanos() > 0, "{} {}", builder.name, builder.threads);
    }
}
