//! The charts of the forms of a scene of copies: nodes and blocks of a ray over how far the tree above is opened.

use super::axis::Axis;
use super::chart::{Chart, Curve, Look, Point};
use super::figure::Figure;
use crate::lab::copy_forms::FormRow;
use crate::lab::report_table::short;
use crate::text::counted;

/// A chart with a curve for the rays of each population, and a line for each where the scene is flat.
pub fn form_figure(rows: &[FormRow]) -> Figure {
    let mut notes = Vec::new();
    if let Some(row) = rows.first() {
        notes.push(format!(
            "{}, {} of all copies. Wide nodes and blocks that a ray visits in both levels, over the number of parts for each copy in the tree above. Grey: the flat scene.",
            short(&row.model),
            counted(row.triangles as u64, "triangles")
        ));
    }
    let opened: Vec<f64> = rows.iter().filter_map(|row| row.form.open).map(f64::from).collect();
    let across = Axis::fitted(opened.iter().copied());
    let mut curves: Vec<Curve> = Vec::new();
    for row in rows.iter().filter(|row| row.form.open.is_none()) {
        let ends = opened.iter().copied().reduce(f64::min).zip(opened.iter().copied().reduce(f64::max));
        let points = ends.map_or_else(Vec::new, |(least, most)| {
            [least, most].map(|open| Point::of([open, row.cost.visits_per_ray()])).to_vec()
        });
        let name = format!("{}, flat", row.population.label());
        curves.push(Curve { name, color: 0, look: Look::Reference, points });
    }
    for row in rows {
        let Some(open) = row.form.open else { continue };
        let name = row.population.label().to_owned();
        let at = curves.iter().position(|curve| curve.name == name).unwrap_or_else(|| {
            let color = curves.iter().filter(|curve| curve.look == Look::Measured).count();
            curves.push(Curve { name, color, look: Look::Measured, points: Vec::new() });
            curves.len() - 1
        });
        curves[at].points.push(Point::of([f64::from(open), row.cost.visits_per_ray()]));
    }
    let up = Axis::fitted(curves.iter().flat_map(|curve| &curve.points).map(|point| point.y));
    let labels = ["Parts for each copy".to_owned(), "Nodes and blocks a ray".to_owned()];
    Figure { charts: vec![Chart { title: String::new(), labels, axes: [across, up], curves, rows: Vec::new() }], notes }
}
