//! Tables with one line per measurement: sweeps, builders, threads.

use super::aligned::ReportTable;
use super::format::{SPREAD, conditions, conditions_and_threads, costs, models, name_among, number, spread};
use crate::lab::measurement::Measurement;
use crate::text::count;

/// What the column "ready" adds to the one before it.
const READY: &str = "Ready: until rays can be traced at full speed, the binary tree and the wide one made from it.";

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
            ("binary tree", "ms"),
            ("spread", "%"),
            ("ready", "ms"),
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
        let aac = row.is_aac();
        table.rows.push(vec![
            name_among(&row.model, &models),
            row.builder_name(),
            row.container.name().to_owned(),
            if aac { row.threshold.to_string() } else { "–".to_owned() },
            if aac { row.epsilon.to_string() } else { "–".to_owned() },
            number(row.build_ms),
            spread(row.build_ms, row.build_ms_spread),
            row.ready_ms.map_or_else(|| "–".to_owned(), number),
            number(row.trace_ms),
            spread(row.trace_ms, row.trace_ms_spread),
            number(row.mrays_per_s),
            number(row.container_tests_per_ray),
            number(row.primitive_tests_per_ray),
            number(row.tests_per_ray),
            number(row.sah_cost),
            number(row.epo),
            count(row.nodes as u64),
            count(row.leaves as u64),
            row.max_depth.to_string(),
            format!("{:.0}", row.bytes_per_triangle),
            count(row.hits),
        ]);
    }
    table.notes.push(READY.to_owned());
    table.notes.push(costs());
    table.notes.extend(overlap_basis(rows));
    table.notes.push(SPREAD.to_owned());
    table
}

/// How many triangles the overlap was computed from, where they were not all.
fn overlap_basis(rows: &[Measurement]) -> Option<String> {
    let sampled = |row: &Measurement| row.epo_triangles.filter(|&count| count < row.triangles);
    let least = rows.iter().filter_map(sampled).min()?;
    Some(format!("EPO: end-point overlap, estimated from {} triangles or more of each scene.", count(least as u64)))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::sample::sample;

    /// Each cell with the name and unit of its column.
    fn cells(table: &ReportTable, row: usize) -> Vec<String> {
        let cells = table.columns.iter().zip(&table.rows[row]);
        cells.map(|((name, unit), cell)| format!("{name} {unit}: {cell}").replace(" :", ":")).collect()
    }

    #[test]
    fn a_list_shows_each_column_of_its_row() {
        let other = Measurement { builder: "lbvh".to_owned(), preset: None, threads: 4, ..sample() };
        let table = list_table("Sweep", &[sample()]);
        assert_eq!(table.title, "Sweep (101×103 primary rays, ordered traversal, medians of 5, 3 threads)");
        let expected = [
            "scene: thing.obj",
            "builder: fast",
            "container: box",
            "δ: 11",
            "ε: 0.25",
            "binary tree ms: 20.00",
            // From 17 to 23 ms.
            "spread %: 30",
            "ready ms: 23.75",
            "trace ms: 50.00",
            // From 47 to 61 ms.
            "spread %: 28",
            "speed Mray/s: 0.208",
            "containers tests/ray: 26.25",
            "primitives tests/ray: 3.250",
            "all tests/ray: 29.50",
            "SAH cost: 67.30",
            "EPO: 0.875",
            "nodes: 14,001",
            "leaves: 7,013",
            "depth: 31",
            "memory B/tri: 98",
            "hits: 5,003",
        ];
        assert_eq!(cells(&table, 0), expected);
        assert_eq!(table.notes[2], "EPO: end-point overlap, estimated from 2,003 triangles or more of each scene.");
        let table = list_table("Sweep", &[sample(), other]);
        assert_eq!(table.title, "Sweep (101×103 primary rays, ordered traversal, medians of 5)", "threads differ");
        let read = Measurement { tree: Some("x.bvh".to_owned()), preset: None, build_ms: f64::NAN, ..sample() };
        let of_file = list_table("", &[read]);
        assert_eq!(
            cells(&of_file, 0)[1..7],
            ["builder: aac", "container: box", "δ: –", "ε: –", "binary tree ms: –", "spread %: –"]
        );
        assert_eq!(cells(&table, 1)[1..5], ["builder: lbvh + hilbert + collapse", "container: box", "δ: –", "ε: –"]);
    }

    #[test]
    fn efficiency_is_the_speed_up_for_each_thread() {
        let one = Measurement { threads: 1, speedup: None, trace_speedup: Some(1.0), ..sample() };
        let table = scaling_table(&[one, sample()]);
        let expected = [
            "scene: thing.obj",
            "container: box",
            "threads: 3",
            "build ms: 20.00",
            "spread %: 30",
            "speed-up ×: 2.75",
            // 2.75 with 3 threads.
            "efficiency %: 92",
            "trace ms: 50.00",
            "spread %: 28",
            "speed-up ×: 1.25",
            "efficiency %: 42",
        ];
        assert_eq!(cells(&table, 1), expected);
        assert_eq!(cells(&table, 0)[5..7], ["speed-up ×: –", "efficiency %: –"]);
        assert_eq!(cells(&table, 0)[9..], ["speed-up ×: 1.00", "efficiency %: 100"]);
    }
}
