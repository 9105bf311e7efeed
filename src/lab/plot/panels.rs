//! Measurements to panels: which plots each command shows.

use super::panel::{Panel, PlotCurve, Point};
use crate::lab::measurement::Measurement;
use crate::lab::report_table::{models, name_among};

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
/// threshold; scaling shows speed-up and efficiency; the others show each quantity by scene or by builder.
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
        "bench" => Ok(category_panels(rows, name, |row| row.container.name().to_owned())),
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
        curves: curves(rows, &series, |row| Some((x_of(row)?, value(row), spread.map(|spread| spread(row))))),
        categories: categories.to_vec(),
        relative_of: None,
    };
    QUANTITIES.iter().map(panel).collect()
}

const THRESHOLD: &str = "Threshold δ (primitives)";

fn sweep_panels(rows: &[Measurement]) -> Vec<Panel> {
    let series = |row: &Measurement| series_name(row, rows);
    let absolute = quantity_panels(rows, (THRESHOLD, &[]), series, |row| Some(f64::from(row.threshold)));
    let Some(all) = absolute.first().map(|panel| panel.curves.clone()) else { return absolute };
    let mut panels = Vec::new();
    if all.len() <= MAX_RELATIVE {
        panels.extend(all.iter().filter_map(|series| relative_panel(rows, series)));
    }
    panels.extend(absolute);
    panels
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
    let most = rows.iter().map(|row| row.threads).max().unwrap_or(1) as f64;
    let point = |x, y| Point { x, y, spread: None, row: None };
    let both = |scale: &dyn Fn(&Measurement) -> f64, ideal: Vec<Point>| {
        let speedups: [(&str, Speedup); 2] = [("build", |row| row.speedup), ("trace", |row| row.trace_speedup)];
        let mut list = Vec::new();
        for (what, speedup) in speedups {
            list.extend(curves(
                rows,
                |row| format!("{what}, {}", series_name(row, rows)),
                |row| Some((row.threads as f64, speedup(row)? * scale(row), None)),
            ));
        }
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
            both(&|row| 100.0 / row.threads.max(1) as f64, vec![point(1.0, 100.0), point(most, 100.0)]),
        ),
    ]
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
