//! The plain data of a plot: panels with axes, units and curves.

/// One line of a panel.
#[derive(Debug, Clone, PartialEq)]
pub struct PlotCurve {
    /// What the legend says.
    pub name: String,
    /// Points from left to right.
    pub points: Vec<Point>,
    /// Drawn thin and grey, without markers: a reference.
    pub reference: bool,
}

/// One measured value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Place on the horizontal axis.
    pub x: f64,
    /// Place on the vertical axis.
    pub y: f64,
    /// Fastest and slowest repetition, where `y` is a median of times.
    pub spread: Option<[f64; 2]>,
    /// The row that it comes from, counted from 0; a reference has none.
    pub row: Option<usize>,
}

/// One pair of axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// What lies across, with its unit.
    pub x_label: String,
    /// What goes up, with its unit.
    pub y_label: String,
    /// Its lines.
    pub curves: Vec<PlotCurve>,
    /// Names under the axis where x counts things without a number; empty otherwise.
    pub categories: Vec<String>,
    /// Different quantities of this one series relative to each other, where other panels show one quantity of every
    /// series; it has a legend of its own.
    pub relative_of: Option<String>,
}
