//! The charts of speed-up on more threads.

use super::axis::{Axis, Scale};
use super::chart::{Chart, Curve, Look, Point};
use super::series::{curves, series_name};
use crate::catalog::numbers::rows::{SPEEDUP, TRACE_SPEEDUP};
use crate::lab::measurement::Measurement;
use crate::lab::speedup::prediction::{PredictedScaling, PredictedSpeedup};

/// Speed-up and efficiency by threads, those that were measured and those that are predicted.
pub(super) fn scaling_charts(rows: &[Measurement]) -> Vec<Chart> {
    let speedups = speedup_curves(rows);
    let points = speedups.iter().flat_map(|curve| &curve.points);
    let most = points.map(|point| point.x).fold(1.0, f64::max);
    let ideal = |ends: [[f64; 2]; 2]| Curve {
        name: "ideal".to_owned(),
        color: 0,
        look: Look::Reference,
        points: ends.map(Point::of).to_vec(),
    };
    let chart = |label: &str, reference: Curve, measured: Vec<Curve>, up: fn(&[Curve]) -> Axis| {
        let curves: Vec<Curve> = std::iter::once(reference).chain(measured).collect();
        Chart {
            title: String::new(),
            labels: ["Threads".to_owned(), label.to_owned()],
            axes: [Axis::doublings(most), up(&curves)],
            curves,
            rows: Vec::new(),
        }
    };
    let mut efficiencies = speedups.clone();
    for point in efficiencies.iter_mut().flat_map(|curve| &mut curve.points) {
        let percent = 100.0 / point.x.max(1.0);
        point.y *= percent;
        point.spread = point.spread.map(|spread| spread.map(|end| end * percent));
    }
    let from_zero = |curves: &[Curve]| {
        let values = curves.iter().flat_map(|curve| &curve.points).map(|point| point.y);
        Axis { low: 0.0, ..Axis::linear(values) }
    };
    let as_doublings = |curves: &[Curve]| {
        let fitted = Axis::logarithmic(curves.iter().flat_map(|curve| &curve.points).map(|point| point.y));
        Axis { scale: Scale::Doublings, ..fitted }
    };
    vec![
        chart("Speed-up over one thread (×)", ideal([[1.0; 2], [most; 2]]), speedups, as_doublings),
        chart("Parallel efficiency (%)", ideal([[1.0, 100.0], [most, 100.0]]), efficiencies, from_zero),
    ]
}

/// The predicted speed-ups, and above them those that were measured, in the same colours.
fn speedup_curves(rows: &[Measurement]) -> Vec<Curve> {
    let quantities = [("build", SPEEDUP), ("trace", TRACE_SPEEDUP)];
    let mut measured = Vec::new();
    for (what, speedup) in quantities {
        let name = |row: &Measurement| format!("{what}, {}", series_name(row, rows));
        let point = |row: &Measurement| Some(Point::of([row.threads as f64, row.values.known(speedup)?]));
        measured.extend(curves(rows, name, point).into_iter().map(|curve| (what, curve)));
    }
    for (color, (_, curve)) in measured.iter_mut().enumerate() {
        curve.color = color;
    }
    let color_of =
        |name: &str| measured.iter().find(|(_, curve)| curve.name == name).map_or(0, |(_, curve)| curve.color);
    let predicted = predicted_curves(rows, color_of);
    predicted.into_iter().chain(measured.into_iter().map(|(_, curve)| curve)).collect()
}

/// The predicted speed-ups with their bounds. `color_of` is the colour of the measured curve of a name.
fn predicted_curves(rows: &[Measurement], color_of: impl Fn(&str) -> usize) -> Vec<Curve> {
    let mut curves = Vec::new();
    for (index, row) in rows.iter().enumerate() {
        let Some(prediction) = &row.predicted_scaling else { continue };
        let parts: [(&str, &str, &PredictedScaling); 2] =
            [("build", "ready to trace", &prediction.build), ("trace", "trace", &prediction.trace)];
        for (measured, what, scaling) in parts {
            let series = series_name(row, rows);
            let point = |point: &PredictedSpeedup| Point {
                x: point.cores as f64,
                y: point.speedup,
                spread: Some([point.lower, point.upper]),
                row: Some(index),
            };
            curves.push(Curve {
                name: format!("{what} predicted, {series}"),
                color: color_of(&format!("{measured}, {series}")),
                look: Look::Line,
                points: scaling.curve.iter().map(point).collect(),
            });
        }
    }
    curves
}
