//! The paper's tables 1 and 2: box, sphere and, where they were measured, polytope side by side with their ratios, and the paper's own
//! numbers below.

use super::aligned::ReportTable;
use super::findings::findings;
use super::format::{
    COSTS_DO_NOT_COMPARE, TESTS, TRACE, conditions_and_threads, name_among, number, spread, spread_note,
};
use super::lists::list_table;
use crate::catalog::numbers::Number;
use crate::catalog::numbers::rows::{BUILD_MS, MRAYS_PER_S, RAYS, TESTS_PER_ENTERING_RAY, TESTS_PER_RAY, TRACE_MS};
use crate::lab::measurement::{Measurement, ModelView, model_views};
use crate::lab::paper::{MEAN_RATIOS, PaperScene, scene_of};
use crate::lab::verdict::{Verdict, judge_rows};
use crate::text::{count, counted};
use bvhscope_engine::tree::ContainerKind;

/// A number with the name and unit of its column.
type Column = (&'static str, &'static str, &'static Number);

/// Table 1, table 2, build times by stage, and tree statistics.
pub(super) fn bench_tables(rows: &[Measurement]) -> Vec<ReportTable> {
    let times: [Column; 2] = [("build", "ms", BUILD_MS), ("trace", "ms", TRACE_MS)];
    let tests: [Column; 2] = [("all", "tests/ray", TESTS_PER_RAY), ("entering", "tests/ray", TESTS_PER_ENTERING_RAY)];
    let papers_times = |paper: &PaperScene| vec![Some(paper.build_ms), Some(paper.trace_ms)];
    let papers_tests = |paper: &PaperScene| vec![Some(paper.tests_per_ray), None];
    let [build, trace, all] = MEAN_RATIOS;
    let mut of_times = pairs_table("Build and trace time", rows, &times, &papers_times, &[Some(build), Some(trace)]);
    of_times.notes.push(TRACE.to_owned());
    of_times.notes.extend(conclusions(rows));
    let mut of_tests = pairs_table("Intersection tests per ray", rows, &tests, &papers_tests, &[Some(all), None]);
    of_tests.notes.push(TESTS.to_owned());
    of_tests.notes.extend(findings(rows));
    vec![of_times, of_tests, stages_table(rows), trees_table(rows)]
}

/// The containers that have columns: the paper's, and others that were measured.
fn kinds_of(rows: &[Measurement]) -> Vec<ContainerKind> {
    let is_shown =
        |kind: &ContainerKind| ContainerKind::OF_PAPER.contains(kind) || rows.iter().any(|row| row.container == *kind);
    ContainerKind::WITH_ORIENTED.into_iter().filter(is_shown).collect()
}

/// One line per model with each container and the box's ratio to each other one for each value; below it its trees from files and the
/// paper's numbers; means at the end.
fn pairs_table(
    title: &str,
    rows: &[Measurement],
    values: &[Column],
    papers: &dyn Fn(&PaperScene) -> Vec<Option<[f64; 2]>>,
    papers_means: &[Option<f64>],
) -> ReportTable {
    let title = format!("{title} ({})", conditions_and_threads(rows));
    let mut table = ReportTable::new(title, &[("scene", ""), ("triangles", "")]);
    let kinds = kinds_of(rows);
    for (name, unit, _) in values {
        table.columns.extend(kinds.iter().map(|kind| (format!("{name} {}", kind.name()), (*unit).to_owned())));
        table.columns.extend(kinds[1..].iter().map(|kind| ("ratio".to_owned(), format!("box:{:.3}", kind.name()))));
    }
    let others = kinds.len() - 1;
    let is_measured = ContainerKind::OF_PAPER.map(|kind| rows.iter().any(|row| row.container == kind));
    let mut ratios: Vec<Vec<f64>> = vec![Vec::new(); values.len() * others];
    let mut any_paper = false;
    let models = model_views(rows);
    for model in &models {
        let of_model = || rows.iter().filter(|row| row.view() == *model);
        let is_built = |row: &&Measurement| row.builder != "none" && row.tree.is_none();
        let built: Vec<Option<&Measurement>> =
            kinds.iter().map(|kind| of_model().filter(is_built).find(|row| row.container == *kind)).collect();
        let line = scene_line(name_among(*model, &models), &built, values, &mut ratios);
        table.rows.push(line);
        table.rows.extend(of_model().filter_map(|row| file_line(row, values, &kinds)));
        if let Some(paper) = scene_of(model.model) {
            any_paper = true;
            table.rows.push(papers_line(paper.name, &papers(paper), is_measured, others));
        }
    }
    let mean = |label: &str, means: &mut dyn Iterator<Item = Option<f64>>| {
        let mut line = vec![label.to_owned(), String::new()];
        for _ in values {
            line.extend(kinds.iter().map(|_| String::new()));
            line.extend(means.take(others).map(|mean| mean.map_or_else(String::new, |mean| format!("{mean:.2}"))));
        }
        line
    };
    // The mean of a single scene's ratio is the ratio.
    if models.len() > 1 && ratios.iter().any(|ratios| !ratios.is_empty()) {
        let mut means =
            ratios.iter().map(|list| (!list.is_empty()).then(|| list.iter().sum::<f64>() / list.len() as f64));
        table.rows.push(mean("mean of the ratios", &mut means));
        if any_paper {
            let of_others = |mean: &Option<f64>| std::iter::once(*mean).chain(std::iter::repeat_n(None, others - 1));
            table.rows.push(mean("  the paper's mean", &mut papers_means.iter().flat_map(of_others)));
        }
    }
    table
}

/// The line of a scene, of which these trees were `built`, the box's first; adds the ratios to `ratios`.
fn scene_line(name: String, built: &[Option<&Measurement>], values: &[Column], ratios: &mut [Vec<f64>]) -> Vec<String> {
    let triangles = built.iter().flatten().next().map_or_else(String::new, |row| count(row.triangles as u64));
    let mut line = vec![name, triangles];
    for ((_, _, column), ratios) in values.iter().zip(ratios.chunks_mut(built.len() - 1)) {
        let numbers: Vec<Option<f64>> = built.iter().map(|row| row.map(|row| row.number(column))).collect();
        line.extend(numbers.iter().map(|value| value.map_or_else(String::new, number)));
        for (other, ratios) in numbers[1..].iter().zip(ratios) {
            let ratio = numbers[0].zip(*other).filter(|(_, other)| *other > 0.0).map(|(boxes, other)| boxes / other);
            ratios.extend(ratio);
            line.push(ratio.map_or_else(String::new, |ratio| format!("{ratio:.2}")));
        }
    }
    line
}

/// The paper's numbers of a scene for boxes and spheres, as far as each `is_measured` here too, with `others` ratios for each value.
fn papers_line(name: &str, pairs: &[Option<[f64; 2]>], is_measured: [bool; 2], others: usize) -> Vec<String> {
    let mut line = vec![format!("  the paper's {name}"), String::new()];
    let shown = |text: String, is_shown: bool| if is_shown { text } else { String::new() };
    for pair in pairs {
        let [a, b, ratio] = match pair {
            Some([a, b]) => [format!("{a}"), format!("{b}"), format!("{:.2}", a / b)],
            None => [const { String::new() }; 3],
        };
        line.extend([shown(a, is_measured[0]), shown(b, is_measured[1])]);
        line.extend(std::iter::repeat_n(String::new(), others - 1));
        line.push(shown(ratio, is_measured == [true; 2]));
        line.extend(std::iter::repeat_n(String::new(), others - 1));
    }
    line
}

/// A sentence for each model and each container beside the box: which is better, by how much.
fn conclusions(rows: &[Measurement]) -> Vec<String> {
    let models = model_views(rows);
    let others = ContainerKind::WITH_ORIENTED.into_iter().filter(|kind| *kind != ContainerKind::Aabb);
    let pairs = models.iter().flat_map(|model| others.clone().map(move |other| (*model, other)));
    let sentence = |(model, other): (ModelView<'_>, ContainerKind)| {
        let built = |row: &&Measurement| row.view() == model && row.builder != "none" && row.tree.is_none();
        let of = |kind| rows.iter().filter(built).find(|row| row.container == kind);
        let pair = [of(ContainerKind::Aabb)?, of(other)?];
        let parts = [
            ("build", BUILD_MS),
            ("tracing (Mray/s)", MRAYS_PER_S),
            ("tests per entering ray", TESTS_PER_ENTERING_RAY),
        ];
        let parts: Vec<String> =
            parts.iter().filter_map(|(name, number)| better_container(name, number, pair)).collect();
        let what = if ContainerKind::OF_PAPER.contains(&other) {
            String::new()
        } else {
            format!(", boxes and {}", other.plural())
        };
        (!parts.is_empty()).then(|| format!("{}{what}: {}.", name_among(model, &models), parts.join(", ")))
    };
    pairs.filter_map(sentence).collect()
}

/// "build 2.86 times as fast with boxes", "tests per entering ray 66 times as many with spheres".
fn better_container(name: &str, number: &Number, [boxes, others]: [&Measurement; 2]) -> Option<String> {
    let [of_boxes, of_others] = [boxes, others].map(|row| row.number(number));
    let ratio = of_others.max(of_boxes) / of_others.min(of_boxes);
    let compared = number.compared?;
    let (verdict, factor) = judge_rows(number, others, boxes);
    let over = factor.map_or_else(String::new, |factor| format!(" over {}", counted(factor.count as u64, "rounds")));
    let (better, worse) = match verdict {
        Verdict::Better => (boxes, others),
        Verdict::Worse => (others, boxes),
        Verdict::Once => return ratio.is_finite().then(|| format!("{name} measured once")),
        Verdict::Same => return Some(format!("{name} the same")),
        Verdict::Undecided => return Some(format!("{name} not decided{over}")),
        Verdict::Different => return None,
    };
    // Of pairs, as the verdict is.
    let ratio = factor.map_or(ratio, |factor| factor.median.max(1.0 / factor.median));
    let times = if ratio >= 10.0 { format!("{ratio:.0}") } else { format!("{ratio:.2}") };
    let (word, row) = if compared.is_timed { ("fast", better) } else { ("many", worse) };
    ratio.is_finite().then(|| format!("{name} {times} times as {word} with {}{over}", row.container.plural()))
}

/// The line of a tree from a file, under its kind of container; `None` for a tree that was built.
fn file_line(row: &Measurement, values: &[Column], kinds: &[ContainerKind]) -> Option<Vec<String>> {
    let mut line = vec![format!("  {}", row.file_name()?), String::new()];
    for (_, _, column) in values {
        let of_kind =
            |kind: &ContainerKind| if row.container == *kind { number(row.number(column)) } else { String::new() };
        line.extend(kinds.iter().map(of_kind));
        line.extend(kinds[1..].iter().map(|_| String::new()));
    }
    Some(line)
}

/// The stages of an AAC build in order; stages of other builders follow.
const STAGES: [&str; 5] = ["bounds", "codes", "sort", "tree", "flatten"];

/// Build times by stage.
fn stages_table(rows: &[Measurement]) -> ReportTable {
    let mut stages: Vec<&str> = STAGES.to_vec();
    for name in rows.iter().flat_map(|row| row.stages_ms().into_keys()) {
        if !stages.contains(&name) {
            stages.push(name);
        }
    }
    stages.retain(|name| rows.iter().any(|row| row.stages_ms().contains_key(*name)));
    let mut table = ReportTable::new("Build time by stage", &[("scene", ""), ("container", "")]);
    table.columns.extend(stages.iter().map(|name| ((*name).to_owned(), "ms".to_owned())));
    table.columns.extend([("build", "ms"), ("spread", "%")].map(|(name, unit)| (name.to_owned(), unit.to_owned())));
    let models = model_views(rows);
    for row in rows.iter().filter(|row| row.builder != "none" && row.tree.is_none()) {
        let mut line = vec![name_among(row.view(), &models), row.container.name().to_owned()];
        let times = row.stages_ms();
        line.extend(stages.iter().map(|name| times.get(*name).map_or_else(String::new, |ms| number(*ms))));
        line.extend([number(row.number(BUILD_MS)), spread(row, BUILD_MS)]);
        table.rows.push(line);
    }
    table.notes.push(format!("Each stage's own median. {}", spread_note(rows)));
    table
}

/// Tree statistics, with a note about the run without BVH.
fn trees_table(rows: &[Measurement]) -> ReportTable {
    let mut table = ReportTable { title: "The trees".to_owned(), ..list_table("", rows) };
    if rows.iter().any(|row| row.container != rows[0].container) {
        table.notes.push(COSTS_DO_NOT_COMPARE.to_owned());
    }
    let models = model_views(rows);
    for row in rows.iter().filter(|row| row.builder == "none") {
        let pixels = u64::from(row.width_px) * u64::from(row.height_px);
        table.notes.push(format!(
            "{} without BVH: {} of {} pixels, evenly spread, in {} ms; {} tests per ray.",
            name_among(row.view(), &models),
            count(row.values.count(RAYS)),
            count(pixels),
            number(row.number(TRACE_MS)),
            number(row.number(TESTS_PER_RAY))
        ));
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::numbers::rows::{BUILD_STAGES_MS, TREE_HASH};
    use crate::lab::sample::sample;

    fn row(model: &str, container: ContainerKind, build_ms: f64, trace_ms: f64, tests_per_ray: f64) -> Measurement {
        Measurement { model: model.to_owned(), container, ..sample() }
            .with(BUILD_MS, build_ms)
            .with(TRACE_MS, trace_ms)
            .with(TESTS_PER_RAY, tests_per_ray)
            .with(TESTS_PER_ENTERING_RAY, tests_per_ray)
            .with(TREE_HASH, container.name())
    }

    fn rows() -> Vec<Measurement> {
        let (boxes, spheres) = (ContainerKind::Aabb, ContainerKind::Sphere);
        vec![
            row("builtin:teapot", boxes, 20.0, 50.0, 30.0),
            row("builtin:teapot", spheres, 40.0, 500.0, 120.0),
            row("thing.obj", spheres, 20.0, 40.0, 20.0),
            row("thing.obj", boxes, 30.0, 60.0, 35.0),
            Measurement { builder: "none".to_owned(), ..row("thing.obj", boxes, 1.0, 7.5, 41.0) }.with(RAYS, 211),
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
            ["teapot", "7,001", "20.00", "40.00", "0.50", "50.00", "500.0", "0.10"],
            ["  the paper's teapot", "", "92", "126", "0.73", "626", "3985", "0.16"],
            ["thing.obj", "7,001", "30.00", "20.00", "1.50", "60.00", "40.00", "1.50"],
            ["mean of the ratios", "", "", "", "1.00", "", "", "0.80"],
            ["  the paper's mean", "", "", "", "0.77", "", "", "0.14"],
        ];
        assert_eq!(times.rows, expected);
        let of_all: Vec<&[String]> = tests.rows.iter().map(|row| &row[2..5]).collect();
        let expected = [["30.00", "120.0", "0.25"], ["19", "49", "0.39"], ["35.00", "20.00", "1.75"]];
        assert_eq!(of_all[..3], expected);
        assert_eq!(of_all[3..], [["", "", "1.00"], ["", "", "0.35"]]);
        let names: Vec<String> = tests.columns[5..].iter().map(|(name, unit)| format!("{name} {unit}")).collect();
        assert_eq!(names, ["entering box tests/ray", "entering sphere tests/ray", "ratio box:sph"]);
        assert_eq!(tests.rows[2][5..], ["35.00", "20.00", "1.75"]);
    }

    #[test]
    fn a_sentence_names_the_better_container() {
        let of = |container, build: [f64; 3], tests| {
            let mut row = row("thing.obj", container, build[0], 50.0, tests);
            let rounds = (0..8).map(|round| build[1 + round % 2]).collect();
            row.rounds = [("build_ms".to_owned(), rounds), ("wide_trace_ms".to_owned(), vec![4.0, 5.0, 4.0])].into();
            row
        };
        let rows =
            [of(ContainerKind::Aabb, [30.0, 29.0, 31.0], 20.0), of(ContainerKind::Sphere, [15.0, 14.5, 15.5], 50.0)];
        let expected = "thing.obj: build 2.00 times as fast with spheres over 8 rounds, tracing (Mray/s) not decided over 3 rounds, tests \
                        per entering ray 2.50 times as many with spheres.";
        assert_eq!(conclusions(&rows), [expected]);
        let slow = of(ContainerKind::Sphere, [1989.0, 1980.0, 1999.0], 20.0);
        let text = conclusions(&[rows[0].clone(), slow]).concat();
        assert!(text.contains("build 66 times as fast with boxes over 8 rounds, "), "{text}");
        assert!(trees_table(&rows).notes.iter().any(|note| note.contains("do not compare")));
        assert_eq!(conclusions(&rows[..1]), Vec::<String>::new());
    }

    #[test]
    fn polytopes_have_columns_where_they_were_measured() {
        let dops = row("thing.obj", ContainerKind::Dop14, 120.0, 40.0, 7.0);
        let all: Vec<Measurement> = rows().into_iter().chain([dops]).collect();
        let [times, ..] = &bench_tables(&all)[..] else { unreachable!("there are four tables") };
        let columns: Vec<&str> = times.columns[2..7].iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(columns, ["build box", "build sphere", "build dop", "ratio", "ratio"]);
        assert_eq!([&times.columns[5].1, &times.columns[6].1], ["box:sph", "box:dop"]);
        let expected = [
            ["teapot", "7,001", "20.00", "40.00", "", "0.50", "", "50.00", "500.0", "", "0.10", ""],
            ["  the paper's teapot", "", "92", "126", "", "0.73", "", "626", "3985", "", "0.16", ""],
            [
                "thing.obj",
                "7,001",
                "30.00",
                "20.00",
                "120.0",
                "1.50",
                "0.25",
                "60.00",
                "40.00",
                "40.00",
                "1.50",
                "1.50",
            ],
            ["mean of the ratios", "", "", "", "", "1.00", "0.25", "", "", "", "0.80", "1.50"],
            ["  the paper's mean", "", "", "", "", "0.77", "", "", "", "", "0.14", ""],
        ];
        assert_eq!(times.rows, expected);
        assert!(conclusions(&all).iter().any(|text| text.starts_with("thing.obj, boxes and 14-DOPs: build ")));
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
        let row = sample().with(BUILD_STAGES_MS, serde_json::json!({"collapse": 1.5, "tree": 13.5, "sort": 2.5}));
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
