//! Runs a build and a trace on one thread and on two, with their tasks logged.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::clock::thread_time;
use super::prediction::ScalingPrediction;
use super::prices::{fork_price, steal_prices};
use super::runs::{Prices, Runs};
use crate::accel::Accel;
use crate::lab::measure::{LabError, request};
use crate::lab::measurement::pool;
use crate::lab::setup::{Setup, Subject, TraceView};
use crate::render::trace_primary;
use bvhscope_engine::WideBvh;
use bvhscope_engine::builders::build_binary;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::task_log::{TaskLog, TaskRecord};

/// Predicts the speed-up of `setup`, whose number of threads does not matter, from `view.repeat` runs on one thread and as many on
/// two. Where the process may use one core alone, only work and span are known.
pub fn predict(
    subject: &Subject,
    setup: &Setup,
    view: &TraceView,
    token: &CancelToken,
) -> Result<ScalingPrediction, LabError> {
    let mut pools = vec![pool(1).map_err(LabError::Refused)?];
    let second = pool(2).map_err(LabError::Refused)?;
    if second.current_num_threads() == 2 {
        pools.push(second);
    }
    let (mut build, mut trace) = (Runs::default(), Runs::default());
    let rounds = view.repeat.max(1);
    for round in 0..rounds {
        for (index, pool) in pools.iter().enumerate() {
            let token = token.part(round * pools.len() + index, rounds * pools.len());
            let [built, traced] = pool.install(|| run_once(subject, setup, view, &token))?;
            build.add(index + 1, &built.tasks, built.elapsed);
            trace.add(index + 1, &traced.tasks, traced.elapsed);
        }
    }
    let prices = Prices { fork: fork_price(&pools[0]), steal: pools.get(1).and_then(steal_prices) };
    Ok(ScalingPrediction {
        runs: rounds,
        fork_us: prices.fork * 1e6,
        steal_us: prices.steal.map(|steal| steal.map(|seconds| seconds * 1e6)),
        build: build.predict(&prices),
        trace: trace.predict(&prices),
    })
}

/// A computation that was run with its tasks logged.
struct Logged {
    tasks: Vec<TaskRecord>,
    /// Wall-clock time.
    elapsed: Duration,
}

/// Runs `work` with a token that logs its tasks.
fn logged<T, E>(token: &CancelToken, work: impl FnOnce(&CancelToken) -> Result<T, E>) -> Result<(T, Logged), E> {
    let log = TaskLog::with_clock(thread_time);
    let start = Instant::now();
    let token = token.logged(&log);
    let result = work(&token)?;
    token.end_task();
    Ok((result, Logged { elapsed: start.elapsed(), tasks: log.records() }))
}

/// One build and one trace.
fn run_once(subject: &Subject, setup: &Setup, view: &TraceView, token: &CancelToken) -> Result<[Logged; 2], LabError> {
    let triangles = &subject.scene.triangles;
    let build = |token: &CancelToken| -> Result<_, LabError> {
        let (tree, _) = build_binary(triangles, &setup.build, token)?;
        let wide = WideBvh::new(&tree, triangles, token)?;
        Ok((tree, wide))
    };
    let ((tree, wide), built) = logged(&token.part(0, 2), build)?;
    drop(wide);
    let accel = Arc::new(Accel::with_tree(&subject.scene, &setup.build, tree, token)?);
    accel.compute_leaf_triangles(token)?;
    let (_, traced) = logged(&token.part(1, 2), |token| {
        token.begin_stage("trace");
        trace_primary(&request(&accel, view), view.traversal, token)
    })?;
    Ok([built, traced])
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::lab::population::Populations;
    use crate::lab::sample::teapot;
    use crate::scene::LoadOptions;
    use crate::view::Place;
    use bvhscope_engine::kernel::SimdLevel;
    use bvhscope_engine::settings::{BuildSettings, BuilderKind};
    use bvhscope_engine::tree::traverse::Traversal;

    #[test]
    fn every_builder_and_every_ray_has_tasks() {
        let scene = teapot();
        let view = TraceView {
            camera: Camera::framing(&scene.bounds, scene.up),
            place: Place::Given,
            size: [40, 24],
            traversal: Traversal::Ordered,
            simd: SimdLevel::default(),
            repeat: 2,
            populations: Populations::NONE,
            epo_samples: None,
        };
        let subject = Subject {
            model: "teapot".to_owned(),
            scene,
            trees: Vec::new(),
            forms: Vec::new(),
            rays: None,
            load: LoadOptions::default(),
        };
        for builder in BuilderKind::ALL {
            let setup =
                Setup { build: BuildSettings { builder, ..BuildSettings::default() }, preset: None, threads: 0 };
            let found = predict(&subject, &setup, &view, &CancelToken::new()).unwrap();
            for scaling in [&found.build, &found.trace] {
                let expected = [1, 2, 4, 8, 16, 32, 64];
                assert!(scaling.curve.iter().map(|point| point.cores).eq(expected), "{builder:?}");
                assert!(scaling.curve.iter().all(|point| point.lower <= point.speedup && point.speedup <= point.upper));
                assert!(scaling.span_ms > 0.0 && scaling.span_ms <= scaling.work_ms * 1.000_001, "{builder:?}");
            }
            // 40×24 pixels are six tiles, of up to 16×16.
            assert!(found.trace.tasks >= 6, "{builder:?} {:?}", found.trace);
            assert!(found.build.tasks > 4 || builder == BuilderKind::None, "{builder:?} {:?}", found.build);
        }
    }
}
