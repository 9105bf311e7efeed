//! Tables of what rays of each population cost in each tree, and how well that was predicted.

use super::aligned::ReportTable;
use super::format::{name_among, number, setting};
use crate::catalog::numbers::rows::{EPO, SAH_COST};
use crate::catalog::settings::THRESHOLD;
use crate::lab::measurement::{Measurement, ModelView, model_views};
use crate::lab::population::{MeasuredRays, Population};
use crate::lab::prediction::Correlation;
use crate::text::count;
use bvhscope_engine::tree::ContainerKind;

/// The tables of `rows`; none where no population was measured.
pub(super) fn prediction_tables(rows: &[Measurement]) -> Vec<ReportTable> {
    let measured = |population: Population| rows.iter().any(|row| rays_of(row, population).is_some());
    let populations: Vec<Population> = Population::of_rows().filter(|&population| measured(population)).collect();
    // Earlier versions did not count them.
    let counted = |rays: Population| {
        rows.iter().filter_map(|row| rays_of(row, rays)).any(|rays| rays.tests_per_entering_ray.is_some())
    };
    let same: Vec<Population> =
        populations.iter().copied().filter(|&rays| rays.is_same_in_all_trees() && counted(rays)).collect();
    let mut tables = Vec::new();
    if !same.is_empty() {
        tables.push(tests_table(rows, &same));
    }
    if !populations.is_empty() {
        tables
            .extend(ContainerKind::WITH_ORIENTED.into_iter().filter_map(|kind| costs_table(rows, kind, &populations)));
    }
    tables.extend(correlations(rows));
    tables
}

fn rays_of(row: &Measurement, population: Population) -> Option<&MeasuredRays> {
    row.populations.iter().find(|rays| rays.population == population)
}

/// Tests of the same rays in each tree, whatever its containers.
fn tests_table(rows: &[Measurement], populations: &[Population]) -> ReportTable {
    let mut columns = vec![("scene", ""), ("builder", ""), ("container", ""), ("δ", "")];
    columns.extend(populations.iter().map(|population| (population.name(), "tests/ray")));
    let mut table = ReportTable::new("Tests per ray that enters the scene's box, by what it is for", &columns);
    let views = model_views(rows);
    for row in rows.iter().filter(|row| !row.populations.is_empty()) {
        let tests = populations.iter().map(|&population| {
            let tests = rays_of(row, population).and_then(|rays| rays.tests_per_entering_ray);
            tests.map_or_else(|| "–".to_owned(), number)
        });
        table.rows.push(named(row, &views).into_iter().chain(tests).collect());
    }
    for view in &views {
        let of_view = || rows.iter().filter(|row| row.view() == *view);
        table.notes.extend(populations.iter().filter_map(|&population| {
            let measured = of_view().find_map(|row| rays_of(row, population))?;
            let [rays, entering] = [measured.rays, measured.entering_rays?].map(|rays| count(u64::from(rays)));
            let name = name_among(*view, &views);
            Some(format!("{name}, {}: {rays} rays, of which {entering} enter the scene's box.", population.name()))
        }));
    }
    table
}

/// Scene, builder, container and threshold of a row.
fn named(row: &Measurement, views: &[ModelView<'_>]) -> Vec<String> {
    let container = row.container.name().to_owned();
    vec![name_among(row.view(), views), row.name(), container, setting(row, &THRESHOLD)]
}

/// Costs of rays in the trees of one kind of container, beside the numbers that predict them. Rays that enter the root of a tree of boxes are others
/// than those that enter one of spheres. `None` where there is one tree alone, unless of lines whose cost the SAH predicts.
fn costs_table(rows: &[Measurement], kind: ContainerKind, populations: &[Population]) -> Option<ReportTable> {
    let trees: Vec<&Measurement> =
        rows.iter().filter(|row| row.container == kind && !row.populations.is_empty()).collect();
    let has_like = |row: &&Measurement| trees.iter().filter(|other| other.view() == row.view()).count() > 1;
    if trees.is_empty() || !(populations.contains(&Population::Random) || trees.iter().any(has_like)) {
        return None;
    }
    let mut columns = vec![("scene", ""), ("builder", ""), ("container", ""), ("δ", ""), ("SAH cost", ""), ("EPO", "")];
    columns.extend(populations.iter().map(|population| (population.name(), "cost/ray")));
    let title = format!("Cost of a ray that enters the root, in trees of {}", kind.plural());
    let mut table = ReportTable::new(title, &columns);
    let views = model_views(rows);
    for row in &trees {
        let costs = populations.iter().map(|&population| match rays_of(row, population) {
            Some(rays) if rays.root_hits > 0 => number(rays.cost),
            _ => "–".to_owned(),
        });
        let predicted = [SAH_COST, EPO].map(|of| number(row.number(of)));
        table.rows.push(named(row, &views).into_iter().chain(predicted).chain(costs).collect());
    }
    table.notes.push(format!(
        "Cost: an interior node that is visited counts {}, whatever it holds, and each triangle tested 1. The SAH cost predicts the \
         cost of random lines, which nothing stops.",
        kind.traversal_cost()
    ));
    Some(table)
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
    let names = model_views(rows);
    let r = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.3}"));
    for found in Correlation::all(rows) {
        table.rows.push(vec![
            name_among(found.view(), &names),
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
                tests_per_entering_ray: Some(cost * 1.25),
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
        let [tests, costs, correlations] = &tables[..] else { unreachable!("{tables:?}") };
        let names = |table: &ReportTable| table.columns.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
        assert_eq!(names(costs), ["scene", "builder", "container", "δ", "SAH cost", "EPO", "shadow", "bounce"]);
        assert_eq!(costs.rows[1][2..], ["box", "–", "30.00", "7.000", "–", "60.00"]);
        assert_eq!(names(tests), ["scene", "builder", "container", "δ", "bounce"]);
        assert_eq!(tests.rows[1][2..], ["box", "–", "75.00"]);
        assert_eq!(tests.notes[0], "thing.obj, bounce: 5,000 rays, of which 4,200 enter the scene's box.");
        assert_eq!(correlations.rows, [["thing.obj", "box", "bounce", "3", "1.000", "0.156", "0.00", "1.000"]]);
    }

    /// Rays enter other roots than the box, and random lines go through each root, so that neither compares containers.
    #[test]
    fn containers_are_compared_by_the_rays_that_enter_the_scenes_box_alone() {
        let spheres = Measurement { container: ContainerKind::Sphere, ..row("aac", 90.0, 5.0, 50.0) };
        let mut rows = [row("aac", 20.0, 1.0, 40.0), spheres];
        let titles =
            |rows: &[Measurement]| prediction_tables(rows).into_iter().map(|table| table.title).collect::<Vec<_>>();
        assert_eq!(titles(&rows), ["Tests per ray that enters the scene's box, by what it is for"]);
        for row in &mut rows {
            row.populations[0].population = Population::Random;
        }
        assert_eq!(
            titles(&rows),
            [
                "Cost of a ray that enters the root, in trees of boxes",
                "Cost of a ray that enters the root, in trees of spheres"
            ]
        );
    }

    #[test]
    fn without_populations_there_is_no_table() {
        let without = Measurement { populations: Vec::new(), ..sample() };
        assert!(prediction_tables(&[without]).is_empty());
    }
}
