//! The repetitions of one setup, and the columns of its row as functions of them.

use std::collections::BTreeMap;
use std::time::Duration;

use super::conditions::Conditions;
use super::measurement::{FormOfCopies, Measurement, millis};
use super::population::MeasuredRays;
use super::setup::{Contender, Subject, TraceView};
use crate::accel::Accel;
use crate::catalog::numbers::Number;
use crate::catalog::numbers::rows::{
    BUILD_MS, BUILD_STAGES_MS, BYTES_PER_ENTERING_RAY, COLLAPSE_MS, ENTERING_RAYS, HITS, MRAYS_PER_S, RAYS, READY_MS,
    TRACE_MS, WIDE_TRACE_MS,
};
use crate::catalog::reading::{Times, TraceReading, TreeReading, WideReading};
use crate::catalog::settings::{Stated, preset_name};
use crate::catalog::values::Values;
use crate::render::{PrimaryTrace, TestSummary};
use bvhscope_engine::BuildReport;
use bvhscope_engine::stage_times::StageTimes;
use bvhscope_engine::tree::overlap::EndPointOverlap;

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
    /// `None` of a scene of copies.
    pub(super) epo: Option<EndPointOverlap>,
    /// Of the binary tree and of the wide one.
    pub(super) hashes: [u64; 2],
    pub(super) wide: WideReading,
    pub(super) tests: TestSummary,
    pub(super) populations: Vec<MeasuredRays>,
    /// Bytes of what rays read.
    pub(super) traced_bytes: usize,
}

/// The numbers of a tree over parts of copies: there is no binary one, nor are its nodes those of a tree that is shown.
const OF_PARTS: [&Number; 10] = [
    BUILD_MS,
    BUILD_STAGES_MS,
    READY_MS,
    COLLAPSE_MS,
    RAYS,
    HITS,
    WIDE_TRACE_MS,
    MRAYS_PER_S,
    ENTERING_RAYS,
    BYTES_PER_ENTERING_RAY,
];

impl Trial {
    /// Adds a complete repetition: the build, the trace of the binary tree, where there is one, and collapsing and tracing of the wide one.
    pub(super) fn record(
        &mut self,
        build: &StageTimes,
        trace: Option<&PrimaryTrace>,
        collapse_time: Duration,
        wide_trace: &PrimaryTrace,
    ) {
        self.builds.push(build.clone());
        self.traces_ms.extend(trace.map(|trace| millis(trace.trace_time)));
        self.collapses_ms.push(millis(collapse_time));
        self.wide_traces_ms.push(millis(wide_trace.trace_time));
    }

    /// The row of the repetitions so far.
    pub(super) fn measurement(
        &self,
        command: &str,
        subject: &Subject,
        contender: &Contender,
        view: &TraceView,
        first: &First,
    ) -> Measurement {
        let Contender { setup, read, label, .. } = contender;
        let mut values = Values::of(&self.reading(subject, contender, first));
        if contender.opened().is_some() {
            values.keep(&OF_PARTS);
        }
        let form = subject.form_of(contender);
        Measurement {
            command: command.to_owned(),
            model: subject.model.clone(),
            triangles: subject.scene.triangle_count() as usize,
            builder: read.as_ref().map_or(setup.build.builder.name().into(), |accel| accel.builder_name()).into_owned(),
            tree: read.as_ref().and_then(|accel| accel.file.as_ref()).map(|file| file.path.display().to_string()),
            label: label.clone(),
            preset: if read.is_some() { None } else { preset_name(&setup.build) },
            container: read.as_ref().map_or(setup.build.tree_container(), |accel| accel.tree.container_kind()),
            settings: if read.is_some() { Stated::default() } else { Stated::of(&setup.build) },
            motion: None,
            form: form.map(|form| FormOfCopies { open: form.open, traced_bytes: first.traced_bytes }),
            traversal: view.traversal.name().to_owned(),
            threads: first.threads,
            width_px: view.size[0],
            height_px: view.size[1],
            repeat: self.builds.len(),
            rounds: self.rounds(read.is_some()),
            verdicts: Vec::new(),
            values,
            predicted_scaling: None,
            conditions: Some(Conditions::new(subject, contender, view, first.threads)),
            populations: first.populations.clone(),
            warnings: subject.scene.warnings.entries.iter().map(ToString::to_string).collect(),
        }
    }
}

