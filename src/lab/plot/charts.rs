//! Measurements to charts: the plots of each command.

use super::axis::Axis;
use super::chart::{Chart, Curve, Look, Point};
use super::policies::policy_charts;
use super::scaling::scaling_charts;
use super::series::{curves, series_name, value_axis};
use crate::catalog::numbers::rows::BUILD_MS;
use crate::catalog::numbers::{NUMBERS, Number};
use crate::catalog::settings::THRESHOLD;
use crate::lab::measurement::{Measurement, model_views};
use crate::lab::report_table::name_among;
use bvhscope_engine::tree::ContainerKind;

/// The numbers that have an axis, each with its label.
fn quantities() -> impl Iterator<Item = (&'static Number, &'static str)> {
    NUMBERS.iter().filter_map(|number| Some((number, number.axis?)))
}

/// Threshold at which relative curves are 1, if it was measured: the paper's fast setting.
const BASE_THRESHOLD: f64 = 6.0;
/// Maximum number of series with relative charts: the number of scenes in the paper. More would make the plot too long.
const MAX_RELATIVE: usize = 6;
/// Colour of the first relative curve. They are other quantities than those of other charts, so their colours differ.
const RELATIVE_COLOR: usize = 3;

/// The charts of the measurements of one command. A sweep shows the paper's three relative curves and each quantity against the
/// threshold, with trees from files as lines across; scaling shows speed-up and efficiency; the others show each quantity by
/// scene or by builder, a row each.
pub fn charts(rows: &[Measurement]) -> Result<Vec<Chart>, String> {
    let Some(first) = rows.first() else { return Err("there are no rows to draw".to_owned()) };
    if let Some(other) = rows.iter().find(|row| row.command != first.command) {
        return Err(format!("rows of '{}' and of '{}' do not go into one plot", first.command, other.command));
    }
    let models = model_views(rows);
    let name = |row: &Measurement| name_among(row.view(), &models);
    match first.command.as_str() {
        "sweep" => Ok(sweep_charts(rows)),
        "scaling" => Ok(scaling_charts(rows)),
        "animate" => Ok(policy_charts(rows)),
        "bench" => Ok(row_charts(rows, false, name, |row| {
            row.file_name().unwrap_or_else(|| row.container.plural().to_owned())
        })),
        command @ ("compare" | "diff") => {
            Ok(row_charts(rows, command == "compare", Measurement::name, |row| series_name(row, rows)))
        }
        other => Err(format!("there is no plot of '{other}'")),
    }
}

/// The readings that some row has, with the rows that each chart of them shows: of a reading that does not compare across containers, one chart each.
fn readings(rows: &[Measurement]) -> Vec<(&'static Number, String, Option<ContainerKind>)> {
    let kinds: Vec<ContainerKind> =
        ContainerKind::WITH_ORIENTED.into_iter().filter(|kind| rows.iter().any(|row| row.container == *kind)).collect();
    let of_number = |(number, label): (&'static Number, &str)| {
        let chart = |kind: &ContainerKind| (number, format!("{label}, {}", kind.plural()), Some(*kind));
        if number.compared.is_some_and(|compared| !compared.across_containers) && kinds.len() > 1 {
            kinds.iter().map(chart).collect()
        } else {
            vec![(number, label.to_owned(), None)]
        }
    };
    let is_known = |(number, _): &(&Number, &str)| rows.iter().any(|row| row.values.known(number).is_some());
    quantities().filter(is_known).flat_map(of_number).collect()
}

/// Value and spread of a row, if both are known and the row is of the container, if any.
fn read(row: &Measurement, number: &Number, container: Option<ContainerKind>) -> Option<(f64, Option<[f64; 2]>)> {
    let value = row.values.known(number).filter(|_| container.is_none_or(|container| row.container == container))?;
    Some((value, row.values.spread(number)))
}

/// An axis on which all values across are.
fn across(curves: &[Curve]) -> Axis {
    Axis::whole(curves.iter().flat_map(|curve| &curve.points).map(|point| point.x))
}

const THRESHOLD_LABEL: &str = "Threshold δ (primitives)";

