//! Measuring jobs: structure of the rows and the relations between them.

use std::ffi::OsStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use bvhscope::accel::Accel;
use bvhscope::camera::Camera;
use bvhscope::catalog::numbers::rows::{
    BUILD_MS, COLLAPSE_MS, CONTAINER_TESTS_PER_RAY, EPO, HITS, LEAF_SIZE, LEAVES, MAX_DEPTH, MEAN_LEAF_DEPTH, NODES,
    PRIMITIVE_TESTS_PER_RAY, RAYS, SAH_COST, SPEEDUP, TESTS_PER_ENTERING_RAY, TESTS_PER_RAY, TRACE_MS, TRACE_SPEEDUP,
    TREE_BYTES, WIDE_TRACE_MS,
};
use bvhscope::catalog::settings::{EPSILON, OPTIMIZE, THRESHOLD};
use bvhscope::lab::plot::Figure;
use bvhscope::lab::population::Populations;
use bvhscope::lab::report_table::{number, tables};
use bvhscope::lab::{
    Job, LabError, Measurement, RowSink, Setup, Subject, SweepPlan, TraceView, bench, compare, measure, scaling, sweep,
};
use bvhscope::render::{RenderRequest, RenderSettings, trace_primary, trace_primary_wide};
use bvhscope::scene::{LoadOptions, SceneSource, load};
use bvhscope::view::Place;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Preset};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::traverse::Traversal;

fn subject(name: &str) -> Subject {
    let source = SceneSource::parse(OsStr::new(name)).unwrap();
    Subject {
        model: name.to_owned(),
        scene: Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap()),
        trees: Vec::new(),
        forms: Vec::new(),
        rays: None,
        load: LoadOptions::default(),
    }
}

fn view(subject: &Subject, traversal: Traversal) -> TraceView {
    TraceView {
        camera: Camera::framing(&subject.scene.bounds, subject.scene.up),
        place: Place::Given,
        size: [40, 30],
        traversal,
        simd: SimdLevel::best(),
        repeat: 2,
        populations: Populations::NONE,
        epo_samples: None,
    }
}

#[test]
fn the_wide_tree_hits_what_the_binary_one_hits() {
    for name in ["builtin:teapot:3", "builtin:terrain:3000"] {
        let subject = subject(name);
        for Setup { build, .. } in both() {
            let accel = Arc::new(Accel::build(&subject.scene, &build, &CancelToken::new()).unwrap());
            for simd in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
                let request = RenderRequest::new(
                    &accel,
                    Camera::framing(&subject.scene.bounds, subject.scene.up),
                    RenderSettings { simd, ..RenderSettings::default() },
                    [77, 50],
                );
                let binary = trace_primary(&request, Traversal::Ordered, &CancelToken::new()).unwrap();
                let wide = trace_primary_wide(&request, &CancelToken::new()).unwrap();
                assert!(binary.hits > 100 && binary.hits < binary.rays, "{name}, {simd:?}");
                assert_eq!((wide.rays, wide.hits), (binary.rays, binary.hits), "{name}, {simd:?}");
            }
        }
    }
}

fn both() -> Vec<Setup> {
    let setup = |container| Setup { build: BuildSettings::preset(Preset::Fast, container), preset: None, threads: 1 };
    ContainerKind::OF_PAPER.map(setup).to_vec()
}

/// The rows of one group.
fn measured(subject: &Subject, setups: &[Setup], view: &TraceView) -> Vec<Measurement> {
    collect(|row| measure("bench", subject, setups, view, &CancelToken::new(), row))
}

fn collect(job: impl FnOnce(&mut dyn RowSink) -> Result<(), LabError>) -> Vec<Measurement> {
    let mut rows = Vec::new();
    job(&mut |row: Measurement| rows.push(row)).unwrap();
    rows
}

