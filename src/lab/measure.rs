//! The core of every job: several trees of one scene, built and traced alternately, so that a slow phase of the machine
//! affects all of them alike.

use std::sync::Arc;

use super::measurement::{Measurement, pool};
use super::setup::{Setup, Subject, TraceView};
use super::trial::{First, Trial};
use crate::accel::Accel;
use crate::render::{RenderRequest, RenderSettings, count_tests, trace_primary, trace_primary_wide};
use bvhscope_engine::builders::BuildError;
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// The reason why a measurement ended early.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LabError {
    /// The measurement was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The measurement is impossible; the text says why.
    #[error("{0}")]
    Refused(String),
}

impl From<BuildError> for LabError {
    fn from(error: BuildError) -> Self {
        match error {
            BuildError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            BuildError::Refused(text) => Self::Refused(text),
        }
    }
}

/// Measures `setups` on one scene, interleaved: each is built and traced once, then all again, for `view.repeat` repetitions.
/// One row per setup, in the order of `setups`, is passed to `row` at the end. When cancelled, setups with at least one
/// completed repetition still give a row before the error is returned.
pub fn measure(
    command: &str,
    subject: &Subject,
    setups: &[Setup],
    view: &TraceView,
    token: &CancelToken,
    row: &mut dyn FnMut(Measurement),
) -> Result<(), LabError> {
    let mut trials: Vec<Trial> = setups.iter().map(|_| Trial::default()).collect();
    let outcome = repeat(subject, setups, view, token, &mut trials);
    for (setup, trial) in setups.iter().zip(&trials) {
        if let Some(first) = &trial.first {
            row(trial.measurement(command, subject, setup, view, first));
        }
    }
    outcome
}

fn repeat(
    subject: &Subject,
    setups: &[Setup],
    view: &TraceView,
    token: &CancelToken,
    trials: &mut [Trial],
) -> Result<(), LabError> {
    let pools =
        setups.iter().map(|setup| pool(setup.threads)).collect::<Result<Vec<_>, _>>().map_err(LabError::Refused)?;
    let rounds = view.repeat.max(1);
    for round in 0..rounds {
        for (index, ((setup, pool), trial)) in setups.iter().zip(&pools).zip(&mut *trials).enumerate() {
            let token = token.part(round * setups.len() + index, rounds * setups.len());
            pool.install(|| try_once(subject, setup, view, &token, trial))?;
        }
    }
    Ok(())
}

/// One repetition of one setup. Only one tree exists at a time, so that the largest scene that can be shown can also be
/// measured.
fn try_once(
    subject: &Subject,
    setup: &Setup,
    view: &TraceView,
    token: &CancelToken,
    trial: &mut Trial,
) -> Result<(), LabError> {
    let accel = Arc::new(Accel::build(&subject.scene, &setup.build, &token.part(0, 3))?);
    let trace = trace_primary(&request(&accel, view), view.traversal, &token.part(1, 3))?;
    let first = if trial.first.is_none() {
        Some(First {
            tests: count_tests(&request(&accel, view), &token.part(2, 3))?,
            threads: rayon::current_num_threads(),
            report: accel.report.clone(),
            epo: accel.epo(token)?,
            wide_node_bytes: accel.wide().tree.node_bytes(),
            wide_triangle_bytes: accel.wide().tree.triangle_bytes(),
            wide_bytes_per_triangle: accel.wide().bytes_per_triangle(),
        })
    } else {
        None
    };
    let wide_trace = trace_primary_wide(&request(&accel, view), &token.part(2, 3))?;
    trial.record(&accel.report.stages, &trace, accel.wide().collapse_time, &wide_trace);
    if let Some(first) = first {
        trial.first = Some(first);
    }
    token.set_progress(1.0);
    Ok(())
}

fn request(accel: &Arc<Accel>, view: &TraceView) -> RenderRequest {
    RenderRequest {
        accel: Arc::clone(accel),
        camera: view.camera,
        settings: RenderSettings { traversal: view.traversal, simd: view.simd, ..RenderSettings::default() },
        width_px: view.size[0],
        height_px: view.size[1],
        coarseness: 1.0,
        count_tests: false,
        hidden: None,
    }
}
