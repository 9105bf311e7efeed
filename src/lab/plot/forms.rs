//! The charts of the forms of a scene of copies: nodes and blocks of a ray over how far the tree above is opened.

use super::axis::Axis;
use super::chart::{Chart, Curve, Look, Point};
use super::figure::Figure;
use crate::lab::copy_forms::CostInForm;
use crate::lab::cost_row::{CostRow, by_population};
use crate::lab::report_table::short;
use crate::text::counted;

/// A chart for the rays of each population, with a line for the flat scene.
pub fn form_figure(rows: &[CostRow<CostInForm>]) -> Figure {
    let mut notes = Vec::new();
    if let Some(row) = rows.first() {
        notes.push(format!(
            "{}, {} of all copies. Wide nodes and blocks that a ray visits in both levels, over the number of parts for each copy in the tree above.",
            short(&row.model),
            counted(row.triangles as u64, "triangles")
        ));
    }
    let of_rays = by_population(rows);
    let charts = of_rays.iter().map(|rows| chart(rows));
    Figure { charts: charts.collect(), notes }
}

fn chart(rows: &[&CostInForm]) -> Chart {
    let opened: Vec<[f64; 2]> =
        rows.iter().filter_map(|row| Some([f64::from(row.form.open?), row.cost.visits_per_ray()])).collect();
    let ends = || [opened.first(), opened.last()].into_iter().flatten();
    let flat = rows.iter().filter(|row| row.form.open.is_none()).flat_map(|row| {
        let visits = row.cost.visits_per_ray();
        ends().map(move |[open, _]| Point::of([*open, visits]))
    });
    let curves = vec![
        Curve { name: "flat".to_owned(), color: 0, look: Look::Reference, points: flat.collect() },
        Curve {
            name: "two levels".to_owned(),
            color: 0,
            look: Look::Measured,
            points: opened.iter().map(|&point| Point::of(point)).collect(),
        },
    ];
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let axes = [Axis::fitted(points().map(|point| point.x)), Axis::linear(points().map(|point| point.y))];
    let labels = ["Parts for each copy".to_owned(), "Nodes and blocks a ray".to_owned()];
    Chart { title: rows[0].population.label().to_owned(), labels, axes, curves, rows: Vec::new() }
}
