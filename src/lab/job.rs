//! The measuring jobs as one type, shared by the command line and the window.

use super::bench::bench;
use super::compare::{compare, compared_setups};
use super::measure::{LabError, RowSink};
use super::motion::{AnimatePlan, animate};
use super::scaling::scaling;
use super::setup::{Setup, Subject, TraceView};
use super::sweep::{SweepPlan, sweep, sweep_files};
use crate::accel::Accel;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::Passes;
use bvhscope_engine::tree::ContainerKind;

/// A measuring job.
#[derive(Debug, Clone, PartialEq)]
pub enum Job {
    /// The paper's tables 1 and 2.
    Bench {
        /// The trees to measure.
        setups: Vec<Setup>,
        /// Also test every triangle, without a tree.
        no_bvh: bool,
    },
    /// The paper's figures 9 and 10: a range of thresholds.
    Sweep(SweepPlan),
    /// The paper's figure 11: each tree with 1 to `max_threads` threads.
    Scaling {
        /// The trees to measure.
        setups: Vec<Setup>,
        /// Maximum number of threads.
        max_threads: usize,
        /// Also predict the speed-up on more cores.
        predict: bool,
    },
    /// Trees that follow a model that moves.
    Animate {
        /// The trees to measure.
        setups: Vec<Setup>,
        /// Policies and frames.
        plan: AnimatePlan,
    },
    /// Every builder.
    Compare {
        /// Boxes, spheres or both.
        containers: Vec<ContainerKind>,
        /// With the presets that take minutes.
        slow: bool,
        /// Threads; 0 for all.
        threads: usize,
    },
}

impl Job {
    /// True if trees of oriented boxes are measured, so that those of files get them, too.
    pub fn orients(&self) -> bool {
        let makes_them = |setup: &Setup| setup.build.tree_container() == ContainerKind::Oriented;
        match self {
            Self::Bench { setups, .. } => setups.iter().any(makes_them),
            Self::Sweep(plan) => plan.containers.contains(&ContainerKind::Oriented),
            Self::Compare { containers, .. } => containers.contains(&ContainerKind::Oriented),
            Self::Scaling { .. } | Self::Animate { .. } => false,
        }
    }

    /// The name of the command, which the rows carry.
    pub const fn command(&self) -> &'static str {
        match self {
            Self::Bench { .. } => "bench",
            Self::Sweep(_) => "sweep",
            Self::Scaling { .. } => "scaling",
            Self::Compare { .. } => "compare",
            Self::Animate { .. } => "animate",
        }
    }

    /// The reason why the settings are invalid for any scene, if they are.
    pub fn refusal(&self) -> Option<String> {
        match self {
            Self::Scaling { setups, predict: true, .. }
                if setups.iter().any(|setup| setup.build.passes() != Passes::NONE) =>
            {
                Some(
                    "--predict: passes over the finished tree do not log their tasks: choose a tree without".to_owned(),
                )
            }
            Self::Bench { setups, .. } | Self::Scaling { setups, .. } => {
                setups.iter().find_map(|setup| setup.build.refusal(0))
            }
            Self::Animate { setups, plan } => {
                let policies = || plan.policies.iter();
                let refusal = |setup: &Setup| policies().find_map(|policy| policy.refusal(&setup.build, 0));
                setups.iter().find_map(|setup| setup.build.refusal(0).or_else(|| refusal(setup)))
            }
            Self::Sweep(_) | Self::Compare { .. } => None,
        }
    }

    /// Why trees are left out that the subject's scene cannot have, if any are.
    pub fn left_out(&self, subject: &Subject) -> Option<String> {
        let setups = match self {
            Self::Bench { setups, .. } => setups.clone(),
            Self::Compare { containers, slow, threads } => {
                compared_setups(containers, subject.scene.triangles.len(), *slow, *threads)
            }
            _ => return None,
        };
        let mut refused = setups.iter().filter_map(|setup| Accel::refusal(&subject.scene, &setup.build));
        refused.next_back().filter(|_| subject.possible(&setups).len() < setups.len())
    }

    /// Whether anything is to be measured on the `model`-th of `models` models; a shard of a sweep may not cover it.
    pub fn concerns(&self, model: usize, models: usize) -> bool {
        match self {
            Self::Sweep(plan) => plan.points(models).iter().any(|point| point.model == model),
            _ => true,
        }
    }

    /// Measures the `model`-th of `models` models and passes each row to `rows` once all trees measured together with it are
    /// done. When cancelled, rows of the completed repetitions are still passed. Progress refers to this model.
    pub fn run(
        &self,
        subject: &Subject,
        (model, models): (usize, usize),
        view: &TraceView,
        token: &CancelToken,
        rows: &mut dyn RowSink,
    ) -> Result<(), LabError> {
        match self {
            Self::Bench { setups, no_bvh } => bench(subject, setups, view, *no_bvh, token, rows),
            Self::Compare { containers, slow, threads } => {
                compare(subject, containers, *slow, *threads, view, token, rows)
            }
            Self::Animate { setups, plan } => {
                for (index, setup) in setups.iter().enumerate() {
                    animate(subject, setup, plan, view, &token.part(index, setups.len()), rows)?;
                }
                Ok(())
            }
            Self::Scaling { setups, max_threads, predict } => {
                for (index, setup) in setups.iter().enumerate() {
                    scaling(subject, setup, *max_threads, *predict, view, &token.part(index, setups.len()), rows)?;
                }
                Ok(())
            }
            Self::Sweep(plan) => {
                let points: Vec<_> = plan.points(models).into_iter().filter(|point| point.model == model).collect();
                // Shards share the points, not the files.
                let files = if plan.shard.0 == 1 { subject.trees.len() } else { 0 };
                let parts = points.len() + usize::from(files > 0);
                for (index, point) in points.iter().enumerate() {
                    sweep(subject, plan, *point, view, &token.part(index, parts), rows)?;
                }
                if files > 0 {
                    sweep_files(subject, plan, view, &token.part(points.len(), parts), rows)?;
                }
                Ok(())
            }
        }
    }
}
