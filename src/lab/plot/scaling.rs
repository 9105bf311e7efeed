//! The charts of speed-up on more threads.

use super::axis::{Axis, Scale};
use super::chart::{Chart, Curve, Look, Point};
use super::series::{curves, series_name};
use crate::catalog::numbers::rows::{BUILD_MS, SPEEDUP, TRACE_MS, TRACE_SPEEDUP};
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
    let from_zero = |curves: &[Curve]| Axis { low: 0.0, ..Axis::linear(values(curves)) };
    let as_doublings = |curves: &[Curve]| {
        let fitted = Axis::logarithmic(values(curves));
        Axis { scale: Scale::Doublings, ..fitted }
    };
    vec![
        chart("Speed-up over one thread (×)", ideal([[1.0; 2], [most; 2]]), speedups, as_doublings),
        chart("Parallel efficiency (%)", ideal([[1.0, 100.0], [most, 100.0]]), efficiencies, from_zero),
    ]
}

/// All values, and the ends of the spreads of those that were measured: bounds of predictions may lie beyond the axes.
fn values(curves: &[Curve]) -> impl Iterator<Item = f64> + '_ {
    curves.iter().flat_map(|curve| {
        let is_measured = curve.look == Look::Measured;
        curve
            .points
            .iter()
            .flat_map(move |point| point.spread.filter(|_| is_measured).into_iter().flatten().chain([point.y]))
    })
}

/// The predicted speed-ups, and above them those that were measured, in the same colours.
fn speedup_curves(rows: &[Measurement]) -> Vec<Curve> {
    let quantities = [("build", SPEEDUP, BUILD_MS), ("trace", TRACE_SPEEDUP, TRACE_MS)];
    let mut measured = Vec::new();
    for (what, speedup, time) in quantities {
        let name = |row: &Measurement| format!("{what}, {}", series_name(row, rows));
        let point = |row: &Measurement| {
            let speedup = row.values.known(speedup)?;
            // The slowest repetition has the least speed-up over the median of one thread.
            let of_one = speedup * row.number(time);
            let spread = row.values.spread(time).map(|[fastest, slowest]| [of_one / slowest, of_one / fastest]);
            Some(Point { spread, ..Point::of([row.threads as f64, speedup]) })
        };
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
