//! A short form of the benchmark without Embree: every setting and interface that it measures, and the trees of obvhs as it writes
//! them, have the hits of a test of every triangle.

#![allow(clippy::pedantic, reason = "tests and measurements may be plainer than the libraries")]

#[path = "../benches/peers/engine.rs"]
#[allow(dead_code, reason = "costs and bytes are the benchmark's")]
mod engine;
#[path = "../benches/peers/foreign.rs"]
mod foreign;
#[path = "../benches/peers/obvhs_peer.rs"]
#[allow(dead_code, reason = "times and interfaces are the benchmark's")]
mod obvhs_peer;
#[path = "../benches/peers/obvhs_tree.rs"]
mod obvhs_tree;
#[path = "../benches/peers/paper.rs"]
#[allow(dead_code, reason = "it is the benchmark's, and compiled here so that it keeps up with the program")]
mod paper;
#[path = "../benches/peers/peer.rs"]
#[allow(dead_code, reason = "times and bytes are the benchmark's")]
mod peer;
#[path = "../benches/peers/rays.rs"]
#[allow(dead_code, reason = "how coherent rays are is the benchmark's")]
mod rays;
#[path = "../benches/peers/scenes.rs"]
#[allow(dead_code, reason = "the models' names are the benchmark's")]
mod scenes;
#[path = "../benches/peers/two_levels.rs"]
#[allow(dead_code, reason = "times are the benchmark's")]
mod two_levels;

use std::path::Path;

use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, PreparedRay, Shear, Triangle};
use bvhscope_engine::tree::Tree;
use bvhscope_engine::tree::traverse::{NoProbe, Traversal, closest_hit};
use rays::{Query, Tally, Workload, workloads};

/// Width and height of the picture.
const SIZE: u32 = 32;
/// One ray in this many is tested against every triangle.
const SCANNED: usize = 37;

fn scan(subject: &scenes::Subject, work: &Workload) -> Tally {
    let mut tally = Tally::default();
    for ray in &work.rays {
        if work.query == Query::Point {
            let squared = subject.triangles.iter().map(|triangle| triangle.nearest_point(ray.origin).distance_squared);
            tally.add(squared.fold(f64::INFINITY, f64::min).sqrt() as f32);
            continue;
        }
        let (ray, shear) = (PreparedRay::new(*ray), Shear::new(ray.direction));
        let hits = subject.triangles.iter().filter_map(|triangle| triangle.intersect(&ray, &shear, ray.ray.t_max));
        let mut distances: Vec<f32> = hits.map(|hit| hit.t).collect();
        distances.sort_by(f32::total_cmp);
        match work.query {
            Query::Closest => tally.add(distances.first().copied().unwrap_or(f32::INFINITY)),
            Query::Any => tally.hits += u64::from(!distances.is_empty()),
            Query::All | Query::Point => distances.iter().for_each(|distance| tally.add(*distance)),
        }
    }
    tally
}

fn boxes(ready: &[engine::Ready]) -> &Tree<Aabb> {
    ready[0].boxes().expect("the first setting has boxes")
}

#[test]
fn every_measured_interface_finds_the_same_hits() {
    for name in ["builtin:teapot:4", "builtin:cornell", "builtin:sphereflake:2", "builtin:terrain:3000"] {
        let subject = scenes::Subject::load(name, Path::new("."), &CancelToken::new()).expect("a built-in scene");
        let ready = engine::ready(&subject.triangles, false);
        let works = workloads(boxes(&ready), &subject.triangles, &subject.bounds, &subject.camera, SIZE);
        assert_eq!(works[0].rays.len(), (SIZE * SIZE) as usize);
        for work in works {
            let rays = work.rays.iter().copied().step_by(SCANNED).collect();
            let sample = Workload { rays, ..work };
            let expected = scan(&subject, &sample);
            let mut reference = None;
            for ready in &ready {
                for interface in engine::interfaces(ready) {
                    let run = |work| (interface.prepare)(work).map(|mut run| run());
                    let name = format!("{name}, {} {}", interface.setting, interface.name);
                    if let Some(tally) = run(&sample) {
                        assert_eq!(tally, expected, "{name}, {}", work.name);
                    }
                    let Some(tally) = run(&work) else { continue };
                    assert!(tally.hits > 0, "{name}, {}: nothing is hit", work.name);
                    assert_eq!(tally, *reference.get_or_insert(tally), "{name}, {}", work.name);
                }
            }
        }
    }
}

fn run<'a>(interface: &peer::Interface<'a>, work: &'a Workload) -> Option<Tally> {
    (interface.prepare)(work).map(|mut run| run())
}

