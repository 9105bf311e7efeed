//! Measurements to panels: which plots each command shows.

use super::panel::{Panel, PlotCurve, Point};
use crate::lab::measurement::Measurement;
use crate::lab::report_table::{models, name_among};
use crate::lab::speedup::prediction::PredictedScaling;

/// A quantity: its label with unit, its value, and the spread of the repetitions if it is a time.
type Quantity = (&'static str, fn(&Measurement) -> f64, Option<fn(&Measurement) -> [f64; 2]>);

const QUANTITIES: [Quantity; 4] = [
    ("Build time (ms)", |row| row.build_ms, Some(|row| row.build_ms_spread)),
    ("Trace time (ms)", |row| row.trace_ms, Some(|row| row.trace_ms_spread)),
    ("Tests per ray", |row| row.tests_per_ray, None),
    ("SAH cost", |row| row.sah_cost, None),
];

/// Threshold at which relative curves are 1, if it was measured: the paper's fast setting.
const BASE_THRESHOLD: u32 = 6;
/// Maximum number of series with relative panels: the number of scenes in the paper. More would make the plot too long.
const MAX_RELATIVE: usize = 6;

/// The panels of the measurements of one command. A sweep shows the paper's three relative curves and each quantity against the
/// threshold, with trees from files as lines across; scaling shows speed-up and efficiency; the others show each quantity by scene or by builder.
pub fn panels(rows: &[Measurement]) -> Result<Vec<Panel>, String> {
    let Some(first) = rows.first() else { return Err("there are no rows to draw".to_owned()) };
    if let Some(other) = rows.iter().find(|row| row.command != first.command) {
        return Err(format!("rows of '{}' and of '{}' do not go into one plot", first.command, other.command));
    }
    let models = models(rows);
    let name = |row: &Measurement| name_among(&row.model, &models);
    match first.command.as_str() {
        "sweep" => Ok(sweep_panels(rows)),
        "scaling" => Ok(scaling_panels(rows)),
        "bench" => {
            Ok(category_panels(rows, name, |row| row.file_name().unwrap_or_else(|| row.container.name().to_owned())))
        }
        "compare" => Ok(category_panels(rows, Measurement::builder_name, |row| series_name(row, rows))),
        other => Err(format!("there is no plot of '{other}'")),
    }
}

/// Scene, container and ε, each only if the rows differ in it.
fn series_name(row: &Measurement, rows: &[Measurement]) -> String {
    let mut parts = Vec::new();
    let models = models(rows);
    if models.len() > 1 {
        parts.push(name_among(&row.model, &models));
    }
    if rows.iter().any(|other| other.container != row.container) {
        parts.push(row.container.name().to_owned());
    }
    if row.command == "sweep" && rows.iter().any(|other| other.epsilon != row.epsilon) {
        parts.push(format!("ε = {}", row.epsilon));
    }
    if parts.is_empty() {
        parts.push(format!("{}, {}", name_among(&row.model, &models), row.container.name()));
    }
    parts.join(", ")
}

/// Groups rows into curves by name, in order of appearance, each sorted by x.
fn curves(
    rows: &[Measurement],
    name: impl Fn(&Measurement) -> String,
    point: impl Fn(&Measurement) -> Option<(f64, f64, Option<[f64; 2]>)>,
) -> Vec<PlotCurve> {
    let mut curves: Vec<PlotCurve> = Vec::new();
    for (index, row) in rows.iter().enumerate() {
        let Some((x, y, spread)) = point(row) else { continue };
        let name = name(row);
        let position = curves.iter().position(|curve| curve.name == name).unwrap_or_else(|| {
            curves.push(PlotCurve { name, points: Vec::new(), reference: false });
            curves.len() - 1
        });
        curves[position].points.push(Point { x, y, spread, row: Some(index) });
    }
    for curve in &mut curves {
        curve.points.sort_by(|a, b| a.x.total_cmp(&b.x));
    }
    curves
}

/// One panel per quantity.
fn quantity_panels(
    rows: &[Measurement],
    (x_label, categories): (&str, &[String]),
    series: impl Fn(&Measurement) -> String,
    x_of: impl Fn(&Measurement) -> Option<f64>,
) -> Vec<Panel> {
    let panel = |(label, value, spread): &Quantity| Panel {
        x_label: x_label.to_owned(),
        y_label: (*label).to_owned(),
        curves: curves(rows, &series, |row| {
            // What is not known has no point.
            let y = Some(value(row)).filter(|y| !y.is_nan())?;
            Some((x_of(row)?, y, spread.map(|spread| spread(row))))
        }),
        categories: categories.to_vec(),
        relative_of: None,
    };
    QUANTITIES.iter().map(panel).collect()
}

const THRESHOLD: &str = "Threshold δ (primitives)";

fn sweep_panels(rows: &[Measurement]) -> Vec<Panel> {
    let series = |row: &Measurement| series_name(row, rows);
    let threshold = |row: &Measurement| row.tree.is_none().then(|| f64::from(row.threshold));
    let mut absolute = quantity_panels(rows, (THRESHOLD, &[]), series, threshold);
    let Some(all) = absolute.first().map(|panel| panel.curves.clone()) else { return absolute };
    for (panel, quantity) in absolute.iter_mut().zip(&QUANTITIES) {
        panel.curves.extend(lines_across(rows, quantity));
    }
    let mut panels = Vec::new();
    if all.len() <= MAX_RELATIVE {
        panels.extend(all.iter().filter_map(|series| relative_panel(rows, series)));
    }
    panels.extend(absolute);
    panels
}

/// A quantity of the trees from files, on which thresholds have no influence, as lines across all thresholds.
fn lines_across(rows: &[Measurement], (_, value, spread): &Quantity) -> Vec<PlotCurve> {
    let thresholds = || rows.iter().filter(|row| row.tree.is_none()).map(|row| f64::from(row.threshold));
    let low = thresholds().fold(f64::INFINITY, f64::min);
    let high = thresholds().fold(f64::NEG_INFINITY, f64::max);
    // Without a sweep beside them they still have a place.
    let ends = if low <= high { [low, high] } else { [BASE_THRESHOLD.into(); 2] };
    let line = |(index, row): (usize, &Measurement)| {
        let y = Some(value(row)).filter(|y| !y.is_nan())?;
        let spread = spread.map(|spread| spread(row));
        let points = ends.map(|x| Point { x, y, spread, row: Some(index) }).to_vec();
        Some(PlotCurve { name: row.file_name()?, points, reference: false })
    };
    rows.iter().enumerate().filter_map(line).collect()
}

/// The paper's figures 9 and 10: build time, trace time and tests per ray of one series against the threshold, in one pair of
/// axes. Their units differ, so each is relative to its value at the paper's fast setting.
fn relative_panel(rows: &[Measurement], series: &PlotCurve) -> Option<Panel> {
    let row_of = |point: &Point| point.row.and_then(|row| rows.get(row));
    let base = series.points.iter().filter_map(row_of).find(|row| row.threshold == BASE_THRESHOLD);
    let base = base.or_else(|| series.points.first().and_then(row_of))?;
    if series.points.len() < 2 {
        return None;
    }
    let curve = |(label, value, _): &Quantity| PlotCurve {
        name: label.split(" (").next().unwrap_or(label).to_owned(),
        points: series
            .points
            .iter()
            .filter(|_| value(base) > 0.0)
            .filter_map(|point| Some(Point { y: value(row_of(point)?) / value(base), spread: None, ..*point }))
            .collect(),
        reference: false,
    };
    Some(Panel {
        x_label: THRESHOLD.to_owned(),
        y_label: format!("Relative to δ = {}", base.threshold),
        curves: QUANTITIES[..3].iter().map(curve).collect(),
        categories: Vec::new(),
        relative_of: Some(series.name.clone()),
    })
}

type Speedup = fn(&Measurement) -> Option<f64>;

fn scaling_panels(rows: &[Measurement]) -> Vec<Panel> {
    let predicted_cores = rows.iter().filter_map(|row| row.predicted_scaling.as_ref()?.build.curve.last());
    let most = rows.iter().map(|row| row.threads).chain(predicted_cores.map(|point| point.cores)).max();
    let most = most.unwrap_or(1) as f64;
    let point = |x, y| Point { x, y, spread: None, row: None };
    let both = |scale: &dyn Fn(usize) -> f64, ideal: Vec<Point>| {
        let speedups: [(&str, Speedup); 2] = [("build", |row| row.speedup), ("trace", |row| row.trace_speedup)];
        let mut list = Vec::new();
        for (what, speedup) in speedups {
            list.extend(curves(
                rows,
                |row| format!("{what}, {}", series_name(row, rows)),
                |row| Some((row.threads as f64, speedup(row)? * scale(row.threads), None)),
            ));
        }
        list.extend(predicted_curves(rows, scale));
        list.push(PlotCurve { name: "ideal".to_owned(), points: ideal, reference: true });
        list
    };
    let panel = |y_label: &str, curves| Panel {
        x_label: "Threads".to_owned(),
        y_label: y_label.to_owned(),
        curves,
        categories: Vec::new(),
        relative_of: None,
    };
    vec![
        panel("Speed-up over one thread (×)", both(&|_| 1.0, vec![point(1.0, 1.0), point(most, most)])),
        panel(
            "Parallel efficiency (%)",
            both(&|threads| 100.0 / threads.max(1) as f64, vec![point(1.0, 100.0), point(most, 100.0)]),
        ),
    ]
}

/// The predicted speed-ups with their bounds, multiplied by the `scale` of the number of cores.
fn predicted_curves(rows: &[Measurement], scale: &dyn Fn(usize) -> f64) -> Vec<PlotCurve> {
    let of_row = |(index, row): (usize, &Measurement)| {
        let prediction = row.predicted_scaling.as_ref()?;
        let curve = |what: &str, scaling: &PredictedScaling| PlotCurve {
            name: format!("{what} predicted, {}", series_name(row, rows)),
            points: scaling
                .curve
                .iter()
                .map(|point| {
                    let [y, lower, upper] =
                        [point.speedup, point.lower, point.upper].map(|speedup| speedup * scale(point.cores));
                    Point { x: point.cores as f64, y, spread: Some([lower, upper]), row: Some(index) }
                })
                .collect(),
            reference: false,
        };
        Some([curve("build", &prediction.build), curve("trace", &prediction.trace)])
    };
    rows.iter().enumerate().filter_map(of_row).flatten().collect()
}

/// One panel per quantity, over categories.
fn category_panels(
    rows: &[Measurement],
    category: impl Fn(&Measurement) -> String,
    series: impl Fn(&Measurement) -> String,
) -> Vec<Panel> {
    let has_tree = |row: &&Measurement| row.builder != "none";
    let mut categories: Vec<String> = Vec::new();
    for name in rows.iter().filter(has_tree).map(&category) {
        if !categories.contains(&name) {
            categories.push(name);
        }
    }
    let category_index = |row: &Measurement| {
        let name = category(row);
        Some(row).filter(has_tree).and_then(|_| categories.iter().position(|other| *other == name)).map(|at| at as f64)
    };
    quantity_panels(rows, ("", &categories), series, category_index)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::lab::sample::sample;
    use bvhscope_engine::tree::ContainerKind;

    /// Name of each curve, and its values from left to right.
    fn values(panel: &Panel) -> Vec<(&str, Vec<(f64, f64)>)> {
        let curve = |curve: &PlotCurve| curve.points.iter().map(|point| (point.x, point.y)).collect();
        panel.curves.iter().map(|one| (one.name.as_str(), curve(one))).collect()
    }

    #[test]
    fn relative_curves_are_one_at_the_papers_fast_setting() {
        let row = |threshold, build_ms, trace_ms, tests_per_ray| Measurement {
            command: "sweep".to_owned(),
            threshold,
            build_ms,
            trace_ms,
            tests_per_ray,
            ..sample()
        };
        let rows = [row(8, 10.0, 75.0, 14.0), row(4, 30.0, 25.0, 56.0), row(6, 20.0, 50.0, 28.0)];
        let all = panels(&rows).unwrap();
        let [relative, build, trace, tests, cost] = &all[..] else { unreachable!("{all:?}") };
        assert_eq!(relative.y_label, "Relative to δ = 6");
        let expected = [
            ("Build time", vec![(4.0, 1.5), (6.0, 1.0), (8.0, 0.5)]),
            ("Trace time", vec![(4.0, 0.5), (6.0, 1.0), (8.0, 1.5)]),
            ("Tests per ray", vec![(4.0, 2.0), (6.0, 1.0), (8.0, 0.5)]),
        ];
        assert_eq!(values(relative), expected);
        let series = "thing.obj, box";
        assert_eq!(values(build), [(series, vec![(4.0, 30.0), (6.0, 20.0), (8.0, 10.0)])]);
        assert_eq!(values(trace), [(series, vec![(4.0, 25.0), (6.0, 50.0), (8.0, 75.0)])]);
        assert_eq!(values(tests), [(series, vec![(4.0, 56.0), (6.0, 28.0), (8.0, 14.0)])]);
        assert_eq!(values(cost), [(series, vec![(4.0, 67.3), (6.0, 67.3), (8.0, 67.3)])]);
        let spreads = |panel: &Panel| panel.curves[0].points[0].spread;
        assert_eq!([build, trace, tests, cost].map(spreads), [Some([17.0, 23.0]), Some([47.0, 61.0]), None, None]);
        let labels = [build, trace, tests, cost].map(|panel| panel.y_label.as_str());
        assert_eq!(labels, ["Build time (ms)", "Trace time (ms)", "Tests per ray", "SAH cost"]);
        assert_eq!(build.curves[0].points[0].row, Some(1), "the second row has the smallest threshold");
    }

    #[test]
    fn a_tree_from_a_file_is_a_line_across_a_sweep() {
        let row = |threshold, build_ms| Measurement { command: "sweep".to_owned(), threshold, build_ms, ..sample() };
        let file = Measurement { tree: Some("a/mine.bvh".to_owned()), tests_per_ray: 9.0, ..row(6, f64::NAN) };
        let all = panels(&[row(2, 10.0), file, row(8, 30.0)]).unwrap();
        let [relative, build, _, tests, _] = &all[..] else { unreachable!("{all:?}") };
        assert_eq!(relative.curves.len(), 3);
        assert_eq!(values(build), [("thing.obj, box", vec![(2.0, 10.0), (8.0, 30.0)])], "its time is not known");
        assert_eq!(values(tests)[1], ("mine.bvh (aac)", vec![(2.0, 9.0), (8.0, 9.0)]));
        assert_eq!(tests.curves[1].points[0].row, Some(1));
    }

    #[test]
    fn efficiency_is_the_speed_up_for_each_thread() {
        let row = |threads, speedup, trace_speedup| Measurement {
            command: "scaling".to_owned(),
            threads,
            speedup: Some(speedup),
            trace_speedup,
            predicted_scaling: None,
            ..sample()
        };
        let all = panels(&[row(1, 1.0, Some(1.0)), row(2, 1.5, Some(1.75)), row(4, 3.0, None)]).unwrap();
        let [speedups, efficiencies] = &all[..] else { unreachable!("{all:?}") };
        let (build, trace) = ("build, thing.obj, box", "trace, thing.obj, box");
        let expected = [
            (build, vec![(1.0, 1.0), (2.0, 1.5), (4.0, 3.0)]),
            (trace, vec![(1.0, 1.0), (2.0, 1.75)]),
            ("ideal", vec![(1.0, 1.0), (4.0, 4.0)]),
        ];
        assert_eq!(values(speedups), expected);
        let expected = [
            (build, vec![(1.0, 100.0), (2.0, 75.0), (4.0, 75.0)]),
            (trace, vec![(1.0, 100.0), (2.0, 87.5)]),
            ("ideal", vec![(1.0, 100.0), (4.0, 100.0)]),
        ];
        assert_eq!(values(efficiencies), expected);
    }

    #[test]
    fn a_prediction_is_drawn_with_its_bounds() {
        let row = |threads| Measurement { command: "scaling".to_owned(), threads, ..sample() };
        let all = panels(&[row(1), Measurement { predicted_scaling: None, ..row(2) }]).unwrap();
        let [speedups, efficiencies] = &all[..] else { unreachable!("{all:?}") };
        let names: Vec<&str> = speedups.curves.iter().map(|curve| curve.name.as_str()).collect();
        let series =
            ["build", "trace", "build predicted", "trace predicted"].map(|what| format!("{what}, thing.obj, box"));
        assert_eq!(names, [&series[..], &["ideal".to_owned()]].concat());
        assert_eq!(values(speedups)[2].1, [(1.0, 1.0), (2.0, 1.75), (8.0, 5.5)]);
        assert_eq!(values(speedups)[4].1, [(1.0, 1.0), (8.0, 8.0)], "the ideal reaches as far");
        assert_eq!(speedups.curves[2].points[2].spread, Some([3.5, 7.25]));
        assert_eq!(values(efficiencies)[3].1, [(1.0, 100.0), (2.0, 87.5), (8.0, 68.75)]);
    }

    #[test]
    fn a_bench_has_a_point_for_each_scene_that_has_a_tree() {
        let row = |model: &str, container, build_ms, builder: &str| Measurement {
            model: model.to_owned(),
            container,
            build_ms,
            builder: builder.to_owned(),
            ..sample()
        };
        let (boxes, spheres) = (ContainerKind::Aabb, ContainerKind::Sphere);
        let rows = [
            row("a.obj", boxes, 3.0, "aac"),
            row("a.obj", boxes, 5.0, "none"),
            row("b.obj", boxes, 7.0, "aac"),
            row("b.obj", spheres, 11.0, "aac"),
        ];
        let build = &panels(&rows).unwrap()[0];
        assert_eq!(build.categories, ["a.obj", "b.obj"]);
        assert_eq!(values(build), [("box", vec![(0.0, 3.0), (1.0, 7.0)]), ("sphere", vec![(1.0, 11.0)])]);
        let mixed = [rows[0].clone(), Measurement { command: "sweep".to_owned(), ..sample() }];
        assert!(panels(&mixed).is_err() && panels(&[]).is_err());
    }
}
