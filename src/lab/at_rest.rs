//! Readings of trees that no window, dock, shading or size moves: whole builds and traces of a fixed view, repeated in turn, and the tests of
//! its rays.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use super::measure::turns;
use super::measurement::millis;
use crate::accel::{Accel, RestReadings, WholeBuilds};
use crate::camera::Camera;
use crate::catalog::reading::Times;
use crate::render::{RenderRequest, RenderSettings, count_tests, trace_primary_wide};
use crate::scene::Scene;
use crate::view::NamedView;
use bvhscope_engine::builders::BuildError;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::stage_times::StageTimes;

/// Width and height of the measuring view in pixels, those of `bench` by default.
pub const MEASURING_PX: [u32; 2] = [1024; 2];
/// Those of the view of an estimate: so few rays that they are counted while the user still drags.
const ESTIMATING_PX: [u32; 2] = [128; 2];
/// Rounds at least, of which eight decide, and their time at least.
const LEAST: (usize, Duration) = (9, Duration::from_millis(200));
/// No round is begun after this time.
const MOST: Duration = Duration::from_secs(6);
/// A build that takes longer is not repeated.
const LONGEST_BUILD: Duration = Duration::from_secs(2);

/// The camera of the measuring view, the default one, as `bench` has it.
pub fn measuring_camera(scene: &Scene) -> Camera {
    NamedView::Default.camera(scene, scene.up)
}

/// Takes the readings of `trees` of one scene, one or two, in the calling thread's rayon pool: the tests of the measuring view, and in turn,
/// round by round, whole builds and traces of its rays. They are kept in the trees; readings of one session are not taken again.
pub fn measure_at_rest(trees: &[&Arc<Accel>], token: &CancelToken) -> Result<(), Cancelled> {
    let parts = trees.len() + 1;
    for (tree, part) in trees.iter().zip(0..) {
        if tree.entering().is_none() {
            tree.keep_entering(count_tests(&measuring_view(tree), &token.part(part, parts))?.of_entering_ray());
        }
    }
    let sessions: Vec<Option<u64>> = trees.iter().map(|tree| tree.at_rest().map(|readings| readings.session)).collect();
    if sessions.iter().any(|session| session.is_none() || *session != sessions[0]) {
        measure_rounds(trees, &token.part(trees.len(), parts))?;
    }
    Ok(())
}

/// Estimates the tests of a ray in the measuring view, in the calling thread's rayon pool. They are kept in the tree.
pub fn estimate_tests(tree: &Arc<Accel>, token: &CancelToken) -> Result<(), Cancelled> {
    if !tree.is_estimated() {
        tree.keep_estimate(count_tests(&view_of_size(tree, ESTIMATING_PX), token)?.of_entering_ray());
    }
    Ok(())
}

/// The picture of the measuring view.
fn measuring_view(accel: &Arc<Accel>) -> RenderRequest {
    view_of_size(accel, MEASURING_PX)
}

fn view_of_size(accel: &Arc<Accel>, size_px: [u32; 2]) -> RenderRequest {
    RenderRequest::new(accel, measuring_camera(&accel.scene), RenderSettings::default(), size_px)
}

/// The rounds of a tree so far.
#[derive(Default)]
struct Rounds {
    builds: Vec<StageTimes>,
    rays: u64,
    traces_ms: Vec<f64>,
    /// Its build is not repeated.
    is_built_once: bool,
}

/// Measures rounds until there are nine and 0.2 s of them, or as many as begin within 6 s.
fn measure_rounds(trees: &[&Arc<Accel>], token: &CancelToken) -> Result<(), Cancelled> {
    static SESSIONS: AtomicU64 = AtomicU64::new(1);
    let mut measured: Vec<Rounds> = trees.iter().map(|tree| Rounds::new(tree)).collect();
    let start = Instant::now();
    let mut round = 0;
    while round == 0 || ((round < LEAST.0 || start.elapsed() < LEAST.1) && start.elapsed() < MOST) {
        for tree in turns(round, trees.len()) {
            measured[tree].measure(trees[tree], token)?;
        }
        round += 1;
    }
    let session = SESSIONS.fetch_add(1, Ordering::Relaxed);
    for (tree, rounds) in trees.iter().zip(measured) {
        tree.keep_at_rest(rounds.readings(session));
    }
    Ok(())
}

impl Rounds {
    /// The build of a tree from a file, of one that follows a model, and a long one, are not repeated.
    fn new(tree: &Accel) -> Self {
        let is_built_once = tree.file.is_some() || tree.is_followed() || tree.report.build_time > LONGEST_BUILD;
        Self { is_built_once, ..Self::default() }
    }

    /// Builds the tree again, where that is possible, and traces the measuring view.
    fn measure(&mut self, tree: &Arc<Accel>, token: &CancelToken) -> Result<(), Cancelled> {
        if !self.is_built_once {
            match Accel::build_binary(&tree.scene, &tree.settings, token) {
                Ok(again) => self.builds.push(again.report.stages.clone()),
                Err(BuildError::Cancelled(cancelled)) => return Err(cancelled),
                // Memory for a second tree is missing.
                Err(BuildError::Refused(_)) => self.is_built_once = true,
            }
        }
        let trace = trace_primary_wide(&measuring_view(tree), token)?;
        self.rays = trace.rays;
        self.traces_ms.push(millis(trace.trace_time));
        Ok(())
    }

