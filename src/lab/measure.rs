//! The core of every job: several trees of one scene, built and traced in turn, so that a slow moment of the machine
//! hits all of them alike.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::measurement::{Measurement, millis, pool};
use crate::accel::Accel;
use crate::bvh::builders::{BuildError, StageTimes, build};
use crate::bvh::traverse::Traversal;
use crate::bvh::{BuildSettings, Preset, SimdLevel};
use crate::camera::Camera;
use crate::cancel::{CancelToken, Cancelled};
use crate::render::{RenderRequest, RenderSettings, count_tests, trace_primary};
use crate::scene::Scene;

/// Why there are no more rows.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LabError {
    /// Nobody wants them any more.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// They cannot be measured; the text says why.
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

/// The scene that is measured, under the name that its rows carry.
#[derive(Debug, Clone)]
pub struct Subject {
    /// The model as it was given.
    pub model: String,
    /// Its triangles.
    pub scene: Arc<Scene>,
}

/// One tree that is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setup {
    /// How it is built.
    pub build: BuildSettings,
    /// The preset that these settings come from, where they do.
    pub preset: Option<Preset>,
    /// Threads for building and tracing; 0 for all.
    pub threads: usize,
}

/// Which rays are traced, and how often.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TraceView {
    /// From where.
    pub camera: Camera,
    /// Width and height in pixels: one ray through the centre of each.
    pub size: [u32; 2],
    /// How rays visit nodes, timed and counted alike.
    pub traversal: Traversal,
    /// Vector instructions that rays are traced with.
    pub simd: SimdLevel,
    /// Repetitions of each measurement, at least 1.
    pub repeat: usize,
}

/// Times of one tree over all repetitions.
#[derive(Default)]
struct Times {
    builds: Vec<StageTimes>,
    traces: Vec<f64>,
}

/// Measures `setups` on one scene, interleaved: first all builds of a round, then the next round; the same for tracing. One
/// row each, in the order of `setups`.
pub fn measure(
    command: &str,
    subject: &Subject,
    setups: &[Setup],
    view: &TraceView,
    token: &CancelToken,
) -> Result<Vec<Measurement>, LabError> {
    let pools =
        setups.iter().map(|setup| pool(setup.threads)).collect::<Result<Vec<_>, _>>().map_err(LabError::Refused)?;
    let mut times: Vec<Times> = setups.iter().map(|_| Times::default()).collect();
    let mut accels: Vec<Arc<Accel>> = Vec::with_capacity(setups.len());
    // The first build of each is kept for tracing and gives the statistics.
    for ((setup, pool), times) in setups.iter().zip(&pools).zip(&mut times) {
        let accel = pool.install(|| Accel::build(&subject.scene, &setup.build, token))?;
        times.builds.push(accel.report.stages.clone());
        accels.push(Arc::new(accel));
    }
    for _ in 1..view.repeat {
        for ((setup, pool), times) in setups.iter().zip(&pools).zip(&mut times) {
            let (_, stages) = pool.install(|| build(&subject.scene.triangles, &setup.build, token))?;
            times.builds.push(stages);
        }
    }
    for _ in 0..view.repeat.max(1) {
        for ((accel, pool), times) in accels.iter().zip(&pools).zip(&mut times) {
            let trace = pool.install(|| trace_primary(&request(accel, view), view.traversal, token))?;
            times.traces.push(millis(trace.trace_time));
        }
    }
    let mut rows = Vec::with_capacity(setups.len());
    for (((setup, pool), accel), times) in setups.iter().zip(&pools).zip(&accels).zip(&times) {
        let tests = pool.install(|| count_tests(&request(accel, view), token))?;
        let (build_ms, build_ms_spread) = median(times.builds.iter().map(|stages| millis(stages.total())));
        let (trace_ms, trace_ms_spread) = median(times.traces.iter().copied());
        let stats = &accel.report.stats;
        let triangles = subject.scene.triangles.len();
        let bytes = accel.report.tree_bytes + accel.report.triangle_bytes;
        rows.push(Measurement {
            command: command.to_owned(),
            model: subject.model.clone(),
            triangles,
            builder: setup.build.builder.name().to_owned(),
            preset: setup.preset.map(|preset| preset.name().to_owned()),
            container: setup.build.container,
            threshold: setup.build.threshold,
            epsilon: setup.build.epsilon,
            traversal: traversal_name(view.traversal).to_owned(),
            threads: pool.current_num_threads(),
            width_px: view.size[0],
            height_px: view.size[1],
            repeat: view.repeat,
            build_ms,
            build_ms_spread,
            build_stages_ms: stage_medians(&times.builds),
            trace_ms,
            trace_ms_spread,
            rays: tests.rays,
            hits: tests.hits,
            mrays_per_s: if trace_ms > 0.0 { tests.rays as f64 / trace_ms / 1e3 } else { 0.0 },
            tests_per_ray: f64::from(tests.container_tests_per_ray) + f64::from(tests.primitive_tests_per_ray),
            container_tests_per_ray: f64::from(tests.container_tests_per_ray),
            primitive_tests_per_ray: f64::from(tests.primitive_tests_per_ray),
            sah_cost: f64::from(stats.sah_cost),
            epo: f64::from(pool.install(|| accel.epo())),
            nodes: stats.nodes,
            leaves: stats.leaves,
            max_depth: stats.max_depth,
            bytes_per_triangle: bytes as f64 / triangles.max(1) as f64,
            speedup: None,
            trace_speedup: None,
        });
    }
    Ok(rows)
}

/// The name on the command line and in JSON.
pub const fn traversal_name(traversal: Traversal) -> &'static str {
    match traversal {
        Traversal::Ordered => "ordered",
        Traversal::Paper => "paper",
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
    }
}

/// Median, and smallest and largest value; zeros for none.
pub fn median(values: impl Iterator<Item = f64>) -> (f64, [f64; 2]) {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let (Some(&first), Some(&last)) = (values.first(), values.last()) else { return (0.0, [0.0, 0.0]) };
    let middle = values.len() / 2;
    let median = if values.len() % 2 == 1 { values[middle] } else { (values[middle - 1] + values[middle]) * 0.5 };
    (median, [first, last])
}

/// The median of each stage on its own; their sum is near the median of the whole, not equal to it.
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
