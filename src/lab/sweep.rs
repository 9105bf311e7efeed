//! The measurements of the paper's figures 9 and 10: build time, trace time and tests per ray against the threshold.

use super::measure::{LabError, RowSink, measure, measure_contenders};
use super::setup::{Setup, Subject, TraceView};
use crate::catalog::settings::Setting;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::BuildSettings;
use bvhscope_engine::tree::ContainerKind;

/// The parameter ranges of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepPlan {
    /// The numbers that vary, each with its values. The last varies fastest; all other settings have their defaults.
    pub ranges: Vec<(&'static Setting, Vec<f32>)>,
    /// Boxes, spheres or both, measured interleaved.
    pub containers: Vec<ContainerKind>,
    /// Threads; 0 for all.
    pub threads: usize,
    /// Index, from 1, and number of shards; the plan covers the points of one shard.
    pub shard: (usize, usize),
}

/// One combination of parameters on one model; its containers are measured together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweepPoint {
    /// Index of the model.
    pub model: usize,
    /// The settings, but for the container.
    pub build: BuildSettings,
}

impl SweepPlan {
    /// The points of the plan's shard over `models` models. The shards of a sweep partition its points.
    pub fn points(&self, models: usize) -> Vec<SweepPoint> {
        let (index, count) = self.shard;
        let all = self.ranges.iter().fold(vec![BuildSettings::default()], |all, (setting, values)| {
            let with = |build: BuildSettings| values.iter().map(move |&value| setting.with_number(build, value));
            all.into_iter().flat_map(with).collect()
        });
        (0..models)
            .flat_map(|model| all.iter().map(move |&build| SweepPoint { model, build }))
            .enumerate()
            .filter(|(position, _)| position % count.max(1) == index.saturating_sub(1))
            .map(|(_, point)| point)
            .collect()
    }
}

/// Measures the subject's trees from files, which no setting changes, one row each.
pub fn sweep_files(
    subject: &Subject,
    plan: &SweepPlan,
    view: &TraceView,
    token: &CancelToken,
    rows: &mut dyn RowSink,
) -> Result<(), LabError> {
    measure_contenders("sweep", subject, &subject.contenders(&[], plan.threads), view, token, rows)
}

/// Measures one point, one row per container.
pub fn sweep(
    subject: &Subject,
    plan: &SweepPlan,
    point: SweepPoint,
    view: &TraceView,
    token: &CancelToken,
    rows: &mut dyn RowSink,
) -> Result<(), LabError> {
    let setups: Vec<Setup> = plan
        .containers
        .iter()
        .map(|&container| Setup { build: point.build.for_container(container), preset: None, threads: plan.threads })
        .collect();
    measure("sweep", subject, &setups, view, token, rows)
}
