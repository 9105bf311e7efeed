//! The rows of `animate`: the trees of a study as the measuring commands show them.

use super::study::{MotionPlan, MotionRow, MotionStudy};
use crate::catalog::numbers::rows::{BEHIND_MS, BUILD_MS, POPULATION_TESTS_PER_RAY, RAY_NS, UPDATE_MS};
use crate::catalog::reading::TreeReading;
use crate::catalog::settings::{Stated, preset_name};
use crate::catalog::values::Values;
use crate::lab::conditions::Conditions;
use crate::lab::measure::{LabError, RowSink, request_settings};
use crate::lab::measurement::{FrameOfClip, Measurement, millis, pool};
use crate::lab::population::{Population, Populations, ViewRays};
use crate::lab::setup::{Setup, Subject, TraceView};
use bvhscope_engine::BuildReport;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::follow::Policy;
use bvhscope_engine::stage_times::StageTimes;

/// Policies and frames of `animate`.
#[derive(Debug, Clone, PartialEq)]
pub struct AnimatePlan {
    /// The policies, compared frame by frame.
    pub policies: Vec<Policy>,
    /// Name or number of the clip; the first one if none is named.
    pub clip: Option<String>,
    /// Number of frames.
    pub frames: usize,
}

/// Measures the trees of `setup` under each policy of `plan`, frame by frame, one row each, passed once a frame is done.
pub fn animate(
    subject: &Subject,
    setup: &Setup,
    plan: &AnimatePlan,
    view: &TraceView,
    token: &CancelToken,
    rows: &mut dyn RowSink,
) -> Result<(), LabError> {
    let Some(motion) = &subject.scene.motion else {
        return Err(LabError::Refused(
            "the model has no clips of animation, so that it does not move: builtin:walker does".to_owned(),
        ));
    };
    let clip = motion.choose(plan.clip.as_deref()).map_err(LabError::Refused)?;
    let populations = if view.populations == Populations::NONE {
        Populations::NONE.with(Population::Primary)
    } else {
        view.populations
    };
    let settings = request_settings(view);
    let study = MotionPlan {
        policies: plan.policies.clone(),
        build: setup.build,
        clip,
        frames: plan.frames,
        rays: populations.iter().map(|of| ViewRays::new(of, view.camera, view.size, &settings)).collect(),
        simd: view.simd,
        repeat: view.repeat,
    };
    let pool = pool(setup.threads).map_err(LabError::Refused)?;
    let parts = plan.frames + 1;
    let mut study = pool.install(|| MotionStudy::new(&subject.scene, study, &token.part(0, parts)))?;
    let name = &motion.clips[clip].name;
    for frame in 0.. {
        let Some(measured) = pool.install(|| study.next_frame(&token.part(frame + 1, parts)))? else { break };
        for row in &measured {
            rows.row(measurement(row, name, subject, setup, view, pool.current_num_threads()));
        }
    }
    Ok(())
}

fn measurement(
    row: &MotionRow,
    clip: &str,
    subject: &Subject,
    setup: &Setup,
    view: &TraceView,
    threads: usize,
) -> Measurement {
    let update = &row.update;
    let report = BuildReport {
        stages: StageTimes::default(),
        build_time: update.tree_time,
        threads,
        stats: row.stats.clone(),
        tree_bytes: row.tree_bytes,
        triangle_bytes: size_of_val(&subject.scene.triangles[..]),
    };
    let mut values = Values::of(&TreeReading {
        triangles: subject.scene.triangles.len(),
        container: setup.build.container,
        report: &report,
        build: None,
        is_update: true,
        stages_ms: std::collections::BTreeMap::new(),
        ready_ms: Some(millis(update.ready_time())),
        epo: Some(row.epo),
        hashes: None,
        wide: None,
        trace: None,
        entering: None,
    });
    values.remove(BUILD_MS);
    let numbers = [
        (UPDATE_MS, Some(millis(update.tree_time))),
        (BEHIND_MS, (!update.behind_time.is_zero()).then(|| millis(update.behind_time))),
        (RAY_NS, (row.ray_ns > 0.0).then_some(row.ray_ns)),
        (POPULATION_TESTS_PER_RAY, row.tests_per_ray()),
    ];
    for (number, value) in numbers {
        if let Some(value) = value {
            values.set(number, value);
        }
    }
    values.set_spread(RAY_NS, row.ray_spread_ns);
    Measurement {
        command: "animate".to_owned(),
        model: subject.model.clone(),
        triangles: subject.scene.triangles.len(),
        builder: setup.build.builder.name().to_owned(),
        tree: None,
        preset: preset_name(&setup.build),
        container: setup.build.container,
        settings: Stated::of(&setup.build),
        motion: Some(FrameOfClip { policy: row.policy, clip: clip.to_owned(), frame: row.frame, time_s: row.seconds }),
        threads,
        values,
        predicted_scaling: None,
        traversal: view.traversal.name().to_owned(),
        width_px: view.size[0],
        height_px: view.size[1],
        repeat: view.repeat,
        conditions: Some(Conditions::of_process(Some((&view.camera, subject.scene.offset)), view.simd)),
        populations: row.rays.clone(),
        warnings: row.warnings.entries.iter().map(ToString::to_string).collect(),
    }
}