#[test]
fn every_measured_interface_of_copies_finds_the_hits_of_the_flat_scene() {
    for name in ["builtin:forest:20", "builtin:village:12", "builtin:stack:9"] {
        let (folder, token) = (Path::new("."), CancelToken::new());
        let subject = scenes::Subject::load(name, folder, &token).expect("a built-in scene");
        let copies = scenes::load_copies(name, folder, &token).expect("a built-in scene").expect("made of copies");
        let meshes: Vec<&[Triangle]> = (0..copies.mesh_count() as u32).map(|mesh| copies.mesh(mesh)).collect();
        let levels = two_levels::ready(&meshes, &two_levels::placed(&copies));
        let ready = engine::ready(&subject.triangles, false);
        let works = workloads(boxes(&ready), &subject.triangles, &subject.bounds, &subject.camera, SIZE);
        for work in &works {
            let expected = engine::interfaces(&ready[0]).iter().find_map(|interface| run(interface, work));
            for (setting, instances) in &levels {
                let interfaces = two_levels::interfaces(setting, instances);
                let tallies: Vec<Tally> = interfaces.iter().filter_map(|interface| run(interface, work)).collect();
                assert_eq!(tallies.is_empty(), work.query == Query::Point, "{name}, {setting}, {}", work.name);
                assert!(
                    tallies.iter().all(|tally| Some(*tally) == expected),
                    "{name}, {setting}, {}: {tallies:?}",
                    work.name
                );
            }
        }
    }
}

#[test]
fn every_measured_setting_builds() {
    let subject = scenes::Subject::load("builtin:cornell", Path::new("."), &CancelToken::new()).expect("built in");
    for builder in engine::builders(&subject.triangles, 2, false) {
        let times = (builder.build)();
        let binary = times.binary.expect("this engine has a binary tree");
        assert!(binary.as_nanos() > 0 && binary < times.ready, "{} {}: {times:?}", builder.name, builder.threads);
    }
}

#[test]
fn a_divided_workload_has_the_same_hits() {
    let subject =
        scenes::Subject::load("builtin:sphereflake:2", Path::new("."), &CancelToken::new()).expect("built in");
    let ready = engine::ready(&subject.triangles, false);
    // More rays than a tile holds.
    let works = workloads(boxes(&ready), &subject.triangles, &subject.bounds, &subject.camera, 128);
    let many = |work: &Workload| {
        let interface = &engine::interfaces(&ready[0])[2];
        (interface.prepare)(work).expect("an interface for all rays")()
    };
    for work in &works {
        let whole = many(work);
        for threads in [1, 2, 3] {
            let parts = rays::in_parts(work, threads);
            assert_eq!(parts.len(), threads);
            let together = parts.iter().map(many).fold(Tally::default(), Tally::plus);
            assert_eq!(together.hits, whole.hits, "{} by {threads}", work.name);
            assert!((together.distance - whole.distance).abs() <= 1e-9 * whole.distance, "{} by {threads}", work.name);
        }
    }
}

/// The trees of obvhs, binary and quantised, as this crate traces them.
#[test]
fn the_trees_of_obvhs_find_the_same_hits() {
    for name in ["builtin:teapot:4", "builtin:cornell", "builtin:terrain:3000"] {
        let subject = scenes::Subject::load(name, Path::new("."), &CancelToken::new()).expect("a built-in scene");
        let triangles = &subject.triangles[..];
        let ready = engine::ready(triangles, false);
        let [primary, ..] = workloads(boxes(&ready), triangles, &subject.bounds, &subject.camera, SIZE);
        let sample = Workload { rays: primary.rays.iter().copied().step_by(SCANNED / 4).collect(), ..primary };
        let expected = scan(&subject, &sample);
        assert!(expected.hits > 0, "{name}: nothing is hit");
        let converted = obvhs_peer::converted(triangles);
        for (setting, parameters) in obvhs_peer::settings(true) {
            let binary = obvhs_tree::binary(&obvhs_peer::binary(&converted, parameters));
            let wide = obvhs_tree::wide(&obvhs_peer::wide(&converted, parameters));
            assert!(wide.nodes.iter().any(|node| node.arity() > 4), "{name}, {setting}: nothing is wide");
            for (kind, tree) in [("binary", binary), ("wide", wide)] {
                assert_eq!(traced(&tree, triangles, &sample), expected, "{name}, {setting}, {kind}");
            }
        }
    }
}

fn traced(tree: &Tree<Aabb>, triangles: &[bvhscope_engine::Triangle], work: &Workload) -> Tally {
    let leaf_triangles = tree.leaf_triangles(triangles, &CancelToken::new()).expect("nobody cancels");
    let mut tally = Tally::default();
    for ray in &work.rays {
        let hit = closest_hit(tree, &leaf_triangles[..], ray, Traversal::Ordered, &mut NoProbe);
        tally.add(hit.map_or(f32::INFINITY, |hit| hit.t));
    }
    tally
}
