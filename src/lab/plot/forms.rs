//! The charts of the forms of a scene of copies: nodes and blocks of a ray over how far the tree above is opened.

use super::axis::Axis;
use super::chart::{Chart, Curve, Look, Point};
use super::figure::Figure;
use crate::lab::copy_forms::CostInForm;
use crate::lab::cost_row::{CostRow, by_population};
use crate::lab::report_table::short;
use crate::text::counted;

/// A chart for the rays of each population, with a line for the flat scene, and one of the bytes of trees.
pub fn form_figure(rows: &[CostRow<CostInForm>]) -> Figure {
    let scene = rows.first().map_or_else(String::new, |row| {
        format!("{}, {} of all copies", short(&row.model), counted(row.triangles as u64, "triangles"))
    });
    figure_of(&scene, &by_population(rows))
}

/// The same of `scene`, by the rows of each population.
pub fn figure_of(scene: &str, of_rays: &[Vec<&CostInForm>]) -> Figure {
    let note = format!(
        "{scene}. Wide nodes and blocks that a ray visits in both levels, and bytes of what rays read, over the number of parts for each copy in the tree above."
    );
    let mut charts: Vec<Chart> = of_rays.iter().map(|rows| visits_chart(rows)).collect();
    charts.extend(of_rays.first().map(|rows| bytes_chart(rows)));
    Figure { notes: vec![note], charts }
}

/// Nodes and blocks of a ray of one population.
pub fn visits_chart(rows: &[&CostInForm]) -> Chart {
    let title = rows.first().map_or("", |row| row.population.label());
    chart(title, "Nodes and blocks a ray", rows, |row| row.cost.visits_per_ray())
}

/// Bytes of what rays read.
pub fn bytes_chart(rows: &[&CostInForm]) -> Chart {
    chart("All rays", "Trees, MB", rows, |row| row.form.traced_bytes as f64 / 1e6)
}

/// `value` of each form, up, over how far the tree above is opened.
fn chart(title: &str, up: &str, rows: &[&CostInForm], value: fn(&CostInForm) -> f64) -> Chart {
    let mut opened: Vec<[f64; 2]> =
        rows.iter().filter_map(|row| Some([f64::from(row.form.open?), value(row)])).collect();
    opened.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let ends = || [opened.first(), opened.last()].into_iter().flatten();
    let flat = rows.iter().filter(|row| row.form.open.is_none());
    let flat = flat.flat_map(|row| ends().map(|[open, _]| Point::of([*open, value(row)])));
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
    let axes = [Axis::fitted(points().map(|point| point.x)), Axis::fitted(points().map(|point| point.y))];
    let labels = ["Parts for each copy".to_owned(), up.to_owned()];
    Chart { title: title.to_owned(), labels, axes, curves, rows: Vec::new() }
}
