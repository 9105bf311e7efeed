//! Readings of a tree that no window, dock or size moves: whole builds, repeated, and tests of the rays of a fixed view.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::measurement::millis;
use crate::accel::{Accel, WholeBuilds};
use crate::camera::Camera;
use crate::catalog::reading::Times;
use crate::render::{RenderRequest, RenderSettings, count_tests};
use crate::scene::Scene;
use bvhscope_engine::builders::BuildError;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// Width and height of the measuring view in pixels, those of `bench` by default.
pub const MEASURING_PX: [u32; 2] = [1024; 2];
/// Builds are repeated at least so often, and for so long.
const LEAST: (usize, Duration) = (5, Duration::from_millis(200));
/// No build is begun after this time.
const MOST: Duration = Duration::from_secs(2);

/// The camera of the measuring view, that of `bench` by default: it frames the model.
pub fn measuring_camera(scene: &Scene) -> Camera {
    Camera::framing(&scene.subject, scene.up)
}

/// Counts the tests of the measuring view and repeats the build of `accel` in the calling thread's rayon pool. Both are kept in it;
/// what it has already is not measured again.
pub fn measure_at_rest(accel: &Arc<Accel>, token: &CancelToken) -> Result<(), Cancelled> {
    if accel.entering().is_none() {
        let camera = measuring_camera(&accel.scene);
        let request = RenderRequest::new(accel, camera, RenderSettings::default(), MEASURING_PX);
        accel.keep_entering(count_tests(&request, &token.part(0, 2))?.of_entering_ray());
    }
    if accel.whole_builds().is_none()
        && let Some(builds) = repeat_build(accel, &token.part(1, 2))?
    {
        accel.keep_whole_builds(builds);
    }
    Ok(())
}

/// At least 5 whole builds and 0.2 s of them, or as many as begin within 2 s. `None` of a tree from a file or of one that follows a
/// model, where memory for a second tree is missing, and where a build takes longer than that.
fn repeat_build(accel: &Arc<Accel>, token: &CancelToken) -> Result<Option<WholeBuilds>, Cancelled> {
    if accel.file.is_some() || accel.is_followed() || accel.report.build_time > MOST {
        return Ok(None);
    }
    let (start, mut builds) = (Instant::now(), Vec::new());
    while (builds.len() < LEAST.0 || start.elapsed() < LEAST.1) && start.elapsed() < MOST {
        match Accel::build_binary(&accel.scene, &accel.settings, token) {
            Ok(again) => builds.push((again.report.build_time, again.report.stages.stages.clone())),
            Err(BuildError::Cancelled(cancelled)) => return Err(cancelled),
            Err(BuildError::Refused(_)) => break,
        }
    }
    if builds.len() < 2 {
        return Ok(None);
    }
    let times = Times::of(builds.iter().map(|build| millis(build.0)).collect());
    builds.sort_by_key(|build| build.0);
    // Stages of one build add up to its time, medians of each stage do not. Of an even number the slower of the two in the middle.
    let (_, stages) = builds.swap_remove(builds.len() / 2);
    Ok(Some(WholeBuilds { times, stages }))
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
            measure_at_rest(&accel, &token).unwrap();
            let WholeBuilds { times, stages } = accel.whole_builds().unwrap();
            let [least, most] = times.spread.unwrap();
            assert!(least <= times.ms && times.ms <= most);
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
            let per_ray = counted.container_tests_per_ray + counted.primitive_tests_per_ray;
            assert!(accel.entering().unwrap().tests > per_ray);
        }
    }

    #[test]
    fn a_cancelled_measurement_keeps_nothing() {
        let token = CancelToken::new();
        let accel = Arc::new(Accel::build(&teapot(), &BuildSettings::default(), &token).unwrap());
        token.cancel();
        assert!(measure_at_rest(&accel, &token).is_err());
        assert!(accel.whole_builds().is_none() && accel.entering().is_none());
    }
}
