//! The repetitions of one setup, and the columns of its row as functions of them.

use std::collections::BTreeMap;
use std::time::Duration;

use super::measurement::{Measurement, millions_per_second, millis};
use super::population::MeasuredRays;
use super::setup::{Contender, Subject, TraceView};
use crate::render::{PrimaryTrace, TestSummary};
use bvhscope_engine::BuildReport;
use bvhscope_engine::stage_times::StageTimes;
use bvhscope_engine::tree::levels::Levels;
use bvhscope_engine::tree::overlap::EndPointOverlap;
use bvhscope_engine::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST};

/// The completed repetitions of one setup.
#[derive(Default)]
pub(super) struct Trial {
    builds: Vec<StageTimes>,
    traces_ms: Vec<f64>,
    collapses_ms: Vec<f64>,
    wide_traces_ms: Vec<f64>,
    /// `None` before the first repetition is complete.
    pub(super) first: Option<First>,
}

/// Results of the first repetition that are the same for all others, since the tree is the same.
pub(super) struct First {
    pub(super) threads: usize,
    pub(super) report: BuildReport,
    pub(super) epo: EndPointOverlap,
    /// Of the binary tree and of the wide one.
    pub(super) hashes: [u64; 2],
    pub(super) wide_node_bytes: usize,
    pub(super) wide_triangle_bytes: usize,
    pub(super) wide_bytes_per_triangle: f64,
    pub(super) tests: TestSummary,
    pub(super) populations: Vec<MeasuredRays>,
}

impl Trial {
    /// Adds a complete repetition: the build, the trace of the binary tree, and collapsing and tracing of the wide one.
    pub(super) fn record(
        &mut self,
        build: &StageTimes,
        trace: &PrimaryTrace,
        collapse_time: Duration,
        wide_trace: &PrimaryTrace,
    ) {
        self.builds.push(build.clone());
        self.traces_ms.push(millis(trace.trace_time));
        self.collapses_ms.push(millis(collapse_time));
        self.wide_traces_ms.push(millis(wide_trace.trace_time));
    }

    /// The row of the repetitions so far.
    pub(super) fn measurement(
        &self,
        command: &str,
        subject: &Subject,
        Contender { setup, read }: &Contender,
        view: &TraceView,
        first: &First,
    ) -> Measurement {
        let (build_ms, build_ms_spread) = match read {
            None => median(self.builds.iter().map(|stages| millis(stages.total()))),
            Some(accel) => {
                let ms = accel.build_ms().unwrap_or(f64::NAN);
                (ms, [ms; 2])
            }
        };
        let (trace_ms, trace_ms_spread) = median(self.traces_ms.iter().copied());
        let ready =
            self.builds.iter().zip(&self.collapses_ms).map(|(build, collapse)| millis(build.total()) + collapse);
        let (ready_ms, _) = median(ready);
        let (collapse_ms, _) = median(self.collapses_ms.iter().copied());
        let (wide_trace_ms, _) = median(self.wide_traces_ms.iter().copied());
        let First { report, tests, .. } = first;
        let [tree_hash, wide_tree_hash] = first.hashes.map(|hash| Some(format!("{hash:016x}")));
        let stats = &report.stats;
        let triangles = subject.scene.triangles.len();
        Measurement {
            command: command.to_owned(),
            model: subject.model.clone(),
            triangles,
            builder: read.as_ref().map_or(setup.build.builder.name().into(), |accel| accel.builder_name()).into_owned(),
            tree: read.as_ref().and_then(|accel| accel.file.as_ref()).map(|file| file.path.display().to_string()),
            preset: setup.preset.map(|preset| preset.name().to_owned()),
            container: setup.build.container,
            threshold: setup.build.threshold,
            epsilon: setup.build.epsilon,
            curve: setup.build.curve,
            optimize: setup.build.passes(),
            rounds: setup.build.annealing_rounds(),
            traversal: view.traversal.name().to_owned(),
            threads: first.threads,
            width_px: view.size[0],
            height_px: view.size[1],
            repeat: self.builds.len(),
            build_ms,
            build_ms_spread,
            ready_ms: Some(ready_ms),
            build_stages_ms: stage_medians(&self.builds),
            mtriangles_per_s: (build_ms >= 0.0).then(|| millions_per_second(triangles as u64, build_ms)),
            trace_ms,
            trace_ms_spread,
            rays: tests.rays,
            hits: tests.hits,
            mrays_per_s: millions_per_second(tests.rays, trace_ms),
            tests_per_ray: f64::from(tests.container_tests_per_ray) + f64::from(tests.primitive_tests_per_ray),
            container_tests_per_ray: f64::from(tests.container_tests_per_ray),
            primitive_tests_per_ray: f64::from(tests.primitive_tests_per_ray),
            sah_cost: f64::from(stats.sah_cost),
            traversal_cost: Some(TRAVERSAL_COST.into()),
            intersection_cost: Some(INTERSECTION_COST.into()),
            epo: f64::from(first.epo.value),
            epo_triangles: Some(first.epo.sampled),
            nodes: stats.nodes,
            leaves: stats.leaves,
            max_depth: stats.max_depth,
            mean_leaf_depth: Some(stats.mean_leaf_depth.into()),
            leaf_size: Some([stats.min_leaf_size.into(), stats.mean_leaf_size.into(), stats.max_leaf_size.into()]),
            tree_hash,
            wide_tree_hash,
            tree_bytes: Some(report.tree_bytes),
            triangle_bytes: Some(report.triangle_bytes),
            bytes_per_triangle: report.bytes_per_triangle(),
            collapse_ms: Some(collapse_ms),
            wide_trace_ms: Some(wide_trace_ms),
            wide_mrays_per_s: Some(millions_per_second(tests.rays, wide_trace_ms)),
            wide_node_bytes: Some(first.wide_node_bytes),
            wide_triangle_bytes: Some(first.wide_triangle_bytes),
            wide_bytes_per_triangle: Some(first.wide_bytes_per_triangle),
            overlay_bytes: Some(Levels::bytes(stats.nodes)),
            speedup: None,
            trace_speedup: None,
            predicted_scaling: None,
            populations: first.populations.clone(),
            warnings: subject.scene.warnings.entries.iter().map(ToString::to_string).collect(),
        }
    }
}

