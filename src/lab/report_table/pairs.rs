//! The paper's tables 1 and 2: box and sphere side by side with their ratios, and the paper's own numbers below.

use super::aligned::ReportTable;
use super::format::{SPREAD, conditions_and_threads, models, name_among, number, spread};
use super::lists::list_table;
use crate::lab::measurement::Measurement;
use crate::lab::paper::{MEAN_RATIOS, PaperScene, scene_of};
use crate::text::count;
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

/// One line per model with box, sphere and their ratio for each value; below it its trees from files and the paper's numbers;
/// means at the end.
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
        let of_model = || rows.iter().filter(|row| row.model == *model);
        let is_built = |row: &&Measurement| row.builder != "none" && row.tree.is_none();
        let row_of = |kind| of_model().filter(is_built).find(|row| row.container == kind);
        let pair = [row_of(ContainerKind::Aabb), row_of(ContainerKind::Sphere)];
        let triangles = pair.iter().flatten().next().map_or_else(String::new, |row| count(row.triangles as u64));
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
        table.rows.extend(of_model().filter_map(|row| file_line(row, values)));
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
    // The mean of a single scene's ratio is the ratio.
    if models.len() > 1 && ratios.iter().any(|ratios| !ratios.is_empty()) {
        let mut means =
            ratios.iter().map(|list| (!list.is_empty()).then(|| list.iter().sum::<f64>() / list.len() as f64));
        table.rows.push(mean("mean of the ratios", &mut means));
        if any_paper {
            table.rows.push(mean("  the paper's mean", &mut papers_means.iter().copied()));
        }
    }
    table
}

/// The line of a tree from a file, under its kind of container; `None` for a tree that was built.
fn file_line(row: &Measurement, values: &[(&str, &str, Value)]) -> Option<Vec<String>> {
    let mut line = vec![format!("  {}", row.file_name()?), String::new()];
    for (_, _, value) in values {
        line.extend(
            ContainerKind::ALL.map(|kind| if row.container == kind { number(value(row)) } else { String::new() }),
        );
        line.push(String::new());
    }
    Some(line)
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
    for row in rows.iter().filter(|row| row.builder != "none" && row.tree.is_none()) {
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
            "{} without BVH: {} of {} pixels, evenly spread, in {} ms; {} tests per ray.",
            name_among(&row.model, &models),
            count(row.rays),
            count(pixels),
            number(row.trace_ms),
            number(row.tests_per_ray)
        ));
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::sample::sample;

    fn row(model: &str, container: ContainerKind, build_ms: f64, trace_ms: f64, tests_per_ray: f64) -> Measurement {
        Measurement { model: model.to_owned(), container, build_ms, trace_ms, tests_per_ray, ..sample() }
    }

    fn rows() -> Vec<Measurement> {
        let (boxes, spheres) = (ContainerKind::Aabb, ContainerKind::Sphere);
        vec![
            row("builtin:teapot", boxes, 20.0, 50.0, 30.0),
            row("builtin:teapot", spheres, 40.0, 500.0, 120.0),
            row("thing.obj", spheres, 20.0, 40.0, 20.0),
            row("thing.obj", boxes, 30.0, 60.0, 35.0),
            Measurement { builder: "none".to_owned(), rays: 211, ..row("thing.obj", boxes, 1.0, 7.5, 41.0) },
        ]
    }

    #[test]
    fn ratios_are_box_to_sphere_and_their_mean_is_that_of_the_ratios() {
        let [times, tests, ..] = &bench_tables(&rows())[..] else { unreachable!("there are four tables") };
        let columns: Vec<&str> = times.columns.iter().map(|(name, _)| name.as_str()).collect();
        let expected =
            ["scene", "triangles", "build box", "build sphere", "ratio", "trace box", "trace sphere", "ratio"];
        assert_eq!(columns, expected);
        let expected = [
            ["builtin:teapot", "7,001", "20.00", "40.00", "0.50", "50.00", "500.0", "0.10"],
            ["  the paper's teapot", "", "92", "126", "0.73", "626", "3985", "0.16"],
            ["thing.obj", "7,001", "30.00", "20.00", "1.50", "60.00", "40.00", "1.50"],
            ["mean of the ratios", "", "", "", "1.00", "", "", "0.80"],
            ["  the paper's mean", "", "", "", "0.77", "", "", "0.14"],
        ];
        assert_eq!(times.rows, expected);
        let of_all: Vec<&[String]> = tests.rows.iter().map(|row| &row[8..]).collect();
        let expected = [["30.00", "120.0", "0.25"], ["19", "49", "0.39"], ["35.00", "20.00", "1.75"]];
        assert_eq!(of_all[..3], expected);
        assert_eq!(of_all[3..], [["", "", "1.00"], ["", "", "0.35"]]);
        assert_eq!(tests.rows[0][2..8], ["26.25", "26.25", "1.00", "3.250", "3.250", "1.00"]);
    }

    #[test]
    fn a_tree_from_a_file_has_a_line_below_its_scene_and_no_part_in_the_means() {
        let spheres = row("thing.obj", ContainerKind::Sphere, f64::NAN, 70.0, 25.0);
        let file = Measurement { tree: Some("a/mine.bvh".to_owned()), builder: "handmade".to_owned(), ..spheres };
        let with_file: Vec<Measurement> = rows().into_iter().chain([file]).collect();
        let [times, _, stages, _] = &bench_tables(&with_file)[..] else { unreachable!("there are four tables") };
        let [without, ..] = &bench_tables(&rows())[..] else { unreachable!("there are four tables") };
        let mut expected = without.rows.clone();
        expected.insert(3, ["  mine.bvh (handmade)", "", "", "–", "", "", "70.00", ""].map(str::to_owned).to_vec());
        assert_eq!(times.rows, expected);
        assert_eq!(stages.rows.len(), 4, "one for each tree that was built");
    }

    #[test]
    fn stages_stand_in_their_order_beside_the_whole_build() {
        let passes = [("collapse", 1.5), ("tree", 13.5), ("sort", 2.5)].map(|(name, ms)| (name.to_owned(), ms));
        let row = Measurement { build_stages_ms: passes.into(), ..sample() };
        let without = Measurement { builder: "none".to_owned(), ..sample() };
        let table = stages_table(&[row, sample(), without]);
        let columns: Vec<&str> = table.columns.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(columns, ["scene", "container", "sort", "tree", "collapse", "build", "spread"]);
        let expected = [
            ["thing.obj", "box", "2.500", "13.50", "1.500", "20.00", "30"],
            ["thing.obj", "box", "2.500", "13.50", "", "20.00", "30"],
        ];
        assert_eq!(table.rows, expected);
    }

    #[test]
    fn a_run_without_tree_is_a_note() {
        let notes = trees_table(&rows()).notes;
        let expected =
            "thing.obj without BVH: 211 of 10,403 pixels, evenly spread, in 7.500 ms; 41.00 tests per ray.".to_owned();
        assert_eq!(notes.last(), Some(&expected));
    }
}
