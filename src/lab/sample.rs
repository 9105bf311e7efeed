//! A made row for tests of everything that is calculated from rows: each number is another, so that no column passes for
//! another.

use std::collections::BTreeMap;

use serde_json::Value;

use super::conditions::{Conditions, ViewConditions};
use super::measurement::{FormOfCopies, FrameOfClip, Measurement};
use super::population::{MeasuredRays, Population};
use super::speedup::prediction::{PredictedScaling, PredictedSpeedup, ScalingPrediction, StageWork};
use super::verdict::{RowVerdict, Word};
use crate::catalog::numbers::rows::{BEHIND_MS, POPULATION_TESTS_PER_RAY, PREPARATION_MS, RAY_NS, UPDATE_MS};
use crate::catalog::settings::{CURVE, EPSILON, OPTIMIZE, ROUNDS, Stated, THRESHOLD};
use crate::catalog::values::Values;
use bvhscope_engine::follow::Policy;
use bvhscope_engine::tree::ContainerKind;

/// A row in which every column is set.
pub(super) fn sample() -> Measurement {
    Measurement {
        command: "bench".to_owned(),
        model: "models/thing.obj".to_owned(),
        triangles: 7001,
        builder: "aac".to_owned(),
        tree: None,
        label: None,
        preset: Some("fast".to_owned()),
        container: ContainerKind::Aabb,
        settings: settings(),
        motion: Some(FrameOfClip { policy: Policy::Rotate, clip: "run".to_owned(), frame: 37, time_s: 1.5 }),
        form: Some(FormOfCopies { open: Some(2.5), traced_bytes: 1_031_000 }),
        traversal: "ordered".to_owned(),
        threads: 3,
        width_px: 101,
        height_px: 103,
        repeat: 5,
        rounds: rounds(),
        verdicts: vec![RowVerdict {
            number: "wide_trace_ms".to_owned(),
            against: "hq, box".to_owned(),
            verdict: Word::Worse,
            factor: Some(1.375),
            interval: Some([1.125, 1.75]),
            rounds: Some(9),
            less: Some(0),
            pays_from: Some(11),
            break_even_rays: Some(257_000.0),
            break_even_interval: Some([Some(128_000.0), None]),
        }],
        values: values(),
        predicted_scaling: Some(prediction()),
        conditions: Some(Conditions {
            view: Some(ViewConditions {
                camera: "front".to_owned(),
                eye: [1.25, 2.25, 3.25],
                target: [4.25, 5.25, 6.25],
                up: [0.0, 0.0, 1.0],
                fov: 47.5,
            }),
            simd: "sse2".to_owned(),
            version: "0.0.1".to_owned(),
            commit: Some("c0ffee".to_owned()),
            machine: "abacus".to_owned(),
            date: "2026-05-31T17:04Z".to_owned(),
            command_line: "bvhscope bench models/thing.obj".to_owned(),
        }),
        populations: vec![MeasuredRays {
            population: Population::AmbientOcclusion,
            rays: 19,
            entering_rays: None,
            root_hits: 17,
            visits: 13,
            predicted_visits: 2.5,
            cost: 1.25,
            tests_per_ray: None,
            tests_per_entering_ray: None,
        }],
        warnings: vec!["2 faces skipped".to_owned(), "1 texture missing".to_owned()],
    }
}

/// In each of five rounds, whose quartiles are those of the spreads.
fn rounds() -> BTreeMap<String, Vec<f64>> {
    let of = |key: &str, rounds: [f64; 5]| (key.to_owned(), rounds.to_vec());
    BTreeMap::from([
        of("build_ms", [16.0, 17.0, 20.0, 23.0, 24.0]),
        of("trace_ms", [61.0, 50.0, 47.0, 46.0, 62.0]),
        of("wide_trace_ms", [4.5, 4.25, 4.125, 4.75, 5.0]),
    ])
}

/// Every setting has another value than its default.
fn settings() -> Stated {
    let given = [(&THRESHOLD, "11"), (&EPSILON, "0.25"), (&CURVE, "hilbert"), (&OPTIMIZE, "collapse"), (&ROUNDS, "13")];
    given.into_iter().fold(Stated::default(), |stated, (setting, text)| stated.with(setting, text))
}

