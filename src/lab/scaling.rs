//! The measurements of the paper's figure 11: speed-up of building and tracing against the number of threads.

use super::measure::{LabError, Setup, Subject, TraceView, measure};
use super::measurement::Measurement;
use bvhscope_engine::cancel::CancelToken;

/// Measures `setup` with 1 to `max_threads` threads, one row each with the speed-up over one thread. `setup.threads` is ignored.
/// The thread counts are measured interleaved, so all rows are passed at the end.
pub fn scaling(
    subject: &Subject,
    setup: &Setup,
    max_threads: usize,
    view: &TraceView,
    token: &CancelToken,
    row: &mut dyn FnMut(Measurement),
) -> Result<(), LabError> {
    let setups: Vec<Setup> = (1..=max_threads.max(1)).map(|threads| Setup { threads, ..*setup }).collect();
    let mut rows = Vec::new();
    let outcome = measure("scaling", subject, &setups, view, token, &mut |row| rows.push(row));
    // One thread is measured first, so that rows completed before a cancellation have their reference.
    if let Some((build_ms, trace_ms)) = rows.first().map(|one| (one.build_ms, one.trace_ms)) {
        for measured in &mut rows {
            measured.speedup = ratio(build_ms, measured.build_ms);
            measured.trace_speedup = ratio(trace_ms, measured.trace_ms);
        }
    }
    rows.into_iter().for_each(row);
    outcome
}

/// `a / b` if it is finite.
fn ratio(a: f64, b: f64) -> Option<f64> {
    Some(a / b).filter(|ratio| ratio.is_finite())
}
