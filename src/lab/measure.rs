//! The core of every job: several trees of one scene, built and traced alternately, so that a slow phase of the machine
//! affects all of them alike.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::measurement::{Measurement, millis, pool};
use crate::accel::Accel;
use crate::camera::Camera;
use crate::render::{RenderRequest, RenderSettings, TestSummary, count_tests, trace_primary, trace_primary_wide};
use crate::scene::Scene;
use bvhscope_engine::BuildReport;
use bvhscope_engine::builders::BuildError;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::{BuildSettings, Preset};
use bvhscope_engine::stage_times::StageTimes;
use bvhscope_engine::tree::levels::Levels;
use bvhscope_engine::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST};
use bvhscope_engine::tree::traverse::Traversal;

/// The reason why a measurement ended early.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LabError {
    /// The measurement was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The measurement is impossible; the text says why.
    #[error("{0}")]
    Refused(String),
}

impl From<BuildError> for LabError {
    fn from(error: BuildError) -> Self {
        match error {
            BuildError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            BuildError::Refused(text) => Self::Refused(text),
        }
    }
}

/// A scene to measure, with the model name for its rows.
#[derive(Debug, Clone)]
pub struct Subject {
    /// The model as the user named it.
    pub model: String,
    /// The scene.
    pub scene: Arc<Scene>,
}

/// A tree to measure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setup {
    /// Build settings.
    pub build: BuildSettings,
    /// The preset that the settings come from, if any.
    pub preset: Option<Preset>,
    /// Threads for building and tracing; 0 for all.
    pub threads: usize,
}

/// The rays to trace and the number of repetitions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TraceView {
    /// The camera.
    pub camera: Camera,
    /// Width and height in pixels; one ray goes through the centre of each pixel.
    pub size: [u32; 2],
    /// Traversal order, both for timing and for counting.
    pub traversal: Traversal,
    /// SIMD level for tracing.
    pub simd: SimdLevel,
    /// Repetitions of each measurement, at least 1.
    pub repeat: usize,
}

/// The repetitions of one setup so far.
#[derive(Default)]
struct Trial {
    builds: Vec<StageTimes>,
    traces: Vec<f64>,
    collapses: Vec<f64>,
    wide_traces: Vec<f64>,
    first: Option<First>,
}

/// Results of the first repetition that are the same for all others, since the tree is the same.
struct First {
    threads: usize,
    report: BuildReport,
    epo: f32,
    wide_node_bytes: usize,
    wide_triangle_bytes: usize,
    wide_bytes_per_triangle: f64,
    tests: TestSummary,
}

/// Measures `setups` on one scene, interleaved: each is built and traced once, then all again, for `view.repeat` repetitions.
/// One row per setup, in the order of `setups`, is passed to `row` at the end. When cancelled, setups with at least one
/// completed repetition still give a row before the error is returned.
pub fn measure(
    command: &str,
    subject: &Subject,
    setups: &[Setup],
    view: &TraceView,
    token: &CancelToken,
    row: &mut dyn FnMut(Measurement),
) -> Result<(), LabError> {
    let mut trials: Vec<Trial> = setups.iter().map(|_| Trial::default()).collect();
    let outcome = repeat(subject, setups, view, token, &mut trials);
    for (setup, trial) in setups.iter().zip(&trials) {
        if let Some(first) = &trial.first {
            row(measurement(command, subject, setup, view, trial, first));
        }
    }
    outcome
}

fn repeat(
    subject: &Subject,
    setups: &[Setup],
    view: &TraceView,
    token: &CancelToken,
    trials: &mut [Trial],
) -> Result<(), LabError> {
    let pools =
        setups.iter().map(|setup| pool(setup.threads)).collect::<Result<Vec<_>, _>>().map_err(LabError::Refused)?;
    let rounds = view.repeat.max(1);
    for round in 0..rounds {
        for (index, ((setup, pool), trial)) in setups.iter().zip(&pools).zip(&mut *trials).enumerate() {
            let token = token.part(round * setups.len() + index, rounds * setups.len());
            pool.install(|| try_once(subject, setup, view, &token, trial))?;
        }
    }
    Ok(())
}

/// One repetition of one setup. Only one tree exists at a time, so that the largest scene that can be shown can also be
/// measured.
fn try_once(
    subject: &Subject,
    setup: &Setup,
    view: &TraceView,
    token: &CancelToken,
    trial: &mut Trial,
) -> Result<(), LabError> {
    let accel = Arc::new(Accel::build(&subject.scene, &setup.build, &token.part(0, 3))?);
    let trace = trace_primary(&request(&accel, view), view.traversal, &token.part(1, 3))?;
    if trial.first.is_none() {
        let tests = count_tests(&request(&accel, view), &token.part(2, 3))?;
        let threads = rayon::current_num_threads();
        trial.first = Some(First {
            threads,
            report: accel.report.clone(),
            epo: accel.epo(token)?,
            wide_node_bytes: accel.wide().tree.node_bytes(),
            wide_triangle_bytes: accel.wide().tree.triangle_bytes(),
            wide_bytes_per_triangle: accel.wide().bytes_per_triangle(),
            tests,
        });
    }
    trial.builds.push(accel.report.stages.clone());
    trial.traces.push(millis(trace.trace_time));
    trial.collapses.push(millis(accel.wide().collapse_time));
    let trace = trace_primary_wide(&request(&accel, view), &token.part(2, 3))?;
    trial.wide_traces.push(millis(trace.trace_time));
    token.set_progress(1.0);
    Ok(())
}