#[test]
fn spheres_need_more_tests_for_the_same_hits() {
    // More pixels, because the clusters cover few of them.
    for (name, size) in [
        ("builtin:teapot:3", [40, 30]),
        ("builtin:cornell", [40, 30]),
        ("builtin:sphereflake:1", [40, 30]),
        ("builtin:clusters:4", [240, 180]),
    ] {
        let subject = subject(name);
        let view = TraceView { size, ..view(&subject, Traversal::Ordered) };
        let rows = collect(|row| bench(&subject, &both(), &view, true, &CancelToken::new(), row));
        let [boxes, spheres, none] = &rows[..] else { panic!("{} rows", rows.len()) };
        assert!(boxes.number(TESTS_PER_RAY) < spheres.number(TESTS_PER_RAY), "{name}");
        assert_eq!(boxes.number(HITS), spheres.number(HITS), "{name}");
        assert!(boxes.number(HITS) > 0.0 && boxes.number(RAYS) == f64::from(size[0] * size[1]), "{name}");
        assert_eq!(none.number(TESTS_PER_RAY), none.triangles as f64, "{name}");
        // With so few triangles every pixel is in the sample.
        assert_eq!((none.number(RAYS), none.number(HITS)), (boxes.number(RAYS), boxes.number(HITS)), "{name}");
        let sum = boxes.number(CONTAINER_TESTS_PER_RAY) + boxes.number(PRIMITIVE_TESTS_PER_RAY);
        assert!((boxes.number(TESTS_PER_RAY) - sum).abs() < 1e-5 * sum, "{name}");
        let [fastest, slowest] = boxes.values.spread(BUILD_MS).unwrap();
        assert!(fastest <= boxes.number(BUILD_MS) && boxes.number(BUILD_MS) <= slowest);
    }
}

#[test]
fn the_papers_traversal_never_takes_fewer_tests() {
    let subject = subject("builtin:teapot:3");
    let rows = |traversal| measured(&subject, &both(), &view(&subject, traversal));
    let (paper, ordered) = (rows(Traversal::Paper), rows(Traversal::Ordered));
    assert_eq!((paper.len(), ordered.len()), (2, 2));
    for (paper, ordered) in paper.iter().zip(&ordered) {
        assert!(paper.number(TESTS_PER_RAY) >= ordered.number(TESTS_PER_RAY));
        assert_eq!(paper.number(HITS), ordered.number(HITS));
    }
}

#[test]
fn compared_builders_agree_on_hits() {
    let subject = subject("builtin:teapot:2");
    let view = view(&subject, Traversal::Ordered);
    let rows = collect(|row| compare(&subject, &ContainerKind::ALL, false, 1, &view, &CancelToken::new(), row));
    // Six presets, two curves, LBVH, PLOC, H-PLOC and exact for each container, binned and sweep SAH for boxes and polytopes, SBVH and
    // seven choices of passes for boxes.
    assert_eq!(rows.len(), 48);
    assert!(rows.iter().all(|row| row.number(HITS) == rows[0].number(HITS)));
    for row in &rows {
        // A binary tree: each interior node adds one leaf.
        assert_eq!(row.number(NODES), 2.0 * row.number(LEAVES) - 1.0, "{}", row.name());
        let tree_bytes = row.number(TREE_BYTES) as usize;
        // A reference of 4 bytes for each triangle, or more after splitting.
        let node_bytes = match row.container {
            ContainerKind::Aabb => 32,
            ContainerKind::Sphere => 24,
            ContainerKind::Dop14 => 64,
            ContainerKind::Oriented => 92,
        };
        let references = (tree_bytes - row.number(NODES) as usize * node_bytes) / 4;
        let splits = row.settings.text(&OPTIMIZE).unwrap().contains("split") || row.builder == BuilderKind::Sbvh.name();
        assert!(references == row.triangles || splits && references > row.triangles, "{}", row.name());
        let sizes = row.values.value(LEAF_SIZE).and_then(|sizes| sizes.as_array()).unwrap();
        let [least, mean, most] = [0, 1, 2].map(|index| sizes[index].as_f64().unwrap());
        assert!((mean * row.number(LEAVES) - references as f64).abs() < 0.01, "{}: {mean} a leaf", row.name());
        assert!(1.0 <= least && least <= mean && mean <= most, "{}", row.name());
        assert!(
            row.number(SAH_COST) > 1.0 && row.number(EPO) > 0.0 && row.number(MEAN_LEAF_DEPTH) <= row.number(MAX_DEPTH)
        );
    }
}

#[test]
fn scaling_starts_at_one() {
    let subject = subject("builtin:teapot:2");
    let view = view(&subject, Traversal::Ordered);
    let rows = collect(|row| scaling(&subject, &both()[0], 3, false, &view, &CancelToken::new(), row));
    let most = bvhscope::threads::available_threads().min(3);
    assert_eq!(rows.iter().map(|row| row.threads).collect::<Vec<_>>(), (1..=most).collect::<Vec<_>>());
    assert_eq!((rows[0].number(SPEEDUP), rows[0].number(TRACE_SPEEDUP)), (1.0, 1.0));
    for row in &rows {
        assert_eq!(row.number(SPEEDUP), rows[0].number(BUILD_MS) / row.number(BUILD_MS), "{} threads", row.threads);
        assert_eq!(
            row.number(TRACE_SPEEDUP),
            rows[0].number(TRACE_MS) / row.number(TRACE_MS),
            "{} threads",
            row.threads
        );
    }
    assert!(
        rows.iter().all(|row| row.number(NODES) == rows[0].number(NODES)
            && row.number(TESTS_PER_RAY) == rows[0].number(TESTS_PER_RAY))
    );
}

