//! Which tables each measuring command prints.

use super::aligned::ReportTable;
use super::{lists, pairs, policies, predictions, speedups};
use crate::lab::measurement::Measurement;

/// The tables of the measurements of one command.
pub fn tables(command: &str, rows: &[Measurement]) -> Vec<ReportTable> {
    let mut tables = match command {
        // Of populations there is a row for each frame.
        "animate" => return policies::policy_tables(rows),
        "bench" => pairs::bench_tables(rows),
        "scaling" => vec![lists::scaling_table(rows)],
        "compare" => vec![lists::comparison_table(rows)],
        _ => vec![lists::list_table("Sweep", rows)],
    };
    tables.extend(speedups::speedup_tables(rows));
    tables.extend(predictions::prediction_tables(rows));
    tables
}
