//! The paper's tables 1 and 2: box and sphere side by side with their ratios, and the paper's own numbers below.

use super::aligned::ReportTable;
use super::format::{SPREAD, conditions_and_threads, models, name_among, number, spread};
use super::lists::list_table;
use crate::lab::measurement::Measurement;
use crate::lab::paper::{MEAN_RATIOS, PaperScene, scene_of};
use bvhscope_engine::tree::ContainerKind;

/// Reads one column's value from a row.
type Value = fn(&Measurement) -> f64;

/// Table 1, table 2, build times by stage, and tree statistics.
pub(super) fn bench_tables(rows: &[Measurement]) -> Vec<ReportTable> {
    let times: [(&str, &str, Value); 2] = [("build", "ms", |row| row.build_ms), ("trace", "ms", |row| row.trace_ms)];
    let tests: [(&str, &str, Value); 3] = [
        ("containers", "tests/ray", |row| row.container_tests_per_ray),
        ("primitives", "tests/ray", |row| row.primitive_tests_per_ray),
        ("all", "tests/ray", |row| row.tests_per_ray),
    ];
    let papers_times = |paper: &PaperScene| vec![Some(paper.build_ms), Some(paper.trace_ms)];
    let papers_tests = |paper: &PaperScene| vec![None, None, Some(paper.tests_per_ray)];
    let [build, trace, all] = MEAN_RATIOS;
    vec![
        pairs_table("Build and trace time", rows, &times, &papers_times, &[Some(build), Some(trace)]),
        pairs_table("Intersection tests per ray", rows, &tests, &papers_tests, &[None, None, Some(all)]),
        stages_table(rows),
        trees_table(rows),
    ]
}

/// One line per model with box, sphere and their ratio for each value, the paper's numbers below, means at the end.
fn pairs_table(
    title: &str,
    rows: &[Measurement],
    values: &[(&str, &str, Value)],
    papers: &dyn Fn(&PaperScene) -> Vec<Option<[f64; 2]>>,
    papers_means: &[Option<f64>],
) -> ReportTable {
    let title = format!("{title} ({})", conditions_and_threads(rows));
    let mut table = ReportTable::new(title, &[("scene", ""), ("triangles", "")]);
    for (name, unit, _) in values {
        for kind in ContainerKind::ALL {
            table.columns.push((format!("{name} {}", kind.name()), (*unit).to_owned()));
        }
        table.columns.push(("ratio".to_owned(), "box:sph".to_owned()));
    }
    let mut ratios: Vec<Vec<f64>> = vec![Vec::new(); values.len()];
    let mut any_paper = false;
    let models = models(rows);
    for model in &models {
        let row_of =
            |kind| rows.iter().find(|row| row.model == *model && row.container == kind && row.builder != "none");
        let pair = [row_of(ContainerKind::Aabb), row_of(ContainerKind::Sphere)];
        let triangles = pair.iter().flatten().next().map_or_else(String::new, |row| row.triangles.to_string());
        let mut line = vec![name_among(model, &models), triangles];
        for (index, (_, _, value)) in values.iter().enumerate() {
            let numbers = pair.map(|row| row.map(value));
            line.extend(numbers.iter().map(|value| value.map_or_else(String::new, number)));
            let ratio = match numbers {
                [Some(a), Some(b)] if b > 0.0 => Some(a / b),
                _ => None,
            };
            ratios[index].extend(ratio);
            line.push(ratio.map_or_else(String::new, |ratio| format!("{ratio:.2}")));
        }
        table.rows.push(line);
        if let Some(paper) = scene_of(model) {
            any_paper = true;
            let mut line = vec![format!("  the paper's {}", paper.name), String::new()];
            for pair in papers(paper) {
                match pair {
                    Some([a, b]) => line.extend([format!("{a}"), format!("{b}"), format!("{:.2}", a / b)]),
                    None => line.extend([const { String::new() }; 3]),
                }
            }
            table.rows.push(line);
        }
    }
    let mean = |label: &str, means: &mut dyn Iterator<Item = Option<f64>>| {
        let mut line = vec![label.to_owned(), String::new()];
        for mean in means {
            line.extend([String::new(), String::new(), mean.map_or_else(String::new, |mean| format!("{mean:.2}"))]);
        }
        line
    };
    if ratios.iter().any(|ratios| !ratios.is_empty()) {
        let mut means =
            ratios.iter().map(|list| (!list.is_empty()).then(|| list.iter().sum::<f64>() / list.len() as f64));
        table.rows.push(mean("mean of the ratios", &mut means));
        if any_paper {
            table.rows.push(mean("  the paper's mean", &mut papers_means.iter().copied()));
        }
    }
    table
}

/// The stages of an AAC build in order; stages of other builders follow.
const STAGES: [&str; 5] = ["bounds", "codes", "sort", "tree", "flatten"];

/// Build times by stage.
fn stages_table(rows: &[Measurement]) -> ReportTable {
    let mut stages: Vec<&str> = STAGES.to_vec();
    for name in rows.iter().flat_map(|row| row.build_stages_ms.keys()) {
        if !stages.contains(&name.as_str()) {
            stages.push(name);
        }
    }
    stages.retain(|name| rows.iter().any(|row| row.build_stages_ms.contains_key(*name)));
    let mut table = ReportTable::new("Build time by stage", &[("scene", ""), ("container", "")]);
    table.columns.extend(stages.iter().map(|name| ((*name).to_owned(), "ms".to_owned())));
    table.columns.extend([("build", "ms"), ("spread", "%")].map(|(name, unit)| (name.to_owned(), unit.to_owned())));
    let models = models(rows);
    for row in rows.iter().filter(|row| row.builder != "none") {
        let mut line = vec![name_among(&row.model, &models), row.container.name().to_owned()];
        line.extend(
            stages.iter().map(|name| row.build_stages_ms.get(*name).map_or_else(String::new, |ms| number(*ms))),
        );
        line.extend([number(row.build_ms), spread(row.build_ms, row.build_ms_spread)]);
        table.rows.push(line);
    }
    table.notes.push(format!("Each stage's own median. {SPREAD}"));
    table
}

/// Tree statistics, with a note about the run without BVH.
fn trees_table(rows: &[Measurement]) -> ReportTable {
    let mut table = ReportTable { title: "The trees".to_owned(), ..list_table("", rows) };
    let models = models(rows);
    for row in rows.iter().filter(|row| row.builder == "none") {
        let pixels = u64::from(row.width_px) * u64::from(row.height_px);
        table.notes.push(format!(
            "{} without BVH: {} of {pixels} pixels, evenly spread, in {} ms; {} tests per ray.",
            name_among(&row.model, &models),
            row.rays,
            number(row.trace_ms),
            number(row.tests_per_ray)
        ));
    }
    table
}
