//! The measuring jobs: structure of the rows and what must hold between them.

#![allow(clippy::unwrap_used, reason = "a failure here is a failed test")]

use std::ffi::OsStr;
use std::sync::Arc;

use bvhscope::bvh::traverse::Traversal;
use bvhscope::bvh::{BuildSettings, ContainerKind, Preset, SimdLevel};
use bvhscope::camera::Camera;
use bvhscope::cancel::CancelToken;
use bvhscope::lab::{
    LabError, Measurement, Setup, Subject, SweepPlan, TraceView, bench, compare, measure, scaling, sweep,
};
use bvhscope::scene::{LoadOptions, SceneSource, load};

fn subject(name: &str) -> Subject {
    let source = SceneSource::parse(OsStr::new(name)).unwrap();
    Subject {
        model: name.to_owned(),
        scene: Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap()),
    }
}

fn view(subject: &Subject, traversal: Traversal) -> TraceView {
    TraceView {
        camera: Camera::framing(&subject.scene.bounds, subject.scene.up),
        size: [40, 30],
        traversal,
        simd: SimdLevel::best(),
        repeat: 2,
    }
}

fn both() -> Vec<Setup> {
    let setup = |container| Setup { build: BuildSettings::preset(Preset::Fast, container), preset: None, threads: 1 };
    ContainerKind::ALL.map(setup).to_vec()
}

fn collect(job: impl FnOnce(&mut dyn FnMut(Measurement)) -> Result<(), LabError>) -> Vec<Measurement> {
    let mut rows = Vec::new();
    job(&mut |row| rows.push(row)).unwrap();
    rows
}

#[test]
fn spheres_need_more_tests_and_everyone_hits_the_same() {
    for name in ["builtin:teapot:1", "builtin:teapot:3"] {
        let subject = subject(name);
        let view = view(&subject, Traversal::Ordered);
        let rows = collect(|row| bench(&subject, &both(), &view, true, &CancelToken::new(), row));
        let [boxes, spheres, none] = &rows[..] else { panic!("{} rows", rows.len()) };
        assert!(boxes.tests_per_ray < spheres.tests_per_ray, "{name}");
        assert_eq!(boxes.hits, spheres.hits, "{name}");
        assert!(boxes.hits > 0 && boxes.rays == 1200, "{name}");
        assert_eq!(none.tests_per_ray, none.triangles as f64, "{name}");
        // So few triangles that the sample is every pixel.
        assert_eq!((none.rays, none.hits), (boxes.rays, boxes.hits), "{name}");
        assert_eq!(boxes.tests_per_ray, boxes.container_tests_per_ray + boxes.primitive_tests_per_ray);
        assert!(boxes.build_ms_spread[0] <= boxes.build_ms && boxes.build_ms <= boxes.build_ms_spread[1]);
    }
}

#[test]
fn the_papers_traversal_never_takes_fewer_tests() {
    let subject = subject("builtin:teapot:3");
    let rows =
        |traversal| measure("bench", &subject, &both(), &view(&subject, traversal), &CancelToken::new()).unwrap();
    for (paper, ordered) in rows(Traversal::Paper).iter().zip(&rows(Traversal::Ordered)) {
        assert!(paper.tests_per_ray >= ordered.tests_per_ray);
        assert_eq!(paper.hits, ordered.hits);
    }
}

#[test]
fn compared_builders_agree_on_hits() {
    let subject = subject("builtin:teapot:2");
    let view = view(&subject, Traversal::Ordered);
    let rows = collect(|row| compare(&subject, &ContainerKind::ALL, 1, &view, &CancelToken::new(), row));
    // Four presets and LBVH and exact for both containers, binned SAH for boxes.
    assert_eq!(rows.len(), 13);
    assert!(rows.iter().all(|row| row.hits == rows[0].hits));
    assert!(rows.iter().all(|row| row.sah_cost > 0.0 && row.epo >= 0.0 && row.leaves <= row.nodes));
}

#[test]
fn scaling_starts_at_one() {
    let subject = subject("builtin:teapot:2");
    let view = view(&subject, Traversal::Ordered);
    let rows = collect(|row| scaling(&subject, &both()[0], 3, &view, &CancelToken::new(), row));
    assert_eq!(rows.iter().map(|row| row.threads).collect::<Vec<_>>(), [1, 2, 3]);
    assert_eq!((rows[0].speedup, rows[0].trace_speedup), (Some(1.0), Some(1.0)));
    assert!(rows.iter().all(|row| row.nodes == rows[0].nodes && row.tests_per_ray == rows[0].tests_per_ray));
}

#[test]
fn shards_together_are_the_whole() {
    let plan = |shard| SweepPlan {
        thresholds: vec![2, 4, 6, 8, 10],
        epsilons: vec![0.1, 0.2],
        containers: ContainerKind::ALL.to_vec(),
        threads: 1,
        shard,
    };
    let names = ["builtin:teapot:1", "builtin:teapot:2"];
    let subjects = names.map(subject);
    let rows = |shard| -> Vec<(String, ContainerKind, u32, String)> {
        let plan = plan(shard);
        let points = plan.points(names.len());
        let mut settings = Vec::new();
        for point in points {
            let subject = &subjects[point.model];
            let view = TraceView { size: [4, 4], repeat: 1, ..view(subject, Traversal::Ordered) };
            for row in collect(|row| sweep(subject, &plan, point, &view, &CancelToken::new(), row)) {
                settings.push((row.model, row.container, row.threshold, row.epsilon.to_string()));
            }
        }
        settings
    };
    let sorted = |mut rows: Vec<(String, ContainerKind, u32, String)>| {
        rows.sort_by_key(|row| format!("{row:?}"));
        rows
    };
    let whole = sorted(rows((1, 1)));
    assert_eq!(whole.len(), 40);
    for count in [2, 3, 7, 30] {
        let parts: Vec<_> = (1..=count).flat_map(|index| rows((index, count))).collect();
        assert_eq!(sorted(parts), whole, "{count} shards");
    }
}

#[test]
fn rows_survive_json_and_cancelled_jobs_stop() {
    let subject = subject("builtin:teapot:1");
    let view = view(&subject, Traversal::Ordered);
    let row = measure("bench", &subject, &both(), &view, &CancelToken::new()).unwrap().remove(0);
    let text = serde_json::to_string(&row).unwrap();
    for name in ["\"container\":\"box\"", "\"mrays_per_s\":", "\"build_stages_ms\":{", "\"primitive_tests_per_ray\":"] {
        assert!(text.contains(name), "{name} in {text}");
    }
    let read: Measurement = serde_json::from_str(&text).unwrap();
    assert_eq!((read.model, read.threshold, read.hits), (row.model, row.threshold, row.hits));
    let token = CancelToken::new();
    token.cancel();
    assert!(matches!(measure("bench", &subject, &both(), &view, &token), Err(LabError::Cancelled(_))));
}
