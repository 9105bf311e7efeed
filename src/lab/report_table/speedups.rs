//! Tables of the speed-up that is predicted for more cores.

use super::aligned::ReportTable;
use super::format::{name_among, number};
use crate::lab::measurement::{Measurement, model_views};
use crate::lab::speedup::prediction::{PredictedScaling, PredictedSpeedup, ScalingPrediction};
use crate::text::count;

/// Smallest part of the work that a stage is named for.
const NAMED_SHARE: f64 = 0.001;

/// A table for each row that has a prediction.
pub(super) fn speedup_tables(rows: &[Measurement]) -> Vec<ReportTable> {
    let names = model_views(rows);
    let table = |row: &Measurement| {
        let name = format!("{}, {}", name_among(row.view(), &names), row.container.name());
        row.predicted_scaling.as_ref().map(|prediction| speedup_table(&name, prediction))
    };
    rows.iter().filter_map(table).collect()
}

fn speedup_table(name: &str, prediction: &ScalingPrediction) -> ReportTable {
    let ScalingPrediction { runs, fork_us, steal_us, build, trace } = prediction;
    let mut table = ReportTable::new(
        format!("Predicted speed-up of {name} over one core"),
        &[
            ("cores", ""),
            ("build", "×"),
            ("at worst", "×"),
            ("at best", "×"),
            ("trace", "×"),
            ("at worst", "×"),
            ("at best", "×"),
        ],
    );
    let times = |speedup: f64| format!("{speedup:.2}");
    let cells = |point: Option<&PredictedSpeedup>| match point {
        Some(point) => [point.speedup, point.lower, point.upper].map(times),
        None => ["–"; 3].map(str::to_owned),
    };
    for point in &build.curve {
        let line = [vec![point.cores.to_string()], cells(Some(point)).into(), cells(trace.at(point.cores)).into()];
        table.rows.push(line.concat());
    }
    if let (Some(of_build), Some(of_trace)) = (build.measured_at_two, trace.measured_at_two) {
        let blank = String::new;
        let line = ["measured at 2".to_owned(), times(of_build), blank(), blank(), times(of_trace)];
        table.rows.push(line.into());
        let percent = |scaling: &PredictedScaling| {
            scaling.difference_at_two().map_or_else(|| "–".to_owned(), |by| format!("{:+.1} %", by * 100.0))
        };
        let line = ["predicted differs by".to_owned(), percent(build), blank(), blank(), percent(trace)];
        table.rows.push(line.into());
    }
    table.notes.push(work_and_span("Build until rays can be traced at full speed", build));
    table.notes.extend(stages(build));
    table.notes.push(work_and_span("Trace through the binary tree", trace));
    table.notes.push(match steal_us {
        Some([awake, asleep]) => format!(
            "Measured in {runs} runs on one thread and on two: a fork takes {fork_us:.2} µs, and until another thread begins a task \
             {awake:.1} µs, {asleep:.1} µs if it slept. At worst each core slows the others' tasks down as much as the second does, \
             at best more than two do not; between them each doubling counts as the first."
        ),
        None => format!(
            "Measured in {runs} runs on one thread, as this process may use one core: what cores cost each other is not known, and \
             the curve is that of work, span and forks of {fork_us:.2} µs alone."
        ),
    });
    table
}

fn work_and_span(name: &str, scaling: &PredictedScaling) -> String {
    let PredictedScaling { tasks, work_ms, span_ms, serial_share, .. } = scaling;
    format!(
        "{name}: {} tasks, work {} ms, span {} ms, serial sections {:.1} % of the work.",
        count(*tasks as u64),
        number(*work_ms),
        number(*span_ms),
        serial_share * 100.0
    )
}

/// The stages that take a noticeable time, with their serial sections and how much two busy cores slow each other down.
fn stages(scaling: &PredictedScaling) -> Option<String> {
    let named = scaling.stages.iter().filter(|stage| stage.work_ms >= scaling.work_ms * NAMED_SHARE);
    let texts: Vec<String> = named
        .map(|stage| {
            let share = stage.serial_ms / scaling.work_ms * 100.0;
            let inflation =
                stage.inflation.map(|ratio| format!(", ×{ratio:.2} beside another core")).unwrap_or_default();
            format!("{} {} ms ({share:.1} % serial{inflation})", stage.stage, number(stage.work_ms))
        })
        .collect();
    (!texts.is_empty()).then(|| format!("Stages: {}.", texts.join("; ")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::sample::sample;

    #[test]
    fn the_table_has_bounds_and_what_was_measured() {
        let without = Measurement { predicted_scaling: None, ..sample() };
        let tables = speedup_tables(&[sample(), without]);
        let [table] = &tables[..] else { unreachable!("{tables:?}") };
        assert_eq!(table.title, "Predicted speed-up of thing.obj, box over one core");
        assert_eq!(table.rows[1], ["2", "1.75", "1.50", "1.88", "1.75", "1.50", "1.88"]);
        assert_eq!(table.rows[2][0], "8");
        assert_eq!(table.rows[3], ["measured at 2", "1.62", "", "", "1.62"]);
        assert_eq!(table.rows[4], ["predicted differs by", "+7.7 %", "", "", "+7.7 %"]);
        let build = "Build until rays can be traced at full speed: 71 tasks, work 64.00 ms, span 2.000 ms, \
                     serial sections 1.6 % of the work.";
        assert_eq!(table.notes[0], build);
        assert_eq!(table.notes[1], "Stages: sort 16.00 ms (1.6 % serial, ×1.12 beside another core).");
        assert!(table.notes[3].starts_with("Measured in 7 runs on one thread and on two: a fork takes 0.06 µs"));
    }

    #[test]
    fn a_single_core_is_said_so() {
        let mut row = sample();
        if let Some(prediction) = &mut row.predicted_scaling {
            prediction.steal_us = None;
            prediction.build.measured_at_two = None;
        }
        let tables = speedup_tables(&[row]);
        assert_eq!(tables[0].rows.len(), 3);
        assert!(tables[0].notes[3].contains("this process may use one core"), "{:?}", tables[0].notes);
    }
}