#[test]
fn shards_together_are_the_whole() {
    let plan = |shard| SweepPlan {
        ranges: vec![(&EPSILON, vec![0.1, 0.2]), (&THRESHOLD, vec![2.0, 4.0, 6.0, 8.0, 10.0])],
        containers: ContainerKind::OF_PAPER.to_vec(),
        threads: 1,
        shard,
    };
    let names = ["builtin:teapot:1", "builtin:cornell"];
    let subjects = names.map(subject);
    let rows = |shard| -> Vec<(String, ContainerKind, Vec<String>)> {
        let plan = plan(shard);
        let points = plan.points(names.len());
        let mut settings = Vec::new();
        for point in points {
            let subject = &subjects[point.model];
            let view = TraceView { size: [4, 4], repeat: 1, ..view(subject, Traversal::Ordered) };
            for row in collect(|row| sweep(subject, &plan, point, &view, &CancelToken::new(), row)) {
                settings.push((row.model, row.container, row.settings.by_symbol()));
            }
        }
        settings
    };
    let sorted = |mut rows: Vec<(String, ContainerKind, Vec<String>)>| {
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
    let row = measured(&subject, &both(), &view).remove(0);
    let text = serde_json::to_string(&row).unwrap();
    for name in ["\"container\":\"box\"", "\"mrays_per_s\":", "\"build_stages_ms\":{", "\"primitive_tests_per_ray\":"] {
        assert!(text.contains(name), "{name} in {text}");
    }
    let read: Measurement = serde_json::from_str(&text).unwrap();
    assert_eq!((read.number(HITS), &read.model, &read.settings), (row.number(HITS), &row.model, &row.settings));
    let token = CancelToken::new();
    token.cancel();
    let mut rows = 0;
    let outcome = measure("bench", &subject, &both(), &view, &token, &mut |_| rows += 1);
    assert!(matches!(outcome, Err(LabError::Cancelled(_))));
    assert_eq!(rows, 0, "nothing was done");
}

#[test]
fn a_cancelled_group_reports_finished_repetitions() {
    let subject = subject("builtin:teapot:1");
    // Without cancelling, this would take hours.
    let endless = TraceView { repeat: 100_000, size: [8, 8], ..view(&subject, Traversal::Ordered) };
    let token = CancelToken::new();
    let mut rows = Vec::new();
    let outcome = std::thread::scope(|scope| {
        scope.spawn(|| {
            while token.progress() == 0.0 {
                std::thread::yield_now();
            }
            token.cancel();
        });
        scaling(&subject, &both()[0], 2, false, &endless, &token, &mut |row| rows.push(row))
    });
    assert!(matches!(outcome, Err(LabError::Cancelled(_))));
    let [one, two] = &rows[..] else { panic!("{} rows", rows.len()) };
    // Either may be the one that is ahead: every second round goes through the threads the other way round.
    assert!(
        (1..100_000).contains(&one.repeat) && one.repeat.abs_diff(two.repeat) <= 1,
        "{} and {}",
        one.repeat,
        two.repeat
    );
    for (speedup, time) in [(SPEEDUP, BUILD_MS), (TRACE_SPEEDUP, TRACE_MS)] {
        assert_eq!(one.number(speedup), 1.0);
        assert_eq!(two.number(speedup), one.number(time) / two.number(time));
    }
}

/// Cancelled at each of its polls, a measurement gives rows of whole repetitions: one that was cancelled before its last trace would
/// have a time of 0 for it.
#[test]
fn rows_are_of_complete_repetitions() {
    let subject = subject("builtin:cornell");
    let view = TraceView { size: [4, 4], ..view(&subject, Traversal::Ordered) };
    let polls = Arc::new(AtomicU64::new(0));
    let run = |cancel_at: u64| {
        let count = Arc::clone(&polls);
        let token = CancelToken::watched(move |poll| {
            count.fetch_max(poll, Ordering::Relaxed);
            poll >= cancel_at
        });
        let mut rows = Vec::new();
        let _ = measure("bench", &subject, &both()[..1], &view, &token, &mut |row| rows.push(row));
        rows
    };
    assert_eq!(run(u64::MAX)[0].repeat, 2);
    let polls = polls.load(Ordering::Relaxed);
    let mut repeats = Vec::new();
    for poll in 1..=polls {
        for row in run(poll) {
            let times = [BUILD_MS, TRACE_MS, COLLAPSE_MS, WIDE_TRACE_MS].map(|time| row.number(time));
            assert!(
                times.iter().all(|&ms| ms > 0.0),
                "poll {poll} of {polls}: {} repetitions in {times:?} ms",
                row.repeat
            );
            repeats.push(row.repeat);
        }
    }
    // Cancelled in the second repetition; in the first, which measures more, there is no row.
    assert!(repeats.len() > 16 && repeats.iter().all(|&repeat| repeat == 1), "{repeats:?} of {polls} polls");
}

fn sweep_rows(name: &str, epsilons: &[f32]) -> Vec<Measurement> {
    let subject = subject(name);
    let job = Job::Sweep(SweepPlan {
        ranges: vec![(&EPSILON, epsilons.to_vec()), (&THRESHOLD, vec![4.0, 6.0, 8.0])],
        containers: ContainerKind::OF_PAPER.to_vec(),
        threads: 1,
        shard: (1, 1),
    });
    collect(|row| job.run(&subject, (0, 1), &view(&subject, Traversal::Ordered), &CancelToken::new(), row))
}

#[test]
fn a_sweep_is_drawn_as_the_papers_three_curves_and_each_with_its_unit() {
    let rows = sweep_rows("builtin:teapot:2", &[0.2]);
    let panels = Figure::of_rows(&rows).unwrap().charts;
    let labels: Vec<_> = panels.iter().map(|panel| panel.labels[1].as_str()).collect();
    let relative = "Relative to δ = 6";
    let absolute = [
        "Build time (ms)",
        "Trace time, binary tree (ms)",
        "Tests per entering ray",
        "Bytes per entering ray",
        "SAH cost, boxes",
        "SAH cost, spheres",
    ];
    assert_eq!(labels, [&[relative; 2][..], &absolute].concat());
    for panel in &panels[..2] {
        let names: Vec<_> = panel.curves.iter().map(|curve| curve.name.as_str()).collect();
        assert_eq!(names, ["Build time", "Trace time", "Tests per entering ray"]);
        for curve in &panel.curves {
            assert_eq!(curve.points.iter().map(|point| point.x).collect::<Vec<_>>(), [4.0, 6.0, 8.0]);
            assert_eq!(curve.points[1].y, 1.0, "{}", curve.name);
        }
    }
    let tests = &panels[4];
    assert_eq!(tests.curves.iter().map(|curve| curve.name.as_str()).collect::<Vec<_>>(), ["boxes", "spheres"]);
    for point in tests.curves.iter().flat_map(|curve| &curve.points) {
        let row = &rows[point.row.unwrap()];
        assert_eq!((point.x, point.y), (row.settings.number(&THRESHOLD).unwrap(), row.number(TESTS_PER_ENTERING_RAY)));
    }
}

#[test]
fn models_of_the_same_file_name_stay_apart() {
    let mut rows = sweep_rows("builtin:teapot:1", &[0.2]);
    for (index, row) in rows.iter_mut().enumerate() {
        row.model = if index % 2 == 0 { "old/sponza.obj" } else { "new/sponza.obj" }.to_owned();
    }
    let table = tables("sweep", &rows).remove(0);
    assert_eq!((table.rows[0][0].as_str(), table.rows[1][0].as_str()), ("old/sponza.obj", "new/sponza.obj"));
    let panels = Figure::of_rows(&rows).unwrap().charts;
    assert_eq!(panels[2].curves.len(), 2, "build time");
}

#[test]
fn tables_hold_the_numbers_of_the_rows() {
    let subject = subject("builtin:teapot:2");
    let view = view(&subject, Traversal::Ordered);
    let rows = collect(|row| bench(&subject, &both(), &view, false, &CancelToken::new(), row));
    let [times, tests, stages, trees] = &tables("bench", &rows)[..] else { panic!("four tables") };
    for table in [times, tests, stages, trees] {
        assert!(table.rows.iter().all(|row| row.len() == table.columns.len()), "{table}");
    }
    let column = |name: &str| tests.columns.iter().position(|column| column.0 == name).unwrap();
    for row in &rows {
        let name = row.container.name();
        assert_eq!(tests.rows[0][column(&format!("all {name}"))], number(row.number(TESTS_PER_RAY)));
        assert_eq!(tests.rows[0][column(&format!("entering {name}"))], number(row.number(TESTS_PER_ENTERING_RAY)));
    }
    assert!(tests.rows[1][0].contains("the paper's teapot") && tests.rows[1].contains(&"49".to_owned()));
    let sum: f64 = rows[0].stages_ms().values().sum();
    assert!(rows[0].stages_ms().contains_key("codes") && sum > 0.0);
    assert_eq!(stages.rows[0].last().map(String::is_empty), Some(false));
}
