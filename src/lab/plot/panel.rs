//! The plain data of a plot: panels with axes, units and curves.

/// A curve of a panel.
#[derive(Debug, Clone, PartialEq)]
pub struct PlotCurve {
    /// Name in the legend.
    pub name: String,
    /// Points from left to right.
    pub points: Vec<Point>,
    /// Whether this is a reference, drawn thin and grey without markers.
    pub reference: bool,
}

/// A point of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Horizontal coordinate.
    pub x: f64,
    /// Vertical coordinate.
    pub y: f64,
    /// Fastest and slowest repetition if `y` is a median of times; the bounds of a prediction.
    pub spread: Option<[f64; 2]>,
    /// Index of the measurement that it comes from; `None` for a reference.
    pub row: Option<usize>,
}

/// A pair of axes with curves.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Label of the horizontal axis, with unit.
    pub x_label: String,
    /// Label of the vertical axis, with unit.
    pub y_label: String,
    /// The curves.
    pub curves: Vec<PlotCurve>,
    /// Category names if x is an index of a category; empty otherwise.
    pub categories: Vec<String>,
    /// Name of the series if the curves are different quantities of that one series, normalised; such panels have a legend of
    /// their own. `None` if the curves are one quantity of every series.
    pub relative_of: Option<String>,
}