/// The threshold of a row; of one without, as of a tree from a file, that of the paper's fast setting.
fn threshold(row: &Measurement) -> f64 {
    row.settings.number(&THRESHOLD).unwrap_or(BASE_THRESHOLD)
}

fn sweep_charts(rows: &[Measurement]) -> Vec<Chart> {
    let series = |row: &Measurement| row.file_name().unwrap_or_else(|| series_name(row, rows));
    let absolute = readings(rows).into_iter().map(|(reading, label, container)| {
        let mut curves = curves(rows, series, |row| {
            let (y, spread) = read(row, reading, container)?;
            Some(Point { x: threshold(row), y, spread, row: None })
        });
        let ends = threshold_ends(rows);
        for curve in &mut curves {
            widen_files(curve, rows, ends);
        }
        let axes = [across(&curves), value_axis(&curves, |point| point.y)];
        Chart { title: String::new(), labels: [THRESHOLD_LABEL.to_owned(), label], axes, curves, rows: Vec::new() }
    });
    let absolute: Vec<Chart> = absolute.collect();
    let is_measured = |curve: &&Curve| curve.points.iter().any(|point| row_of(rows, point).is_some_and(is_built));
    let all: Vec<&Curve> = absolute.first().into_iter().flat_map(|chart| &chart.curves).filter(is_measured).collect();
    let relative: Vec<Chart> = if all.len() <= MAX_RELATIVE {
        all.into_iter().filter_map(|series| relative_chart(rows, series)).collect()
    } else {
        Vec::new()
    };
    relative.into_iter().chain(absolute).collect()
}

fn is_built(row: &Measurement) -> bool {
    row.tree.is_none()
}

fn row_of<'a>(rows: &'a [Measurement], point: &Point) -> Option<&'a Measurement> {
    rows.get(point.row?)
}

/// The smallest and the largest threshold; the paper's fast setting where none was measured.
fn threshold_ends(rows: &[Measurement]) -> [f64; 2] {
    let thresholds = || rows.iter().filter(|row| is_built(row)).map(threshold);
    let [low, high] = [thresholds().fold(f64::INFINITY, f64::min), thresholds().fold(f64::NEG_INFINITY, f64::max)];
    if low <= high { [low, high] } else { [BASE_THRESHOLD; 2] }
}

/// Makes the curve of a tree from a file, on which thresholds have no influence, a line across all thresholds.
fn widen_files(curve: &mut Curve, rows: &[Measurement], ends: [f64; 2]) {
    if let Some(point) = curve.points.first().copied().filter(|point| !row_of(rows, point).is_some_and(is_built)) {
        curve.points = ends.map(|x| Point { x, ..point }).to_vec();
    }
}

