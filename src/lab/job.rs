//! Any measuring job over one model of several, the same for the command line and the window.

use super::bench::bench;
use super::compare::compare;
use super::measure::{LabError, Setup, Subject, TraceView};
use super::measurement::Measurement;
use super::scaling::scaling;
use super::sweep::{SweepPlan, sweep};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::tree::ContainerKind;

/// What is measured.
#[derive(Debug, Clone, PartialEq)]
pub enum Job {
    /// Tables 1 and 2: these trees, in turn.
    Bench {
        /// The trees.
        setups: Vec<Setup>,
        /// Every triangle is tested as well.
        no_bvh: bool,
    },
    /// Figures 9 and 10: a range of thresholds.
    Sweep(SweepPlan),
    /// Figure 11: each tree with 1 to so many threads.
    Scaling {
        /// The trees.
        setups: Vec<Setup>,
        /// Most threads.
        max_threads: usize,
    },
    /// Every builder.
    Compare {
        /// Boxes, spheres or both.
        containers: Vec<ContainerKind>,
        /// Threads; 0 for all.
        threads: usize,
    },
}

impl Job {
    /// The name of its command, which its rows carry.
    pub const fn command(&self) -> &'static str {
        match self {
            Self::Bench { .. } => "bench",
            Self::Sweep(_) => "sweep",
            Self::Scaling { .. } => "scaling",
            Self::Compare { .. } => "compare",
        }
    }

    /// Why its settings fit no scene at all.
    pub fn refusal(&self) -> Option<String> {
        match self {
            Self::Bench { setups, .. } | Self::Scaling { setups, .. } => {
                setups.iter().find_map(|setup| setup.build.refusal(0))
            }
            Self::Sweep(_) | Self::Compare { .. } => None,
        }
    }

    /// Whether there is anything to measure on the `model`-th of `models` models: another share of a sweep may have it.
    pub fn concerns(&self, model: usize, models: usize) -> bool {
        match self {
            Self::Sweep(plan) => plan.points(models).iter().any(|point| point.model == model),
            _ => true,
        }
    }

    /// Measures the `model`-th of `models` models. Rows come as soon as what they are compared with is done; cancelled,
    /// those of the repetitions that were done still come. The progress is that of this model.
    pub fn run(
        &self,
        subject: &Subject,
        (model, models): (usize, usize),
        view: &TraceView,
        token: &CancelToken,
        row: &mut dyn FnMut(Measurement),
    ) -> Result<(), LabError> {
        match self {
            Self::Bench { setups, no_bvh } => bench(subject, setups, view, *no_bvh, token, row),
            Self::Compare { containers, threads } => compare(subject, containers, *threads, view, token, row),
            Self::Scaling { setups, max_threads } => {
                for (index, setup) in setups.iter().enumerate() {
                    scaling(subject, setup, *max_threads, view, &token.part(index, setups.len()), row)?;
                }
                Ok(())
            }
            Self::Sweep(plan) => {
                let points: Vec<_> = plan.points(models).into_iter().filter(|point| point.model == model).collect();
                for (index, point) in points.iter().enumerate() {
                    sweep(subject, plan, *point, view, &token.part(index, points.len()), row)?;
                }
                Ok(())
            }
        }
    }
}
