//! The rows of `animate`: the trees of a study as the measuring commands show them.

use super::break_even::{FrameCost, break_even, factor, least, pays_from};
use super::study::{MotionPlan, MotionRow, MotionStudy};
use crate::catalog::numbers::rows::{
    BEHIND_MS, BUILD_MS, POPULATION_TESTS_PER_RAY, PREPARATION_MS, RAY_NS, READY_MS, UPDATE_MS,
};
use crate::catalog::reading::{Times, TreeReading};
use crate::catalog::settings::{Stated, preset_name};
use crate::catalog::values::Values;
use crate::lab::conditions::{Conditions, ViewConditions};
use crate::lab::measure::{LabError, RowSink, request_settings};
use crate::lab::measurement::{FrameOfClip, Measurement, millis, pool};
use crate::lab::population::{Population, Populations};
use crate::lab::setup::{Setup, Subject, TraceView};
use crate::lab::verdict::RowVerdict;
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
        rays: populations.iter().map(|of| subject.rays_of(of, view, &settings)).collect(),
        simd: view.simd,
        repeat: view.repeat,
        epo_samples: view.epo_samples,
    };
    let pool = pool(setup.threads).map_err(LabError::Refused)?;
    let parts = plan.frames + 1;
    let mut study = pool.install(|| MotionStudy::new(&subject.scene, study, &token.part(0, parts)))?;
    let name = &motion.clips[clip].name;
    let mut costs: Vec<Vec<FrameCost>> = Vec::new();
    for frame in 0.. {
        let Some(measured) = pool.install(|| study.next_frame(&token.part(frame + 1, parts)))? else { break };
        costs.resize(measured.len(), Vec::new());
        for (row, costs) in measured.iter().zip(&mut costs) {
            costs.push(row.cost());
        }
        for (index, row) in measured.iter().enumerate() {
            let mut row = measurement(row, name, subject, setup, view, pool.current_num_threads());
            if frame + 1 == plan.frames {
                row.verdicts = verdicts(&plan.policies, &costs, index, view);
            }
            rows.row(row);
        }
    }
    Ok(())
}

/// How the policy of an index compares over all frames, with a ray for each pixel: with that of the least time, and with rebuilding.
fn verdicts(policies: &[Policy], costs: &[Vec<FrameCost>], index: usize, view: &TraceView) -> Vec<RowVerdict> {
    let rays = view.size.map(f64::from).iter().product();
    let against = |other: usize| {
        let factor = factor(&costs[other], &costs[index], rays)?;
        Some(RowVerdict::of_factor("frame_ms", policies[other].name().to_owned(), &factor))
    };
    let best = least(costs, rays).map(|least| least.policy).filter(|&best| best != index);
    let rebuilt = policies.iter().position(|policy| *policy == Policy::Rebuild).filter(|&rebuilt| rebuilt != index);
    let with_break_even = |rebuilt: usize| {
        let verdict = against(rebuilt)?;
        let even = break_even(&costs[index], &costs[rebuilt])?;
        let pays_from = pays_from(&costs[index], &costs[rebuilt], rays);
        Some(RowVerdict {
            pays_from,
            break_even_rays: Some(even.rays).filter(|rays| rays.is_finite()),
            break_even_interval: even.interval.map(|ends| ends.map(|end| Some(end).filter(|end| end.is_finite()))),
            ..verdict
        })
    };
    let best = best.filter(|best| Some(*best) != rebuilt).and_then(against);
    best.into_iter().chain(rebuilt.and_then(with_break_even)).collect()
}

#[expect(clippy::too_many_lines, reason = "a list of fields")]
fn measurement(
    row: &MotionRow,
    clip: &str,
    subject: &Subject,
    setup: &Setup,
    view: &TraceView,
    threads: usize,
) -> Measurement {
    let [update, ray] = [&row.rounds.update_ms, &row.rounds.ray_ns].map(|rounds| Times::of(rounds.clone()));
    let report = BuildReport {
        stages: StageTimes::default(),
        build_time: row.update.tree_time,
        threads,
        stats: row.stats.clone(),
        tree_bytes: row.tree_bytes,
        triangle_bytes: size_of_val(&subject.scene.triangles[..]),
    };
    let mut values = Values::of(&TreeReading {
        triangles: subject.scene.triangles.len(),
        primitives: subject.scene.primitive_names(),
        container: setup.build.container,
        report: &report,
        build: None,
        is_update: true,
        stages_ms: std::collections::BTreeMap::new(),
        ready_ms: Some(row.ready_ms()),
        epo: row.epo,
        hashes: None,
        wide: None,
        trace: None,
        entering: None,
        at_rest: None,
    });
    values.remove(BUILD_MS);
    let numbers = [
        (UPDATE_MS, Some(update.ms)),
        (PREPARATION_MS, Some(millis(row.preparation))),
        (BEHIND_MS, (!row.update.behind_time.is_zero()).then(|| millis(row.update.behind_time))),
        (RAY_NS, (!row.rounds.ray_ns.is_empty()).then_some(ray.ms)),
        (POPULATION_TESTS_PER_RAY, row.tests_per_ray()),
    ];
    for (number, value) in numbers {
        if let Some(value) = value {
            values.set(number, value);
        }
    }
    values.set_spread(RAY_NS, ray.spread);
    let rounds = [(UPDATE_MS, &row.rounds.update_ms), (READY_MS, &row.rounds.ready_ms), (RAY_NS, &row.rounds.ray_ns)];
    let rounds = rounds.into_iter().filter(|(_, rounds)| !rounds.is_empty());
    Measurement {
        command: "animate".to_owned(),
        model: subject.model.clone(),
        triangles: subject.scene.triangle_count() as usize,
        builder: setup.build.builder.name().to_owned(),
        tree: None,
        label: None,
        preset: preset_name(&setup.build),
        container: setup.build.container,
        settings: Stated::of(&setup.build),
        motion: Some(FrameOfClip { policy: row.policy, clip: clip.to_owned(), frame: row.frame, time_s: row.seconds }),
        form: None,
        threads,
        values,
        predicted_scaling: None,
        traversal: view.traversal.name().to_owned(),
        width_px: view.size[0],
        height_px: view.size[1],
        repeat: view.repeat,
        rounds: rounds.map(|(number, rounds)| (number.key.to_owned(), rounds.clone())).collect(),
        verdicts: Vec::new(),
        conditions: Some(Conditions::of_process(Some(ViewConditions::of(view, subject)), view.simd)),
        populations: row.rays.clone(),
        warnings: row.warnings.entries.iter().map(ToString::to_string).collect(),
    }
}
