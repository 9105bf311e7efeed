//! Plots of measurements: charts with axes, units and curves, drawn into files by [`draw()`] and on the screen by the window.

mod axis;
mod chart;

mod series;

mod forms;
mod layouts;
mod policies;
mod scaling;

mod charts;
mod notes;

mod bitmap;
mod figure;

mod draw;

pub use axis::{Axis, Scale};
pub use chart::{Chart, Curve, Look, Point, tick_text};
pub use draw::{COLORS, font, for_viewers, text_width};
pub use figure::{Figure, PlotFormat, draw};
pub use forms::{bytes_chart, figure_of, form_figure, visits_chart};
pub use layouts::{layout_chart, layout_figure};