/// Median, and smallest and largest value; zeros for an empty iterator.
fn median(values: impl Iterator<Item = f64>) -> (f64, [f64; 2]) {
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
    use std::sync::Arc;

    use glam::Vec3;

    use super::*;
    use crate::camera::{Camera, Projection};
    use crate::lab::population::Populations;
    use crate::lab::sample::{assert_same, sample};
    use crate::lab::setup::Setup;
    use crate::scene::{FileLocation, Scene, SceneSource};
    use bvhscope_engine::geometry::Triangle;
    use bvhscope_engine::kernel::SimdLevel;
    use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve, Pass, Passes, Preset};
    use bvhscope_engine::tree::ContainerKind;
    use bvhscope_engine::tree::statistics::TreeStats;
    use bvhscope_engine::tree::traverse::Traversal;

    #[test]
    fn medians_of_odd_and_even_counts() {
        assert_eq!(median([3.0, 1.0, 2.0].into_iter()), (2.0, [1.0, 3.0]));
        assert_eq!(median([4.0, 1.0, 2.0, 3.0].into_iter()), (2.5, [1.0, 4.0]));
        assert_eq!(median(std::iter::empty()), (0.0, [0.0, 0.0]));
    }

    fn build([tree, flatten]: [u64; 2]) -> StageTimes {
        let stages = vec![("tree", Duration::from_millis(tree)), ("flatten", Duration::from_millis(flatten))];
        StageTimes { stages, ..StageTimes::default() }
    }

    fn trace(ms: u64) -> PrimaryTrace {
        // Numbers of rays that no column may come from.
        PrimaryTrace { rays: 7919, hits: 6997, trace_time: Duration::from_millis(ms) }
    }

    /// Seven triangles, whose loading gave a warning.
    fn subject() -> Subject {
        let triangles = vec![Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y }; 7];
        let mut scene = Scene::from_triangles(SceneSource::default_builtin(), triangles);
        scene.warnings.add("faces skipped", || FileLocation::Line(3));
        Subject { model: "a/model.obj".to_owned(), scene: Arc::new(scene), trees: Vec::new() }
    }

    /// Every number is another prime wherever it can be, so that each wrong formula gives another result.
    fn first() -> First {
        let stats = TreeStats {
            nodes: 13,
            leaves: 17,
            max_depth: 5,
            min_leaf_depth: 1,
            mean_leaf_depth: 2.75,
            min_leaf_size: 2,
            mean_leaf_size: 3.5,
            max_leaf_size: 61,
            nodes_per_depth: vec![1, 2],
            leaf_size_histogram: vec![0, 59],
            mean_arity: 2.0,
            max_arity: 2,
            arity_histogram: vec![0, 0, 6],
            sah_cost: 67.5,
        };
        First {
            threads: 3,
            report: BuildReport {
                stages: build([971, 977]),
                build_time: Duration::from_millis(983),
                threads: 89,
                stats,
                tree_bytes: 1009,
                triangle_bytes: 7 * size_of::<Triangle>(),
            },
            epo: EndPointOverlap { value: 0.625, sampled: 5, triangles: 7, visited: 1013 },
            hashes: [0x3fb, 0xfeed_0000_0000_03fd],
            populations: sample().populations,
            wide_node_bytes: 331,
            wide_triangle_bytes: 337,
            wide_bytes_per_triangle: 95.5,
            tests: TestSummary {
                rays: 101,
                hits: 53,
                container_tests_per_ray: 11.25,
                primitive_tests_per_ray: 1.5,
                trace_time: Duration::from_millis(997),
            },
        }
    }

    #[test]
    fn every_column_follows_its_definition() {
        let subject = subject();
        let mut trial = Trial::default();
        for (stages, binary, collapse, wide) in [([11, 2], 43, 79, 29), ([31, 3], 37, 71, 19), ([17, 5], 41, 73, 23)] {
            trial.record(&build(stages), &trace(binary), Duration::from_millis(collapse), &trace(wide));
        }
        let build = BuildSettings {
            builder: BuilderKind::Aac,
            container: ContainerKind::Sphere,
            threshold: 47,
            epsilon: 0.375,
            curve: Curve::Hilbert,
            optimize: Passes::NONE.with(Pass::Collapse),
            rounds: 7,
        };
        let setup = Contender::from(Setup { build, preset: Some(Preset::Hq), threads: 83 });
        let camera =
            Camera { eye: Vec3::Z, target: Vec3::ZERO, up: Vec3::Y, fov_y: 1.0, projection: Projection::Perspective };
        let view = TraceView {
            camera,
            size: [103, 107],
            traversal: Traversal::Paper,
            simd: SimdLevel::best(),
            repeat: 109,
            populations: Populations::NONE,
        };
        let found = trial.measurement("sweep", &subject, &setup, &view, &first());
        let expected = Measurement {
            command: "sweep".to_owned(),
            model: "a/model.obj".to_owned(),
            triangles: 7,
            builder: "aac".to_owned(),
            tree: None,
            preset: Some("hq".to_owned()),
            container: ContainerKind::Sphere,
            threshold: 47,
            epsilon: 0.375,
            curve: Curve::Hilbert,
            optimize: Passes::NONE.with(Pass::Collapse),
            rounds: None,
            traversal: "paper".to_owned(),
            threads: 3,
            width_px: 103,
            height_px: 107,
            repeat: 3,
            // Of 13, 34 and 22.
            build_ms: 22.0,
            build_ms_spread: [13.0, 34.0],
            // Of 13 + 79, 34 + 71 and 22 + 73.
            ready_ms: Some(95.0),
            build_stages_ms: [("tree".to_owned(), 17.0), ("flatten".to_owned(), 3.0)].into(),
            // 7 triangles in 22 ms.
            mtriangles_per_s: Some(7.0 / 22_000.0),
            trace_ms: 41.0,
            trace_ms_spread: [37.0, 43.0],
            rays: 101,
            hits: 53,
            // 101 rays in 41 ms.
            mrays_per_s: 101.0 / 41_000.0,
            tests_per_ray: 12.75,
            container_tests_per_ray: 11.25,
            primitive_tests_per_ray: 1.5,
            sah_cost: 67.5,
            traversal_cost: Some(TRAVERSAL_COST.into()),
            intersection_cost: Some(INTERSECTION_COST.into()),
            epo: 0.625,
            epo_triangles: Some(5),
            nodes: 13,
            leaves: 17,
            max_depth: 5,
            mean_leaf_depth: Some(2.75),
            leaf_size: Some([2.0, 3.5, 61.0]),
            tree_hash: Some("00000000000003fb".to_owned()),
            wide_tree_hash: Some("feed0000000003fd".to_owned()),
            tree_bytes: Some(1009),
            triangle_bytes: Some(252),
            bytes_per_triangle: (1009.0 + 252.0) / 7.0,
            collapse_ms: Some(73.0),
            wide_trace_ms: Some(23.0),
            wide_mrays_per_s: Some(101.0 / 23_000.0),
            wide_node_bytes: Some(331),
            wide_triangle_bytes: Some(337),
            wide_bytes_per_triangle: Some(95.5),
            // Four bytes a node.
            overlay_bytes: Some(52),
            speedup: None,
            trace_speedup: None,
            predicted_scaling: None,
            populations: sample().populations,
            warnings: vec![subject.scene.warnings.entries[0].to_string()],
        };
        assert_same(&found, &expected);
    }

    #[test]
    fn a_time_of_zero_gives_no_infinite_rate() {
        let none = PrimaryTrace { rays: 0, hits: 0, trace_time: Duration::ZERO };
        let mut trial = Trial::default();
        trial.record(&StageTimes::default(), &none, Duration::ZERO, &none);
        let setup = Contender::from(Setup { build: BuildSettings::default(), preset: None, threads: 1 });
        let camera =
            Camera { eye: Vec3::Z, target: Vec3::ZERO, up: Vec3::Y, fov_y: 1.0, projection: Projection::Perspective };
        let view = TraceView {
            camera,
            size: [1, 1],
            traversal: Traversal::Ordered,
            simd: SimdLevel::best(),
            repeat: 1,
            populations: Populations::NONE,
        };
        let row = trial.measurement("bench", &subject(), &setup, &view, &first());
        assert_eq!((row.mrays_per_s, row.wide_mrays_per_s, row.mtriangles_per_s), (0.0, Some(0.0), Some(0.0)));
    }
}
