//! Tables of what rays of each population cost in each tree, and how well that was predicted.

use super::aligned::ReportTable;
use super::format::{container_test, models, name_among, number, setting};
use crate::catalog::numbers::rows::{EPO, SAH_COST};
use crate::catalog::settings::THRESHOLD;
use crate::lab::measurement::Measurement;
use crate::lab::population::Population;
use crate::lab::prediction::{Prediction, predicted_trees};
use crate::text::count;
use bvhscope_engine::tree::ContainerKind;

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
    let mut costs = ReportTable::new("Cost of a ray that enters the root, by what it is for".to_owned(), &columns);
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
        let [rays, entering] = [measured.rays, measured.root_hits].map(|rays| count(u64::from(rays)));
        Some(format!("{}: {rays} rays, of which {entering} enter the root of the first tree.", population.name()))
    }));
    costs.notes.push(format!(
        "Cost: an interior node that is visited counts {}, whatever it holds, and each triangle tested 1. Tests per ray count each \
         container tested instead, two for a visited node, and rays that miss the root.",
        container_test(rows)
    ));
    costs.notes.push("The SAH cost predicts the cost of random lines, which nothing stops.".to_owned());
    let mut tables = vec![costs];
    tables.extend(correlations(rows, &populations));
    tables
}

/// The correlation of prediction and measurement over the trees of each scene and kind of container, where there are enough of them.
fn correlations(rows: &[Measurement], populations: &[Population]) -> Option<ReportTable> {
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
    for &model in &names {
        let of_model: Vec<Measurement> = rows.iter().filter(|row| row.model == model).cloned().collect();
        for container in ContainerKind::WITH_ORIENTED {
            for &population in populations {
                let trees: Vec<_> =
                    predicted_trees(&of_model, container, population).into_iter().map(|(_, tree)| tree).collect();
                let Prediction { sah, epo, both: Some((alpha, blended)) } = Prediction::of(&trees) else { continue };
                let r = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.3}"));
                table.rows.push(vec![
                    name_among(model, &names),
                    container.name().to_owned(),
                    population.name().to_owned(),
                    trees.len().to_string(),
                    r(sah),
                    r(epo),
                    format!("{alpha:.2}"),
                    format!("{blended:.3}"),
                ]);
            }
        }
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
                root_hits: 4_000,
                visits: 1,
                predicted_visits: 2.0,
                cost,
                tests_per_entering_ray: None,
            },
            MeasuredRays {
                population: Population::Shadow,
                rays: 0,
                root_hits: 0,
                visits: 0,
                predicted_visits: 0.0,
                cost: 0.0,
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
        assert_eq!(costs.notes[1], "bounce: 5,000 rays, of which 4,000 enter the root of the first tree.");
        assert_eq!(correlations.rows, [["thing.obj", "box", "bounce", "3", "1.000", "0.156", "0.00", "1.000"]]);
    }

    #[test]
    fn without_populations_there_is_no_table() {
        let without = Measurement { populations: Vec::new(), ..sample() };
        assert!(prediction_tables(&[without]).is_empty());
    }
}
