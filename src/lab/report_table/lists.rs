//! Tables with one line per measurement: sweeps, builders, threads.

use super::aligned::ReportTable;
use super::format::{SPREAD, conditions, conditions_and_threads, costs, models, name_among, number, spread};
use crate::lab::measurement::Measurement;

/// Times, tests, costs and sizes of each tree.
pub(super) fn list_table(title: &str, rows: &[Measurement]) -> ReportTable {
    let mut table = ReportTable::new(
        format!("{title} ({})", conditions_and_threads(rows)),
        &[
            ("scene", ""),
            ("builder", ""),
            ("container", ""),
            ("δ", ""),
            ("ε", ""),
            ("build", "ms"),
            ("spread", "%"),
            ("trace", "ms"),
            ("spread", "%"),
            ("speed", "Mray/s"),
            ("containers", "tests/ray"),
            ("primitives", "tests/ray"),
            ("all", "tests/ray"),
            ("SAH cost", ""),
            ("EPO", ""),
            ("nodes", ""),
            ("leaves", ""),
            ("depth", ""),
            ("memory", "B/tri"),
            ("hits", ""),
        ],
    );
    let models = models(rows);
    for row in rows {
        let aac = row.builder == "aac";
        table.rows.push(vec![
            name_among(&row.model, &models),
            row.builder_name(),
            row.container.name().to_owned(),
            if aac { row.threshold.to_string() } else { "–".to_owned() },
            if aac { row.epsilon.to_string() } else { "–".to_owned() },
            number(row.build_ms),
            spread(row.build_ms, row.build_ms_spread),
            number(row.trace_ms),
            spread(row.trace_ms, row.trace_ms_spread),
            number(row.mrays_per_s),
            number(row.container_tests_per_ray),
            number(row.primitive_tests_per_ray),
            number(row.tests_per_ray),
            number(row.sah_cost),
            number(row.epo),
            row.nodes.to_string(),
            row.leaves.to_string(),
            row.max_depth.to_string(),
            format!("{:.0}", row.bytes_per_triangle),
            row.hits.to_string(),
        ]);
    }
    table.notes.push(costs());
    table.notes.push(SPREAD.to_owned());
    table
}

/// Speed-up and parallel efficiency of building and tracing.
pub(super) fn scaling_table(rows: &[Measurement]) -> ReportTable {
    let mut table = ReportTable::new(
        format!("Speed-up over one thread ({})", conditions(rows)),
        &[
            ("scene", ""),
            ("container", ""),
            ("threads", ""),
            ("build", "ms"),
            ("spread", "%"),
            ("speed-up", "×"),
            ("efficiency", "%"),
            ("trace", "ms"),
            ("spread", "%"),
            ("speed-up", "×"),
            ("efficiency", "%"),
        ],
    );
    let models = models(rows);
    for row in rows {
        let parts = |speedup: Option<f64>| match speedup {
            Some(speedup) => [format!("{speedup:.2}"), format!("{:.0}", speedup / row.threads.max(1) as f64 * 100.0)],
            None => ["–".to_owned(), "–".to_owned()],
        };
        let mut line = vec![name_among(&row.model, &models), row.container.name().to_owned(), row.threads.to_string()];
        line.extend([number(row.build_ms), spread(row.build_ms, row.build_ms_spread)]);
        line.extend(parts(row.speedup));
        line.extend([number(row.trace_ms), spread(row.trace_ms, row.trace_ms_spread)]);
        line.extend(parts(row.trace_speedup));
        table.rows.push(line);
    }
    table.notes.push(SPREAD.to_owned());
    table
}
