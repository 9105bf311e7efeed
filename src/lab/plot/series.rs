//! Rows of measurements as named curves.

use super::axis::Axis;
use super::chart::{Curve, Look, Point};
use crate::catalog::settings::THRESHOLD;
use crate::lab::measurement::{Measurement, model_views};
use crate::lab::report_table::name_among;

/// Scene and container, and of a sweep the settings beside the threshold, each only if the rows differ in it.
pub(super) fn series_name(row: &Measurement, rows: &[Measurement]) -> String {
    let mut parts = Vec::new();
    let models = model_views(rows);
    if models.len() > 1 {
        parts.push(name_among(row.view(), &models));
    }
    if rows.iter().any(|other| other.container != row.container) {
        parts.push(row.container.plural().to_owned());
    }
    if row.command == "sweep" {
        let others = row.settings.all().filter(|(setting, _)| *setting != &THRESHOLD);
        let differs =
            |setting, text: &String| rows.iter().filter_map(|row| row.settings.text(setting)).any(|t| t != *text);
        let differing = others.filter(|(setting, text)| differs(setting, text));
        parts.extend(differing.map(|(setting, text)| format!("{} = {text}", setting.symbol().unwrap_or(setting.key))));
    }
    if parts.is_empty() {
        parts.push(format!("{}, {}", name_among(row.view(), &models), row.container.plural()));
    }
    parts.join(", ")
}

/// Groups rows into curves by name, in order of appearance, which also gives them their colours.
pub(super) fn curves(
    rows: &[Measurement],
    name: impl Fn(&Measurement) -> String,
    point: impl Fn(&Measurement) -> Option<Point>,
) -> Vec<Curve> {
    let mut curves: Vec<Curve> = Vec::new();
    for (index, row) in rows.iter().enumerate() {
        let name = name(row);
        let position = curves.iter().position(|curve| curve.name == name).unwrap_or_else(|| {
            curves.push(Curve { name, color: curves.len(), look: Look::Measured, points: Vec::new() });
            curves.len() - 1
        });
        curves[position].points.extend(point(row).map(|point| Point { row: Some(index), ..point }));
    }
    curves.retain(|curve| !curve.points.is_empty());
    for curve in &mut curves {
        curve.points.sort_by(|a, b| a.x.total_cmp(&b.x));
    }
    curves
}

/// An axis on which all measured values and their spreads are.
pub(super) fn value_axis(curves: &[Curve], value: impl Fn(&Point) -> f64 + Copy) -> Axis {
    let points = curves.iter().flat_map(|curve| &curve.points);
    Axis::fitted(points.flat_map(move |point| point.spread.into_iter().flatten().chain([value(point)])))
}
