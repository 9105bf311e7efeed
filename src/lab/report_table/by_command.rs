//! Which tables each measuring command prints.

use super::aligned::ReportTable;
use super::format::short;
use super::{lists, pairs, policies, predictions, speedups};
use crate::catalog::numbers::rows::{ENTERING_RAYS, RAYS};
use crate::lab::measurement::{Measurement, ModelView};
use crate::lab::population::{self, Population};

/// The tables of the measurements of one command.
pub fn tables(command: &str, rows: &[Measurement]) -> Vec<ReportTable> {
    let mut tables = match command {
        // Of populations there is a row for each frame.
        "animate" => return with_few(policies::policy_tables(rows), rows),
        "bench" => pairs::bench_tables(rows),
        "scaling" => vec![lists::scaling_table(rows)],
        "compare" => vec![lists::comparison_table(rows)],
        _ => vec![lists::list_table("Sweep", rows)],
    };
    tables.extend(speedups::speedup_tables(rows));
    tables.extend(predictions::prediction_tables(rows));
    with_few(tables, rows)
}

/// The tables, the first with a note of each kind of rays of which few enter the model.
fn with_few(mut tables: Vec<ReportTable>, rows: &[Measurement]) -> Vec<ReportTable> {
    let few = few_entering(rows);
    if let Some(first) = tables.first_mut() {
        first.notes.splice(0..0, few);
    }
    tables
}

/// A sentence for each model, camera and kind of rays of which few enter the model; of a clip for the first frame where that is so.
pub fn few_entering(rows: &[Measurement]) -> Vec<String> {
    let mut few = Vec::new();
    for row in rows {
        let of_all = row.values.known(ENTERING_RAYS).map(|entering| (entering as u64, row.values.count(RAYS)));
        let primary = of_all.map(|(entering, rays)| (Population::Primary, entering, rays));
        let others = row
            .populations
            .iter()
            .filter_map(|measured| Some((measured.population, measured.entering_rays?.into(), measured.rays.into())));
        for (population, entering, rays) in primary.into_iter().chain(others) {
            let is_known = few.iter().any(|(view, kind, _)| (*view, *kind) == (row.view(), population));
            let found = population::few_entering(population, entering, rays).filter(|_| !is_known);
            few.extend(found.map(|text| (row.view(), population, text)));
        }
    }
    let sentence = |(ModelView { model, camera }, _, text): (ModelView<'_>, _, String)| {
        format!("{}, camera {camera}: {text}.", short(model))
    };
    few.into_iter().map(sentence).collect()
}
