//! The paper's figures 9 and 10: the threshold against build time, trace time and tests per ray.

use super::measure::{LabError, Setup, Subject, TraceView, measure};
use super::measurement::Measurement;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve, Passes};
use bvhscope_engine::tree::ContainerKind;

/// Which trees a sweep measures on each model.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepPlan {
    /// Thresholds.
    pub thresholds: Vec<u32>,
    /// Each ε.
    pub epsilons: Vec<f32>,
    /// Boxes, spheres or both, measured in turn.
    pub containers: Vec<ContainerKind>,
    /// Threads; 0 for all.
    pub threads: usize,
    /// The `.0`-th, counted from 1, of `.1` shares.
    pub shard: (usize, usize),
}

/// One point of a sweep; its containers are measured together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweepPoint {
    /// Which model, by its place in the list.
    pub model: usize,
    /// ε.
    pub epsilon: f32,
    /// δ.
    pub threshold: u32,
}

impl SweepPlan {
    /// The points of this plan's share over `models` models. The shares of one sweep have no point in common and together
    /// are the whole, whatever their number.
    pub fn points(&self, models: usize) -> Vec<SweepPoint> {
        let (index, count) = self.shard;
        (0..models)
            .flat_map(|model| self.epsilons.iter().map(move |&epsilon| (model, epsilon)))
            .flat_map(|(model, epsilon)| {
                self.thresholds.iter().map(move |&threshold| SweepPoint { model, epsilon, threshold })
            })
            .enumerate()
            .filter(|(position, _)| position % count.max(1) == index.saturating_sub(1))
            .map(|(_, point)| point)
            .collect()
    }
}

/// Measures one point: a row a container.
pub fn sweep(
    subject: &Subject,
    plan: &SweepPlan,
    point: SweepPoint,
    view: &TraceView,
    token: &CancelToken,
    row: &mut dyn FnMut(Measurement),
) -> Result<(), LabError> {
    let setups: Vec<Setup> = plan
        .containers
        .iter()
        .map(|&container| Setup {
            build: BuildSettings {
                builder: BuilderKind::Aac,
                container,
                threshold: point.threshold,
                epsilon: point.epsilon,
                curve: Curve::Morton,
                optimize: Passes::NONE,
            },
            preset: None,
            threads: plan.threads,
        })
        .collect();
    measure("sweep", subject, &setups, view, token, row)
}
