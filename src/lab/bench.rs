//! The measurements of the paper's tables 1 and 2: boxes and spheres compared on one scene.

use std::sync::Arc;

use rayon::prelude::*;

use super::conditions::Conditions;
use super::measure::{LabError, RowSink, measure, measure_contenders};
use super::measurement::{Measurement, millis, pool};
use super::population::Populations;
use super::setup::{Setup, Subject, TraceView};
use crate::accel::Accel;
use crate::catalog::numbers::millions_per_second;
use crate::catalog::numbers::rows::{
    BINARY_MRAYS_PER_S, CONTAINER_TESTS_PER_RAY, ENTERING_RAYS, HITS, MRAYS_PER_S, PRIMITIVE_TESTS_PER_RAY, RAYS,
    TESTS_PER_ENTERING_RAY, TESTS_PER_RAY, TRACE_MS, WIDE_TRACE_MS,
};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::settings::{BuildSettings, BuilderKind};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::traverse::{TestCounts, Traversal};

/// Maximum number of primitive tests of a run without BVH: about a second on one core.
const NO_BVH_TESTS: u64 = 200_000_000;

/// Measures those of `setups` that the subject can have and its trees from files, one row each; with `no_bvh` one more row that tests every triangle, on
/// an even sample of the pixels whose number is its `rays`.
pub fn bench(
    subject: &Subject,
    setups: &[Setup],
    view: &TraceView,
    no_bvh: bool,
    token: &CancelToken,
    rows: &mut dyn RowSink,
) -> Result<(), LabError> {
    let parts = if no_bvh { 2 } else { 1 };
    let threads = setups.first().map_or(0, |setup| setup.threads);
    let contenders = subject.contenders(&subject.possible(setups), threads);
    measure_contenders("bench", subject, &contenders, view, &token.part(0, parts), rows)?;
    if no_bvh {
        rows.row(every_triangle(subject, view, threads, &token.part(1, parts))?);
    }
    Ok(())
}

/// Tests every triangle with as many evenly spaced rays as [`NO_BVH_TESTS`] allows.
fn every_triangle(
    subject: &Subject,
    view: &TraceView,
    threads: usize,
    token: &CancelToken,
) -> Result<Measurement, LabError> {
    let triangles = subject.scene.triangle_count();
    let pixels = u64::from(view.size[0]) * u64::from(view.size[1]);
    let rays = (NO_BVH_TESTS / triangles.max(1)).clamp(1, pixels);
    let build = BuildSettings {
        builder: BuilderKind::None,
        ..BuildSettings::preset(bvhscope_engine::settings::Preset::Fast, ContainerKind::Aabb)
    };
    // All fields that do not depend on the rays come from measuring a picture of one pixel.
    let view = &TraceView { repeat: 1, populations: Populations::NONE, ..*view };
    let single = TraceView { size: [1, 1], ..*view };
    let setup = Setup { build, preset: None, threads };
    let mut rows = Vec::new();
    measure("bench", subject, &[setup], &single, token, &mut |row: Measurement| rows.push(row))?;
    let Some(mut row) = rows.pop() else { return Err(Cancelled.into()) };
    row.conditions = Some(Conditions::new(subject, &setup.into(), view, row.threads));
    let pool = pool(threads).map_err(LabError::Refused)?;
    let accel = Arc::new(pool.install(|| Accel::build(&subject.scene, &build, token))?);
    let camera = view.camera.for_size(view.size[0], view.size[1]);
    let start = std::time::Instant::now();
    let (hits, tests) = pool.install(|| {
        (0..rays)
            .into_par_iter()
            .map(|index| {
                token.check()?;
                let pixel = index * pixels / rays;
                let (x, y) = (pixel % u64::from(view.size[0]), pixel / u64::from(view.size[0]));
                let ray = camera.ray(x as f32 + 0.5, y as f32 + 0.5);
                let mut counts = TestCounts::default();
                let hit = accel.closest_hit_with(&ray, Traversal::Ordered, &mut counts);
                Ok::<_, Cancelled>((u64::from(hit.is_some()), counts))
            })
            .try_reduce(
                || (0, TestCounts::default()),
                |(hits, counts), (more_hits, more)| Ok((hits + more_hits, counts + more)),
            )
    })?;
    Ok(on_a_sample(row, view.size, rays, hits, tests, millis(start.elapsed())))
}

/// `row` with the columns of a run that tested every triangle with `rays` rays in `trace_ms` milliseconds.
fn on_a_sample(
    row: Measurement,
    [width_px, height_px]: [u32; 2],
    rays: u64,
    hits: u64,
    tests: TestCounts,
    trace_ms: f64,
) -> Measurement {
    let per_ray = |count: u64| count as f64 / rays as f64;
    let mut row = Measurement { width_px, height_px, ..row };
    let values = &mut row.values;
    values.set(TRACE_MS, trace_ms);
    values.set_spread(TRACE_MS, None);
    values.remove(WIDE_TRACE_MS);
    values.remove(MRAYS_PER_S);
    values.set_spread(MRAYS_PER_S, None);
    values.set(RAYS, rays);
    values.set(HITS, hits);
    values.set(BINARY_MRAYS_PER_S, millions_per_second(rays, trace_ms));
    values.set(CONTAINER_TESTS_PER_RAY, per_ray(tests.containers));
    values.set(PRIMITIVE_TESTS_PER_RAY, per_ray(tests.primitives));
    values.set(TESTS_PER_RAY, per_ray(tests.total()));
    // Every ray tests every triangle, whether it enters the scene's box or not.
    values.set(TESTS_PER_ENTERING_RAY, per_ray(tests.total()));
    values.remove(ENTERING_RAYS);
    row
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::sample::sample;

    #[test]
    fn columns_of_a_run_without_tree_follow_their_definitions() {
        let row = sample();
        let tests = TestCounts { containers: 19, primitives: 1300 };
        let found = on_a_sample(row.clone(), [23, 29], 130, 31, tests, 5.0);
        let mut expected = Measurement { width_px: 23, height_px: 29, ..row }
            .with(TRACE_MS, 5.0)
            .with(RAYS, 130)
            .with(HITS, 31)
            // 130 rays in 5 ms are 26,000 a second.
            .with(BINARY_MRAYS_PER_S, 0.026)
            .with(CONTAINER_TESTS_PER_RAY, 19.0 / 130.0)
            .with(PRIMITIVE_TESTS_PER_RAY, 10.0)
            .with(TESTS_PER_RAY, 1319.0 / 130.0)
            .with(TESTS_PER_ENTERING_RAY, 1319.0 / 130.0);
        expected.values.set_spread(TRACE_MS, None);
        expected.values.remove(WIDE_TRACE_MS);
        expected.values.remove(ENTERING_RAYS);
        expected.values.remove(MRAYS_PER_S);
        expected.values.set_spread(MRAYS_PER_S, None);
        crate::lab::sample::assert_same(&found, &expected);
    }
}