impl Trial {
    /// Each time in each round so far; the tree of a file is not built.
    fn rounds(&self, is_read: bool) -> BTreeMap<String, Vec<f64>> {
        let builds: Vec<f64> = self.builds.iter().map(|stages| millis(stages.total())).collect();
        let ready = builds.iter().zip(&self.collapses_ms).map(|(build, collapse)| build + collapse).collect();
        let built = [(BUILD_MS, builds), (READY_MS, ready)].into_iter().filter(|_| !is_read);
        let traced = [(TRACE_MS, self.traces_ms.clone()), (WIDE_TRACE_MS, self.wide_traces_ms.clone())];
        let traced = traced.into_iter().filter(|(_, rounds)| !rounds.is_empty());
        built.chain(traced).map(|(number, rounds)| (number.key.to_owned(), rounds)).collect()
    }

    /// The source of the numbers of the repetitions so far.
    fn reading<'a>(&self, subject: &Subject, contender: &Contender, first: &'a First) -> TreeReading<'a> {
        let (read, scene) = (contender.read.as_deref(), subject.scene_of(contender));
        let (report, tests) = (&first.report, &first.tests);
        let file_ms = read.and_then(Accel::build_ms);
        let build = match read {
            None => Some(times(self.builds.iter().map(|stages| millis(stages.total())))),
            Some(_) => file_ms.map(Times::single),
        };
        let builds = self.builds.iter().map(|build| match read {
            None => Some(millis(build.total())),
            Some(_) => file_ms,
        });
        let ready = builds.zip(&self.collapses_ms).map(|(build, collapse)| Some(build? + collapse));
        let ready: Option<Vec<f64>> = ready.collect();
        TreeReading {
            triangles: scene.triangles.len(),
            primitives: scene.primitive_names(),
            container: read.map_or(contender.setup.build.tree_container(), |accel| accel.tree.container_kind()),
            report,
            build,
            is_update: false,
            stages_ms: stage_medians(&self.builds),
            ready_ms: ready.map(|ready| median(ready.into_iter())),
            epo: first.epo,
            hashes: Some(first.hashes),
            wide: Some(WideReading { collapse_ms: median(self.collapses_ms.iter().copied()), ..first.wide }),
            trace: Some(TraceReading {
                rays: tests.rays,
                hits: tests.hits,
                entering: Some(tests.entering),
                tests: Some([tests.container_tests_per_ray, tests.primitive_tests_per_ray]),
                binary: Some(times(self.traces_ms.iter().copied())),
                wide: Some(times(self.wide_traces_ms.iter().copied())),
                picture_mrays_per_s: None,
            }),
            entering: tests.of_entering_ray(),
            at_rest: None,
        }
    }
}

/// Median and spread; a single repetition has no spread.
fn times(values: impl Iterator<Item = f64>) -> Times {
    Times::of(values.collect())
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    times(values).ms
}