/// Every number of a tree that was built.
#[expect(clippy::too_many_lines, reason = "a table")]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
fn values() -> Values {
    // In two parts: the macro takes a level of recursion for each few numbers.
    let mut values = serde_json::json!({
        "build_ms": 20.0,
        "build_ms_spread": [17.0, 23.0],
        "ready_ms": 23.75,
        "build_stages_ms": {"sort": 2.5, "tree": 13.5},
        "mtriangles_per_s": 0.375,
        "trace_ms": 50.0,
        "trace_ms_spread": [47.0, 61.0],
        "rays": 10_403,
        "hits": 5_003,
        "binary_mrays_per_s": 0.208_06,
        "tests_per_ray": 29.5,
        "container_tests_per_ray": 26.25,
        "primitive_tests_per_ray": 3.25,
        "tests_per_entering_ray": 41.5,
        "bytes_per_entering_ray": 1_472.0,
        "node_lines_per_entering_ray": 17.5,
        "triangle_lines_per_entering_ray": 5.5,
        "sah_cost": 67.3,
        "traversal_cost": 1.5,
        "intersection_cost": 1.75,
        "epo": 0.875,
        "epo_margin": 0.031_25,
        "epo_triangles": 2_003,
        "nodes": 14_001,
        "leaves": 7_013,
        "max_depth": 31,
        "mean_leaf_depth": 19.5,
        "leaf_size": [1.0, 2.5, 7.0],
        "tree_hash": "00c0ffee12345678",
        "wide_tree_hash": "fedcba9876543210",
    });
    let memory_and_wide_tree = serde_json::json!({
        "tree_bytes": 448_037,
        "triangle_bytes": 252_037,
        "bytes_per_triangle": 98.0,
        "collapse_ms": 3.5,
        "wide_trace_ms": 4.5,
        "mrays_per_s": 2.3125,
        "mrays_per_s_spread": [2.0, 2.5],
        "entering_rays": 4_001,
        "wide_node_bytes": 96_001,
        "wide_triangle_bytes": 288_007,
        "wide_bytes_per_triangle": 54.5,
        "overlay_bytes": 56_003,
        "speedup": 2.75,
        "trace_speedup": 1.25,
    });
    values.as_object_mut().unwrap().extend(memory_and_wide_tree.as_object().unwrap().clone());
    let mut values: Values = serde_json::from_value(values).unwrap();
    for (number, value) in [
        (PREPARATION_MS, 19.25),
        (UPDATE_MS, 0.75),
        (BEHIND_MS, 6.5),
        (RAY_NS, 41.25),
        (POPULATION_TESTS_PER_RAY, 33.5),
    ] {
        values.set(number, value);
    }
    values.set_spread(RAY_NS, Some([40.5, 43.0]));
    values
}

/// A prediction in which every number is another.
fn prediction() -> ScalingPrediction {
    let scaling = |work_ms: f64, tasks| PredictedScaling {
        tasks,
        work_ms,
        span_ms: work_ms / 32.0,
        serial_share: 0.015_625,
        stages: vec![StageWork {
            stage: "sort".to_owned(),
            work_ms: work_ms / 4.0,
            serial_ms: work_ms / 64.0,
            inflation: Some(1.125),
        }],
        curve: vec![
            PredictedSpeedup { cores: 1, speedup: 1.0, lower: 1.0, upper: 1.0 },
            PredictedSpeedup { cores: 2, speedup: 1.75, lower: 1.5, upper: 1.875 },
            PredictedSpeedup { cores: 8, speedup: 5.5, lower: 3.5, upper: 7.25 },
        ],
        measured_at_two: Some(1.625),
    };
    let (build, trace) = (scaling(64.0, 71), scaling(128.0, 73));
    ScalingPrediction { runs: 7, fork_us: 0.0625, steal_us: Some([0.5, 11.0]), build, trace }
}

/// Fails with the names of the columns in which two rows differ. Numbers may differ by the rounding of another order of
/// operations.
pub(super) fn assert_same(found: &Measurement, expected: &Measurement) {
    let columns = |row| match serde_json::to_value(row) {
        Ok(Value::Object(columns)) => columns,
        other => panic!("a row is an object, not {other:?}"),
    };
    let (found, expected) = (columns(found), columns(expected));
    let names: std::collections::BTreeSet<&String> = found.keys().chain(expected.keys()).collect();
    let differences: Vec<String> = names
        .into_iter()
        .filter(|name| !same(found.get(*name), expected.get(*name)))
        .map(|name| format!("{name} is {:?} instead of {:?}", found.get(name), expected.get(name)))
        .collect();
    assert!(differences.is_empty(), "{}", differences.join("; "));
}

fn same(found: Option<&Value>, expected: Option<&Value>) -> bool {
    match (found.and_then(Value::as_f64), expected.and_then(Value::as_f64)) {
        (Some(found), Some(expected)) => (found - expected).abs() <= 1e-12 * expected.abs(),
        _ => found == expected,
    }
}

/// A small scene with a real tree.
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
pub(super) fn teapot() -> std::sync::Arc<crate::scene::Scene> {
    use bvhscope_engine::cancel::CancelToken;

    use crate::scene::{LoadOptions, SceneSource, load};
    let source = SceneSource::Builtin { name: "teapot".to_owned(), size: Some(4) };
    std::sync::Arc::new(load(&source, &LoadOptions::default(), &CancelToken::default()).unwrap())
}