/// The paper's figures 9 and 10: build time, trace time and tests per ray of one series against the threshold, in one pair of
/// axes. Their units differ, so each is relative to its value at the paper's fast setting.
fn relative_chart(rows: &[Measurement], series: &Curve) -> Option<Chart> {
    let row_of = |point: &Point| row_of(rows, point);
    let base =
        series.points.iter().filter_map(row_of).find(|row| row.settings.number(&THRESHOLD) == Some(BASE_THRESHOLD));
    let base = base.or_else(|| series.points.first().and_then(row_of))?;
    if series.points.len() < 2 {
        return None;
    }
    let curve = |(index, (number, label)): (usize, (&'static Number, &str))| Curve {
        name: label.split([',', '(']).next().unwrap_or(label).trim_end().to_owned(),
        color: RELATIVE_COLOR + index,
        look: Look::Measured,
        points: series
            .points
            .iter()
            .filter(|_| base.number(number) > 0.0)
            .filter_map(|point| {
                let y = row_of(point)?.number(number) / base.number(number);
                Some(Point { y, spread: None, ..*point })
            })
            .collect(),
    };
    let mut curves: Vec<Curve> = quantities().take(3).enumerate().map(curve).collect();
    curves.retain(|curve| !curve.points.is_empty());
    // One alone is in the chart of its quantity.
    (curves.len() > 1).then(|| Chart {
        title: series.name.clone(),
        labels: [THRESHOLD_LABEL.to_owned(), format!("Relative to δ = {}", threshold(base))],
        axes: [across(&curves), value_axis(&curves, |point| point.y)],
        curves,
        rows: Vec::new(),
    })
}

/// One chart per quantity, with a row for each name. If `sorted`, the fastest build is on top.
fn row_charts(
    rows: &[Measurement],
    sorted: bool,
    name: impl Fn(&Measurement) -> String,
    series: impl Fn(&Measurement) -> String,
) -> Vec<Chart> {
    let has_tree = |row: &&Measurement| row.builder != "none";
    let mut names: Vec<(String, f64)> = Vec::new();
    for row in rows.iter().filter(has_tree) {
        let (name, build_ms) = (name(row), row.values.known(BUILD_MS).unwrap_or(f64::INFINITY));
        match names.iter_mut().find(|(other, _)| *other == name) {
            Some((_, least)) => *least = least.min(build_ms),
            None => names.push((name, build_ms)),
        }
    }
    if sorted {
        names.sort_by(|a, b| a.1.total_cmp(&b.1));
    }
    // The first is on top.
    let names: Vec<String> = names.into_iter().rev().map(|(name, _)| name).collect();
    let chart = |(reading, label, container): (&'static Number, String, Option<ContainerKind>)| {
        let value = |row: &Measurement| read(Some(row).filter(has_tree)?, reading, container);
        // A chart of one kind of container has no empty rows for those that were measured with others.
        let has_value =
            |of: &&String| container.is_none() || rows.iter().any(|row| name(row) == **of && value(row).is_some());
        let names: Vec<String> = names.iter().filter(has_value).cloned().collect();
        let curves = curves(rows, &series, |row| {
            let (x, spread) = value(row)?;
            let name = name(row);
            let y = names.iter().position(|other| *other == name)? as f64;
            Some(Point { x, y, spread, row: None })
        });
        // A single point beside no other that compares with it shows nothing.
        let is_alone = container.is_some() && curves.iter().map(|curve| curve.points.len()).sum::<usize>() < 2;
        let axes = [value_axis(&curves, |point| point.x), Axis::of_rows(names.len())];
        let chart = Chart { title: String::new(), labels: [label, String::new()], axes, curves, rows: names };
        (!is_alone).then_some(chart)
    };
    readings(rows).into_iter().filter_map(chart).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::catalog::numbers::rows::{SPEEDUP, TESTS_PER_ENTERING_RAY, TRACE_MS, TRACE_SPEEDUP};
    use crate::catalog::settings::Stated;
    use crate::lab::sample::sample;

    /// Name of each curve, and its values from left to right.
    fn values(panel: &Chart) -> Vec<(&str, Vec<(f64, f64)>)> {
        let curve = |curve: &Curve| curve.points.iter().map(|point| (point.x, point.y)).collect();
        panel.curves.iter().map(|one| (one.name.as_str(), curve(one))).collect()
    }

    fn of_threshold(threshold: u32) -> Measurement {
        let settings = sample().settings.with(&THRESHOLD, &threshold.to_string());
        Measurement { command: "sweep".to_owned(), settings, ..sample() }
    }

    #[test]
    fn relative_curves_are_one_at_the_papers_fast_setting() {
        let row = |threshold, build_ms: f64, trace_ms: f64, tests: f64| {
            of_threshold(threshold)
                .with(BUILD_MS, build_ms)
                .with(TRACE_MS, trace_ms)
                .with(TESTS_PER_ENTERING_RAY, tests)
        };
        let rows = [row(8, 10.0, 75.0, 14.0), row(4, 30.0, 25.0, 56.0), row(6, 20.0, 50.0, 28.0)];
        let all = charts(&rows).unwrap();
        let [relative, build, trace, tests, _, cost] = &all[..] else { unreachable!("{all:?}") };
        assert_eq!(relative.labels[1], "Relative to δ = 6");
        let expected = [
            ("Build time", vec![(4.0, 1.5), (6.0, 1.0), (8.0, 0.5)]),
            ("Trace time", vec![(4.0, 0.5), (6.0, 1.0), (8.0, 1.5)]),
            ("Tests per entering ray", vec![(4.0, 2.0), (6.0, 1.0), (8.0, 0.5)]),
        ];
        assert_eq!(values(relative), expected);
        let series = "thing.obj, boxes";
        assert_eq!(values(build), [(series, vec![(4.0, 30.0), (6.0, 20.0), (8.0, 10.0)])]);
        assert_eq!(values(trace), [(series, vec![(4.0, 25.0), (6.0, 50.0), (8.0, 75.0)])]);
        assert_eq!(values(tests), [(series, vec![(4.0, 56.0), (6.0, 28.0), (8.0, 14.0)])]);
        assert_eq!(values(cost), [(series, vec![(4.0, 67.3), (6.0, 67.3), (8.0, 67.3)])]);
        let spreads = |panel: &Chart| panel.curves[0].points[0].spread;
        assert_eq!([build, trace, tests, cost].map(spreads), [Some([17.0, 23.0]), Some([47.0, 61.0]), None, None]);
        let labels = [build, trace, tests, cost].map(|panel| panel.labels[1].as_str());
        assert_eq!(labels, ["Build time (ms)", "Trace time, binary tree (ms)", "Tests per entering ray", "SAH cost"]);
        assert_eq!(build.curves[0].points[0].row, Some(1), "the second row has the smallest threshold");
    }

    #[test]
    fn a_tree_from_a_file_is_a_line_across_a_sweep() {
        let row = |threshold, build_ms: f64| of_threshold(threshold).with(BUILD_MS, build_ms);
        let unknown = Measurement { settings: Stated::default(), ..row(6, f64::NAN) };
        let file = Measurement { tree: Some("a/mine.bvh".to_owned()), ..unknown }.with(TESTS_PER_ENTERING_RAY, 9.0);
        let all = charts(&[row(2, 10.0), file, row(8, 30.0)]).unwrap();
        let [relative, build, _, tests, ..] = &all[..] else { unreachable!("{all:?}") };
        assert_eq!(relative.curves.len(), 3);
        assert_eq!(values(build), [("thing.obj, boxes", vec![(2.0, 10.0), (8.0, 30.0)])], "its time is not known");
        assert_eq!(values(tests)[1], ("mine.bvh (aac)", vec![(2.0, 9.0), (8.0, 9.0)]));
        assert_eq!(tests.curves[1].points[0].row, Some(1));
    }

    #[test]
    fn efficiency_is_the_speed_up_for_each_thread() {
        let row = |threads, speedup: f64, trace_speedup: Option<f64>| {
            Measurement { command: "scaling".to_owned(), threads, predicted_scaling: None, ..sample() }
                .with(SPEEDUP, speedup)
                .with(TRACE_SPEEDUP, trace_speedup.unwrap_or(f64::NAN))
        };
        let all = charts(&[row(1, 1.0, Some(1.0)), row(2, 1.5, Some(1.75)), row(4, 3.0, None)]).unwrap();
        let [speedups, efficiencies] = &all[..] else { unreachable!("{all:?}") };
        let (build, trace) = ("build, thing.obj, boxes", "trace, thing.obj, boxes");
        let expected = [
            ("ideal", vec![(1.0, 1.0), (4.0, 4.0)]),
            (build, vec![(1.0, 1.0), (2.0, 1.5), (4.0, 3.0)]),
            (trace, vec![(1.0, 1.0), (2.0, 1.75)]),
        ];
        assert_eq!(values(speedups), expected);
        let expected = [
            ("ideal", vec![(1.0, 100.0), (4.0, 100.0)]),
            (build, vec![(1.0, 100.0), (2.0, 75.0), (4.0, 75.0)]),
            (trace, vec![(1.0, 100.0), (2.0, 87.5)]),
        ];
        assert_eq!(values(efficiencies), expected);
        // 30 ms on one thread, and 17 to 23 ms in the repetitions on two.
        assert_eq!(speedups.curves[1].points[1].spread, Some([30.0 / 23.0, 30.0 / 17.0]));
    }

    #[test]
    fn a_prediction_is_drawn_with_its_bounds() {
        let row = |threads| Measurement { command: "scaling".to_owned(), threads, ..sample() };
        let all = charts(&[row(1), Measurement { predicted_scaling: None, ..row(2) }]).unwrap();
        let [speedups, efficiencies] = &all[..] else { unreachable!("{all:?}") };
        let names: Vec<&str> = speedups.curves.iter().map(|curve| curve.name.as_str()).collect();
        let series = ["ready to trace predicted", "trace predicted", "build", "trace"]
            .map(|what| format!("{what}, thing.obj, boxes"));
        assert_eq!(names, [&["ideal".to_owned()], &series[..]].concat());
        assert_eq!(speedups.curves[1].color, speedups.curves[3].color, "as the build that was measured");
        assert_eq!(values(speedups)[1].1, [(1.0, 1.0), (2.0, 1.75), (8.0, 5.5)]);
        assert_eq!(values(speedups)[0].1, [(1.0, 1.0), (8.0, 8.0)], "the ideal reaches as far");
        assert_eq!(speedups.curves[1].points[2].spread, Some([3.5, 7.25]));
        assert_eq!(values(efficiencies)[2].1, [(1.0, 100.0), (2.0, 87.5), (8.0, 68.75)]);
    }

    #[test]
    fn compared_builders_are_sorted_by_build_time() {
        let row = |builder: &str, build_ms: f64| {
            let row = Measurement {
                command: "compare".to_owned(),
                builder: builder.to_owned(),
                preset: None,
                settings: Stated::default(),
                ..sample()
            };
            row.with(BUILD_MS, build_ms)
        };
        let build = &charts(&[row("aac", 9.0), row("lbvh", 1.0), row("unknown", f64::NAN)]).unwrap()[0];
        assert_eq!(build.rows, ["unknown", "aac", "lbvh"], "from below");
        let figure = crate::lab::plot::Figure::of_rows(&[row("aac", 9.0)]).unwrap();
        assert!(figure.notes[0].starts_with("thing.obj, 7,001 triangles, clip 'run', boxes."), "{:?}", figure.notes);
        assert_eq!(figure.notes[1], "On abacus, bvhscope 0.0.1.");
        assert_eq!(figure.notes[2], "Thin lines run between the quartiles of the rounds.");
    }

    #[test]
    fn a_bench_has_a_point_for_each_scene_that_has_a_tree() {
        let row = |model: &str, container, build_ms: f64, builder: &str| {
            Measurement { model: model.to_owned(), container, builder: builder.to_owned(), ..sample() }
                .with(BUILD_MS, build_ms)
        };
        let (boxes, spheres) = (ContainerKind::Aabb, ContainerKind::Sphere);
        let rows = [
            row("a.obj", boxes, 3.0, "aac"),
            row("a.obj", boxes, 5.0, "none"),
            row("b.obj", boxes, 7.0, "aac"),
            row("a.obj", spheres, 13.0, "aac"),
            row("b.obj", spheres, 11.0, "aac"),
            row("c.obj", boxes, 9.0, "aac"),
            row("c.obj", ContainerKind::Dop14, 17.0, "aac"),
        ];
        let all = charts(&rows).unwrap();
        let [build, .., boxes, spheres] = &all[..] else { panic!("{all:?}") };
        assert_eq!(build.rows, ["c.obj", "b.obj", "a.obj"], "the first is on top");
        let of_boxes = ("boxes", vec![(3.0, 2.0), (7.0, 1.0), (9.0, 0.0)]);
        let of_spheres = ("spheres", vec![(11.0, 1.0), (13.0, 2.0)]);
        assert_eq!(values(build), [of_boxes, of_spheres, ("14-DOPs", vec![(17.0, 0.0)])]);
        assert_eq!([boxes, spheres].map(|chart| chart.rows.len()), [3, 2], "no empty row, and no chart of one point");
        // SAH costs of boxes and spheres do not compare, so no axis has both.
        assert_eq!([&boxes.labels[0], &spheres.labels[0]], ["SAH cost, boxes", "SAH cost, spheres"]);
        assert_eq!([boxes, spheres].map(|chart| chart.curves.len()), [1, 1]);
        assert_eq!(spheres.curves[0].color, build.curves[1].color);
        let mixed = [rows[0].clone(), Measurement { command: "sweep".to_owned(), ..sample() }];
        assert!(charts(&mixed).is_err() && charts(&[]).is_err());
    }
}
