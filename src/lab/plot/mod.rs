//! Plots of measurements: panels with axes, units and curves, drawn into files by [`draw()`] and on the screen by the window.

mod axis;
mod panel;
mod scatter;

mod panels;

mod format;

mod draw;

pub use axis::Axis;
pub use draw::{COLORS, draw};
pub use format::PlotFormat;
pub use panel::{Panel, PlotCurve, Point};
pub use panels::panels;
pub use scatter::{Scatter, ScatterSeries, SeriesLook, draw_scatters};
