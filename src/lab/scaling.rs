//! The measurements of the paper's figure 11: speed-up of building and tracing against the number of threads.

use super::measure::{LabError, RowSink, measure};
use super::measurement::Measurement;
use super::setup::{Setup, Subject, TraceView};
use super::speedup;
use crate::catalog::numbers::rows::{BUILD_MS, SPEEDUP, TRACE_MS, TRACE_SPEEDUP};
use crate::threads;
use bvhscope_engine::cancel::CancelToken;

/// Measures `setup` with 1 to `max_threads` threads, at most as many as there are cores to use, one row each with the speed-up over one
/// thread. `setup.threads` is ignored. If `predict`, the first row also has the speed-up that is predicted for more cores. The thread
/// counts are measured interleaved, so all rows are passed at the end.
pub fn scaling(
    subject: &Subject,
    setup: &Setup,
    max_threads: usize,
    predict: bool,
    view: &TraceView,
    token: &CancelToken,
    rows: &mut dyn RowSink,
) -> Result<(), LabError> {
    if predict && subject.scene.copies.is_some() {
        let text =
            "of a scene of copies no speed-up is predicted; leave --predict out, or load it with --instances flat";
        return Err(LabError::Refused(text.to_owned()));
    }
    let parts = 1 + usize::from(predict);
    let (mut measured, mut outcome) = measure_threads(subject, setup, max_threads, view, &token.part(0, parts), rows);
    if let Some(first) = measured.first_mut().filter(|_| predict && outcome.is_ok()) {
        match speedup::predict(subject, setup, view, &token.part(1, parts)) {
            Ok(prediction) => first.predicted_scaling = Some(prediction),
            Err(error) => outcome = Err(error),
        }
    }
    for row in measured {
        rows.row(row);
    }
    outcome
}

/// The rows of [`scaling`], those of the completed repetitions where it ended early.
fn measure_threads(
    subject: &Subject,
    setup: &Setup,
    max_threads: usize,
    view: &TraceView,
    token: &CancelToken,
    rows: &mut dyn RowSink,
) -> (Vec<Measurement>, Result<(), LabError>) {
    let setups: Vec<Setup> =
        (1..=threads::count(max_threads.max(1))).map(|threads| Setup { threads, ..*setup }).collect();
    let mut with_speedups = WithSpeedups { measured: Vec::new(), rows };
    let outcome = measure("scaling", subject, &setups, view, token, &mut with_speedups);
    let mut measured = with_speedups.measured;
    add_speedups(&mut measured);
    (measured, outcome)
}

/// Keeps the rows until all are measured, since each needs the first.
struct WithSpeedups<'a> {
    measured: Vec<Measurement>,
    rows: &'a mut dyn RowSink,
}

impl RowSink for WithSpeedups<'_> {
    fn row(&mut self, row: Measurement) {
        self.measured.push(row);
    }

    fn preliminary(&mut self, mut rows: Vec<Measurement>) {
        add_speedups(&mut rows);
        self.rows.preliminary(rows);
    }
}

/// Sets the speed-ups of `rows` over the first. One thread is measured first, so that rows completed before a cancellation have
/// their reference.
fn add_speedups(rows: &mut [Measurement]) {
    let Some(one) = rows.first().map(|row| row.values.clone()) else { return };
    for row in rows {
        for (speedup, time) in [(SPEEDUP, BUILD_MS), (TRACE_SPEEDUP, TRACE_MS)] {
            // Null where the time of the row is 0.
            let ratio = one.number(time) / row.number(time);
            row.values.set(speedup, ratio);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::sample::sample;

    #[test]
    fn speedups_are_the_time_of_one_thread_over_that_of_the_row() {
        let row = |build_ms: f64, trace_ms: f64| sample().with(BUILD_MS, build_ms).with(TRACE_MS, trace_ms);
        let mut rows = [row(60.0, 14.0), row(20.0, 7.0), row(120.0, 3.5), row(0.0, 28.0)];
        add_speedups(&mut rows);
        let speedups = rows.map(|row| (row.values.known(SPEEDUP), row.values.known(TRACE_SPEEDUP)));
        let expected = [
            (Some(1.0), Some(1.0)),
            (Some(3.0), Some(2.0)),
            (Some(0.5), Some(4.0)),
            // No time was measured for the build.
            (None, Some(0.5)),
        ];
        assert_eq!(speedups, expected);
        add_speedups(&mut []);
    }
}