    fn readings(self, session: u64) -> RestReadings {
        let Self { builds, rays, traces_ms, is_built_once } = self;
        let builds = (!is_built_once).then(|| whole_builds(builds));
        RestReadings { session, builds, rays, traces: Times::of(traces_ms.clone()), trace_rounds: traces_ms }
    }
}

fn whole_builds(mut builds: Vec<StageTimes>) -> WholeBuilds {
    let rounds: Vec<f64> = builds.iter().map(|stages| millis(stages.total())).collect();
    builds.sort_by_key(StageTimes::total);
    // Stages of one build add up to its time, medians of each stage do not. Of an even number the slower of the two in the middle.
    let stages = builds.swap_remove(builds.len() / 2).stages;
    WholeBuilds { times: Times::of(rounds.clone()), rounds, stages }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::lab::population::{Population, ViewRays};
    use crate::lab::sample::teapot;
    use bvhscope_engine::settings::BuildSettings;
    use bvhscope_engine::tree::ContainerKind;

    #[test]
    fn builds_are_repeated_and_rays_that_miss_the_scenes_box_do_not_count() {
        let scene = teapot();
        for container in ContainerKind::ALL {
            let build = BuildSettings { container, ..BuildSettings::default() };
            let token = CancelToken::new();
            let accel = Arc::new(Accel::build(&scene, &build, &token).unwrap());
            assert!(accel.whole_builds().is_none() && accel.entering().is_none());
            measure_at_rest(&[&accel], &token).unwrap();
            let WholeBuilds { times, rounds, stages } = accel.whole_builds().unwrap();
            let most = rounds.iter().copied().fold(0.0, f64::max);
            let [least, upper] = times.spread.unwrap();
            assert!(least <= times.ms && times.ms <= upper && rounds.len() == times.count);
            let whole = millis(stages.iter().map(|stage| stage.1).sum());
            assert!(
                times.ms - 1e-6 <= whole && whole <= most + 1e-6,
                "{whole} in {least} to {most}, not of the first build"
            );
            // The visits of the same view by another count.
            let settings = RenderSettings::default();
            let rays = ViewRays::new(Population::Primary, measuring_camera(&scene), [256; 2], &settings);
            let measured = rays.measure(&accel, &token).unwrap().sums;
            let request = RenderRequest::new(&accel, measuring_camera(&scene), settings, [256; 2]);
            let counted = count_tests(&request, &token).unwrap();
            let entering = measured.entering_rays.unwrap();
            assert_eq!((counted.rays, counted.entering), (measured.rays.into(), entering.into()));
            let by_tests = counted.of_entering_ray().map(|counts| f64::from(counts.tests));
            let by_visits = measured.tests_per_entering_ray;
            assert!((by_visits.unwrap() / by_tests.unwrap() - 1.0).abs() < 1e-6, "{by_visits:?} {by_tests:?}");
            estimate_tests(&accel, &token).unwrap();
            let [exact, estimate] = [accel.entering(), accel.entering_estimate()].map(|counts| counts.unwrap().tests);
            assert!((estimate / exact - 1.0).abs() < 0.05, "{container:?}: {estimate} for {exact}");
            let per_ray = counted.container_tests_per_ray + counted.primitive_tests_per_ray;
            assert!(accel.entering().unwrap().tests > per_ray);
        }
    }

    #[test]
    fn a_cancelled_measurement_keeps_nothing() {
        let token = CancelToken::new();
        let accel = Arc::new(Accel::build(&teapot(), &BuildSettings::default(), &token).unwrap());
        token.cancel();
        assert!(measure_at_rest(&[&accel], &token).is_err());
        assert!(accel.whole_builds().is_none() && accel.entering().is_none());
    }

    #[test]
    fn two_trees_are_measured_in_turn_and_one_session_once() {
        let (scene, token) = (teapot(), CancelToken::new());
        let [a, b] = [ContainerKind::Aabb, ContainerKind::Sphere].map(|container| {
            let build = BuildSettings { container, ..BuildSettings::default() };
            Arc::new(Accel::build(&scene, &build, &token).unwrap())
        });
        measure_at_rest(&[&a], &token).unwrap();
        let alone = a.at_rest().unwrap();
        measure_at_rest(&[&a, &b], &token).unwrap();
        let both = [&a, &b].map(|tree| tree.at_rest().unwrap());
        assert_ne!(alone.session, both[0].session, "its rounds were not those of the other tree");
        assert_eq!(both[0].session, both[1].session);
        assert_eq!(both[0].trace_rounds.len(), both[1].trace_rounds.len());
        assert!(both.iter().all(|readings| readings.rays == 1024 * 1024 && readings.traces.ms > 0.0));
        measure_at_rest(&[&a, &b], &token).unwrap();
        measure_at_rest(&[&a], &token).unwrap();
        assert!(Arc::ptr_eq(&a.at_rest().unwrap(), &both[0]));
    }
}
