//! Tables of what rays of each population cost in each tree, and how well that was predicted.

use super::aligned::ReportTable;
use super::format::{container_test, models, name_among, number, setting};
use crate::catalog::numbers::rows::{EPO, SAH_COST};
use crate::catalog::settings::THRESHOLD;
use crate::lab::measurement::Measurement;
use crate::lab::population::Population;
use crate::lab::prediction::Correlation;
use crate::text::count;

/// The tables of `rows`; none where no population was measured.
pub(super) fn prediction_tables(rows: &[Measurement]) -> Vec<ReportTable> {
    let of = |row: &Measurement, population| row.populations.iter().find(|rays| rays.population == population).cloned();
    let populations: Vec<Population> = Population::ALL
        .into_iter()
        .filter(|&population| rows.iter().any(|row| of(row, population).is_some()))
        .collect();
    if populations.is_empty() {
        return Vec::new();
    }
    let mut columns = vec![("scene", ""), ("builder", ""), ("container", ""), ("δ", ""), ("SAH cost", ""), ("EPO", "")];
    columns.extend(populations.iter().map(|population| (population.name(), "cost/ray")));
    let mut costs =
        ReportTable::new("Cost of a ray that enters its tree's root, by what it is for".to_owned(), &columns);
    let names = models(rows);
    for row in rows.iter().filter(|row| !row.populations.is_empty()) {
        let mut line = vec![
            name_among(&row.model, &names),
            row.builder_name(),
            row.container.name().to_owned(),
            setting(row, &THRESHOLD),
            number(row.number(SAH_COST)),
            number(row.number(EPO)),
        ];
        line.extend(populations.iter().map(|&population| match of(row, population) {
            Some(rays) if rays.root_hits > 0 => number(rays.cost),
            _ => "–".to_owned(),
        }));
        costs.rows.push(line);
    }
    costs.notes.extend(populations.iter().filter_map(|&population| {
        let measured = rows.iter().find_map(|row| of(row, population))?;
        let [rays, entering] = [measured.rays, measured.entering_rays?].map(|rays| count(u64::from(rays)));
        Some(format!("{}: {rays} rays, of which {entering} enter the scene's box.", population.name()))
    }));
    costs.notes.push(format!(
        "Cost: an interior node that is visited counts {}, whatever it holds, and each triangle tested 1. Tests per ray count each \
         container tested instead, two for a visited node, and rays that miss the root.",
        container_test(rows)
    ));
    costs.notes.push("The SAH cost predicts the cost of random lines, which nothing stops.".to_owned());
    let mut tables = vec![costs];
    tables.extend(correlations(rows));
    tables
}

/// The correlation of prediction and measurement over the trees of each scene and kind of container, where there are enough of them.
fn correlations(rows: &[Measurement]) -> Option<ReportTable> {
    let columns = [
        ("scene", ""),
        ("container", ""),
        ("rays", ""),
        ("trees", ""),
        ("SAH cost", "r"),
        ("EPO", "r"),
        ("best α", ""),
        ("(1−α)·SAH+α·EPO", "r"),
    ];
    let mut table = ReportTable::new("How well the measured cost was predicted".to_owned(), &columns);
    let names = models(rows);
    let r = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.3}"));
    for found in Correlation::all(rows) {
        table.rows.push(vec![
            name_among(&found.model, &names),
            found.container.name().to_owned(),
            found.population.name().to_owned(),
            found.trees.to_string(),
            r(found.sah_cost_r),
            r(found.epo_r),
            format!("{:.2}", found.alpha),
            r(Some(found.alpha_r)),
        ]);
    }
    table.notes.push("r: correlation over the trees (Pearson); 1 is a perfect prediction, 0 none.".to_owned());
    table.notes.push(
        "α (Aila, Karras and Laine 2013) is fitted to the same trees that it is judged by, so its r predicts nothing of others."
            .to_owned(),
    );
    (!table.rows.is_empty()).then_some(table)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::settings::Stated;
    use crate::lab::population::MeasuredRays;
    use crate::lab::sample::sample;

    fn row(builder: &str, sah_cost: f64, epo: f64, cost: f64) -> Measurement {
        let populations = vec![
            MeasuredRays {
                population: Population::Bounce,
                rays: 5_000,
                entering_rays: Some(4_200),
                root_hits: 4_000,
                visits: 1,
                predicted_visits: 2.0,
                cost,
                tests_per_ray: None,
                tests_per_entering_ray: None,
            },
            MeasuredRays {
                population: Population::Shadow,
                rays: 0,
                entering_rays: Some(0),
                root_hits: 0,
                visits: 0,
                predicted_visits: 0.0,
                cost: 0.0,
                tests_per_ray: None,
                tests_per_entering_ray: None,
            },
        ];
        let settings = if builder == "aac" { sample().settings } else { Stated::default() };
        let builder = builder.to_owned();
        Measurement { builder, settings, preset: None, populations, ..sample().with(SAH_COST, sah_cost).with(EPO, epo) }
    }

    #[test]
    fn costs_stand_beside_what_predicts_them() {
        let rows = [row("aac", 20.0, 1.0, 40.0), row("lbvh", 30.0, 7.0, 60.0), row("exact", 10.0, 6.0, 20.0)];
        let tables = prediction_tables(&rows);
        let [costs, correlations] = &tables[..] else { unreachable!("{tables:?}") };
        let names: Vec<&str> = costs.columns.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["scene", "builder", "container", "δ", "SAH cost", "EPO", "shadow", "bounce"]);
        assert_eq!(costs.rows[1][2..], ["box", "–", "30.00", "7.000", "–", "60.00"]);
        assert_eq!(costs.notes[1], "bounce: 5,000 rays, of which 4,200 enter the scene's box.");
        assert_eq!(correlations.rows, [["thing.obj", "box", "bounce", "3", "1.000", "0.156", "0.00", "1.000"]]);
    }

    #[test]
    fn without_populations_there_is_no_table() {
        let without = Measurement { populations: Vec::new(), ..sample() };
        assert!(prediction_tables(&[without]).is_empty());
    }
}