fn measurement(
    command: &str,
    subject: &Subject,
    setup: &Setup,
    view: &TraceView,
    trial: &Trial,
    first: &First,
) -> Measurement {
    let (build_ms, build_ms_spread) = median(trial.builds.iter().map(|stages| millis(stages.total())));
    let (trace_ms, trace_ms_spread) = median(trial.traces.iter().copied());
    let (collapse_ms, _) = median(trial.collapses.iter().copied());
    let (wide_trace_ms, _) = median(trial.wide_traces.iter().copied());
    let First { report, tests, .. } = first;
    let stats = &report.stats;
    Measurement {
        command: command.to_owned(),
        model: subject.model.clone(),
        triangles: subject.scene.triangles.len(),
        builder: setup.build.builder.name().to_owned(),
        preset: setup.preset.map(|preset| preset.name().to_owned()),
        container: setup.build.container,
        threshold: setup.build.threshold,
        epsilon: setup.build.epsilon,
        curve: setup.build.curve,
        optimize: setup.build.passes(),
        traversal: view.traversal.name().to_owned(),
        threads: first.threads,
        width_px: view.size[0],
        height_px: view.size[1],
        repeat: trial.builds.len(),
        build_ms,
        build_ms_spread,
        build_stages_ms: stage_medians(&trial.builds),
        mtriangles_per_s: Some(subject.scene.triangles.len() as f64 / build_ms.max(1e-6) / 1e3),
        trace_ms,
        trace_ms_spread,
        rays: tests.rays,
        hits: tests.hits,
        mrays_per_s: if trace_ms > 0.0 { tests.rays as f64 / trace_ms / 1e3 } else { 0.0 },
        tests_per_ray: f64::from(tests.container_tests_per_ray) + f64::from(tests.primitive_tests_per_ray),
        container_tests_per_ray: f64::from(tests.container_tests_per_ray),
        primitive_tests_per_ray: f64::from(tests.primitive_tests_per_ray),
        sah_cost: f64::from(stats.sah_cost),
        traversal_cost: Some(TRAVERSAL_COST.into()),
        intersection_cost: Some(INTERSECTION_COST.into()),
        epo: f64::from(first.epo),
        nodes: stats.nodes,
        leaves: stats.leaves,
        max_depth: stats.max_depth,
        mean_leaf_depth: Some(stats.mean_leaf_depth.into()),
        leaf_size: Some([stats.min_leaf_size.into(), stats.mean_leaf_size.into(), stats.max_leaf_size.into()]),
        tree_bytes: Some(report.tree_bytes),
        triangle_bytes: Some(report.triangle_bytes),
        bytes_per_triangle: report.bytes_per_triangle(),
        collapse_ms: Some(collapse_ms),
        wide_trace_ms: Some(wide_trace_ms),
        wide_mrays_per_s: Some(if wide_trace_ms > 0.0 { tests.rays as f64 / wide_trace_ms / 1e3 } else { 0.0 }),
        wide_node_bytes: Some(first.wide_node_bytes),
        wide_triangle_bytes: Some(first.wide_triangle_bytes),
        wide_bytes_per_triangle: Some(first.wide_bytes_per_triangle),
        overlay_bytes: Some(Levels::bytes(stats.nodes)),
        speedup: None,
        trace_speedup: None,
        warnings: subject.scene.warnings.entries.iter().map(ToString::to_string).collect(),
    }
}

fn request(accel: &Arc<Accel>, view: &TraceView) -> RenderRequest {
    RenderRequest {
        accel: Arc::clone(accel),
        camera: view.camera,
        settings: RenderSettings { traversal: view.traversal, simd: view.simd, ..RenderSettings::default() },
        width_px: view.size[0],
        height_px: view.size[1],
        coarseness: 1,
        count_tests: false,
    }
}

/// Median, and smallest and largest value; zeros for an empty iterator.
pub fn median(values: impl Iterator<Item = f64>) -> (f64, [f64; 2]) {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let (Some(&first), Some(&last)) = (values.first(), values.last()) else { return (0.0, [0.0, 0.0]) };
    let middle = values.len() / 2;
    let median = if values.len() % 2 == 1 { values[middle] } else { (values[middle - 1] + values[middle]) * 0.5 };
    (median, [first, last])
}

/// The median of each stage on its own; their sum is close to the median of the total, not equal to it.
fn stage_medians(builds: &[StageTimes]) -> BTreeMap<String, f64> {
    let mut by_stage: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for (name, duration) in builds.iter().flat_map(|build| &build.stages) {
        by_stage.entry(name).or_default().push(millis(*duration));
    }
    by_stage.into_iter().map(|(name, values)| (name.to_owned(), median(values.into_iter()).0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_of_odd_and_even_counts() {
        assert_eq!(median([3.0, 1.0, 2.0].into_iter()), (2.0, [1.0, 3.0]));
        assert_eq!(median([4.0, 1.0, 2.0, 3.0].into_iter()), (2.5, [1.0, 4.0]));
        assert_eq!(median(std::iter::empty()), (0.0, [0.0, 0.0]));
    }
}