/// The median of each stage on its own; their sum is close to the median of the total, not equal to it.
fn stage_medians(builds: &[StageTimes]) -> BTreeMap<String, f64> {
    let mut by_stage: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for (name, duration) in builds.iter().flat_map(|build| &build.stages) {
        by_stage.entry(name).or_default().push(millis(*duration));
    }
    by_stage.into_iter().map(|(name, values)| (name.to_owned(), median(values.into_iter()))).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use std::sync::Arc;

    use glam::Vec3;

    use super::*;
    use crate::camera::{Camera, Projection};
    use crate::catalog::numbers::rows::{BINARY_MRAYS_PER_S, MRAYS_PER_S, MTRIANGLES_PER_S};
    use crate::lab::conditions::ViewConditions;
    use crate::lab::population::Populations;
    use crate::lab::sample::{assert_same, sample};
    use crate::lab::setup::Setup;
    use crate::scene::{FileLocation, Instancing, LoadOptions, Scene, SceneSource};
    use crate::view::Place;
    use bvhscope_engine::geometry::Triangle;
    use bvhscope_engine::kernel::SimdLevel;
    use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve, Pass, Passes, Preset};
    use bvhscope_engine::tree::ContainerKind;
    use bvhscope_engine::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST, TreeStats};
    use bvhscope_engine::tree::traverse::{TestCounts, Traversal};
    use bvhscope_engine::wide::trace::CacheLines;

    #[test]
    fn medians_of_odd_and_even_counts() {
        let of = |values: &[f64]| times(values.iter().copied());
        let three = Times { ms: 2.0, spread: Some([1.5, 2.5]), count: 3, disturbed: 0 };
        assert_eq!(of(&[3.0, 1.0, 2.0]), three);
        assert_eq!(of(&[4.0, 1.0, 2.0, 3.0]), Times { ms: 2.5, spread: Some([1.75, 3.25]), count: 4, ..three });
        assert_eq!((of(&[7.0]), of(&[])), (Times::single(7.0), Times::single(0.0)));
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
        let load = LoadOptions { allow_outside: true, scene: Some(5), fps: Some(30.0), instances: Instancing::Flat };
        Subject {
            model: "a/model.obj".to_owned(),
            scene: Arc::new(scene),
            trees: Vec::new(),
            forms: Vec::new(),
            rays: None,
            load,
        }
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
            epo: Some(EndPointOverlap { value: 0.625, sampled: 5, triangles: 7, margin: Some(0.25), visited: 1013 }),
            hashes: [0x3fb, 0xfeed_0000_0000_03fd],
            populations: sample().populations,
            traced_bytes: 1039,
            wide: WideReading { collapse_ms: 991.0, node_bytes: 331, triangle_bytes: 337, bytes_per_triangle: 95.5 },
            tests: TestSummary {
                rays: 101,
                hits: 53,
                container_tests_per_ray: 11.25,
                primitive_tests_per_ray: 1.5,
                entering: 50,
                entering_tests: TestCounts { containers: 1_000, primitives: 237 },
                lines: CacheLines { nodes: 1021, triangles: 1031 },
                trace_time: Duration::from_millis(997),
            },
        }
    }

    fn expected_values() -> Values {
        let mut values = serde_json::json!({
            // Of 13, 34 and 22.
            "build_ms": 22.0,
            "build_ms_spread": [17.5, 28.0],
            // Of 13 + 79, 34 + 71 and 22 + 73.
            "ready_ms": 95.0,
            "build_stages_ms": {"tree": 17.0, "flatten": 3.0},
            // 7 triangles in 22 ms.
            "mtriangles_per_s": 7.0 / 22_000.0,
            "trace_ms": 41.0,
            "trace_ms_spread": [39.0, 42.0],
            "rays": 101,
            "hits": 53,
            // 101 rays in 41 ms.
            "binary_mrays_per_s": 101.0 / 41_000.0,
            "tests_per_ray": 12.75,
            "container_tests_per_ray": 11.25,
            "primitive_tests_per_ray": 1.5,
            // 1,237 tests of 50 rays.
            "tests_per_entering_ray": 24.74,
            "entering_rays": 50,
            // 64 times the sum of 1,021 and 1,031 lines over 50 rays.
            "bytes_per_entering_ray": 2626.56,
            "node_lines_per_entering_ray": 20.42,
            "triangle_lines_per_entering_ray": 20.62,
            "sah_cost": 67.5,
            "traversal_cost": TRAVERSAL_COST,
            "intersection_cost": INTERSECTION_COST,
            "epo": 0.625,
            "epo_triangles": 5,
            "nodes": 13,
            "leaves": 17,
            "max_depth": 5,
            "mean_leaf_depth": 2.75,
            "leaf_size": [2.0, 3.5, 61.0],
            "tree_hash": "00000000000003fb",
            "wide_tree_hash": "feed0000000003fd",
            "tree_bytes": 1009,
            "triangle_bytes": 252,
            "bytes_per_triangle": (1009.0 + 252.0) / 7.0,
            "collapse_ms": 73.0,
            "wide_trace_ms": 23.0,
            "mrays_per_s": 101.0 / 23_000.0,
            // In 26 and in 21 ms.
            "mrays_per_s_spread": [101.0 / 26_000.0, 101.0 / 21_000.0],
            "wide_node_bytes": 331,
            "wide_triangle_bytes": 337,
            "wide_bytes_per_triangle": 95.5,
            // Four bytes a node.
            "overlay_bytes": 52,
        });
        // One more field than the macro bears.
        values["epo_margin"] = 0.25.into();
        serde_json::from_value(values).unwrap()
    }

    #[test]
    fn every_column_follows_its_definition() {
        let subject = subject();
        let mut trial = Trial::default();
        for (stages, binary, collapse, wide) in [([11, 2], 43, 79, 29), ([31, 3], 37, 71, 19), ([17, 5], 41, 73, 23)] {
            trial.record(&build(stages), Some(&trace(binary)), Duration::from_millis(collapse), &trace(wide));
        }
        let build = BuildSettings {
            builder: BuilderKind::Aac,
            container: ContainerKind::Sphere,
            threshold: 47,
            epsilon: 0.375,
            curve: Curve::Hilbert,
            optimize: Passes::NONE.with(Pass::Collapse),
            ..BuildSettings::default()
        };
        let setup = Contender::from(Setup { build, preset: Some(Preset::Hq), threads: 83 });
        let view = TraceView { size: [103, 107], repeat: 109, ..view() };
        let found = trial.measurement("sweep", &subject, &setup, &view, &first());
        let expected = Measurement {
            command: "sweep".to_owned(),
            model: "a/model.obj".to_owned(),
            triangles: 7,
            builder: "aac".to_owned(),
            tree: None,
            label: None,
            preset: None,
            container: ContainerKind::Sphere,
            settings: Stated::of(&build),
            motion: None,
            form: None,
            traversal: "paper".to_owned(),
            threads: 3,
            width_px: 103,
            height_px: 107,
            repeat: 3,
            rounds: std::collections::BTreeMap::from([
                ("build_ms".to_owned(), vec![13.0, 34.0, 22.0]),
                ("ready_ms".to_owned(), vec![92.0, 105.0, 95.0]),
                ("trace_ms".to_owned(), vec![43.0, 37.0, 41.0]),
                ("wide_trace_ms".to_owned(), vec![29.0, 19.0, 23.0]),
            ]),
            verdicts: Vec::new(),
            values: expected_values(),
            predicted_scaling: None,
            conditions: Some(Conditions {
                view: Some(expected_camera()),
                simd: SimdLevel::best().name().to_owned(),
                version: crate::provenance::VERSION.to_owned(),
                command_line: format!(
                    "bvhscope bench a/model.obj --builder aac --container sphere --threshold 47 --epsilon 0.375 --curve hilbert \
                     --optimize collapse --threads 3 --simd {} --size 103x107 --traversal paper --repeat 109 --eye '0,0,1' \
                     --target '0,0,0' --up '0,1,0' --fov 57.296 --scene 5 --fps 30 --instances flat --allow-outside",
                    SimdLevel::best().name()
                ),
                // Of this machine and this minute.
                ..found.conditions.clone().unwrap()
            }),
            populations: sample().populations,
            warnings: vec![subject.scene.warnings.entries[0].to_string()],
        };
        assert_same(&found, &expected);
    }

    fn expected_camera() -> ViewConditions {
        let (camera, fov) = ("given".to_owned(), 57.296);
        ViewConditions { camera, eye: [0.0, 0.0, 1.0], target: [0.0; 3], up: [0.0, 1.0, 0.0], fov }
    }

    /// One ray, traced once as in the paper.
    fn view() -> TraceView {
        let camera =
            Camera { eye: Vec3::Z, target: Vec3::ZERO, up: Vec3::Y, fov_y: 1.0, projection: Projection::Perspective };
        TraceView {
            camera,
            place: Place::Given,
            size: [1, 1],
            traversal: Traversal::Paper,
            simd: SimdLevel::best(),
            repeat: 1,
            populations: Populations::NONE,
            epo_samples: None,
        }
    }

    #[test]
    fn a_time_of_zero_gives_no_infinite_rate() {
        let none = PrimaryTrace { rays: 0, hits: 0, trace_time: Duration::ZERO };
        let mut trial = Trial::default();
        trial.record(&StageTimes::default(), Some(&none), Duration::ZERO, &none);
        let setup = Contender::from(Setup { build: BuildSettings::default(), preset: None, threads: 1 });
        let row = trial.measurement("bench", &subject(), &setup, &view(), &first());
        assert_eq!([MRAYS_PER_S, BINARY_MRAYS_PER_S, MTRIANGLES_PER_S].map(|rate| row.number(rate)), [0.0; 3]);
    }
}
