//! The plain data of charts: axes with units, and curves of points.

use super::axis::{Axis, Scale};
use crate::lab::report_table::number;

/// How the points of a curve are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Look {
    /// Markers joined by a line.
    Measured,
    /// A thin line from point to point, without markers.
    Line,
    /// A thin grey line to compare with.
    Reference,
    /// Dots.
    Dots,
    /// Rings around dots of other curves.
    Rings,
}

/// A curve of a chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// Index of its colour in [`COLORS`](super::COLORS), which repeats beyond its end.
    pub color: usize,
    /// How it is drawn.
    pub look: Look,
    /// Points, from left to right where a line joins them.
    pub points: Vec<Point>,
}

/// A point of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Value across; where the chart has rows, the measured one.
    pub x: f64,
    /// Value up; where the chart has rows, the index of the row from above.
    pub y: f64,
    /// Fastest and slowest repetition if the value is a median of times; the bounds of a prediction.
    pub spread: Option<[f64; 2]>,
    /// Index of the measurement that it comes from; `None` for a reference.
    pub row: Option<usize>,
}

impl Point {
    /// A point that comes from no measurement.
    pub const fn of([x, y]: [f64; 2]) -> Self {
        Self { x, y, spread: None, row: None }
    }
}

/// Curves over a pair of axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Title above it; may be empty.
    pub title: String,
    /// Labels of the axes, with units: across and up.
    pub labels: [String; 2],
    /// The axes: across and up.
    pub axes: [Axis; 2],
    /// The curves, from below.
    pub curves: Vec<Curve>,
    /// Names of the rows from above, if what is up is the index of a row; empty otherwise.
    pub rows: Vec<String>,
}

impl Chart {
    /// The measured value of a point, and its label with the unit: across where the chart has rows, else up.
    pub fn value(&self, point: &Point) -> (f64, &str) {
        if self.rows.is_empty() { (point.y, &self.labels[1]) } else { (point.x, &self.labels[0]) }
    }

    /// The ends of the line of a point's spread, as values across and up; `None` where it has no length.
    pub fn whisker(&self, point: &Point) -> Option<[[f64; 2]; 2]> {
        let ends = point.spread.filter(|[low, high]| high > low)?;
        Some(ends.map(|end| if self.rows.is_empty() { [point.x, end] } else { [end, point.y] }))
    }

    /// The curves are joined by lines: their markers alone do not fill the legend.
    pub fn is_joined(&self) -> bool {
        self.rows.is_empty()
    }
}

/// Text of a labelled value of `axis`.
pub fn tick_text(axis: &Axis, value: f64) -> String {
    if axis.is_never(value) {
        return "never".to_owned();
    }
    if axis.scale == Scale::Whole || axis.scale == Scale::Doublings {
        return number(value.round()).split('.').next().unwrap_or_default().to_owned();
    }
    let text = number(value);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labelled_values_are_short() {
        let axis = |scale| Axis { low: 0.1, high: 1e4, scale };
        let text = |scale, value| tick_text(&axis(scale), value);
        assert_eq!([2.5, 2000.0, 0.0].map(|value| text(Scale::Log, value)), ["2.5", "2,000", "0"]);
        assert_eq!(text(Scale::Doublings, 64.0), "64");
        assert_eq!([0.0, 1.0].map(|value| text(Scale::Counts, value)), ["never", "1"]);
    }
}
