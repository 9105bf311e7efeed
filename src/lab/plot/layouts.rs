//! The charts of layouts: tests against bytes of a ray, and their front.

use super::axis::Axis;
use super::chart::{Chart, Curve, Look, Point};
use super::figure::Figure;
use crate::lab::cost_row::{CostRow, by_population};
use crate::lab::layouts::LaidOut;
use crate::lab::report_table::short;
use crate::text::counted;

/// A chart for each population: a dot for each layout, in a colour for each number of children, and a line through those that no other one beats.
pub fn layout_figure(rows: &[CostRow<LaidOut>]) -> Figure {
    let mut notes = Vec::new();
    if let Some(row) = rows.first() {
        let triangles = counted(row.triangles as u64, "triangles");
        notes.push(format!(
            "{}, {triangles}. A dot for each layout: boxes and triangles that a ray is tested against over bytes of the nodes and triangles that it reads. The line joins those that no other \
             one beats in both.",
            short(&row.model)
        ));
    }
    let of_rays = by_population(rows);
    let charts = of_rays.iter().map(|rows| layout_chart(rows[0].population.label(), rows));
    Figure { charts: charts.collect(), notes }
}

/// The layouts of the rays of one population.
pub fn layout_chart(title: &str, rows: &[&LaidOut]) -> Chart {
    let place = |row: &LaidOut| Point::of([row.rays.bytes_per_ray, row.rays.tests_per_ray]);
    let mut front: Vec<Point> = rows.iter().filter(|row| row.on_front).map(|row| place(row)).collect();
    front.sort_by(|a, b| a.x.total_cmp(&b.x));
    let mut curves = vec![Curve { name: "front".to_owned(), color: 0, look: Look::Reference, points: front }];
    for row in rows {
        let name = row.layout.group();
        let at = curves.iter().position(|curve| curve.name == name).unwrap_or_else(|| {
            curves.push(Curve { name, color: curves.len(), look: Look::Dots, points: Vec::new() });
            curves.len() - 1
        });
        curves[at].points.push(place(row));
    }
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let axes = [Axis::fitted(points().map(|point| point.x)), Axis::fitted(points().map(|point| point.y))];
    let labels = ["Bytes a ray".to_owned(), "Tests a ray".to_owned()];
    Chart { title: title.to_owned(), labels, axes, curves, rows: Vec::new() }
}
